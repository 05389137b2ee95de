//! The part of YAML that OpenCV's FileStorage and ROS write: block maps and lists, flow lists and maps, numbers and texts.
//! OpenCV's first line (`%YAML:1.0`) is not YAML, so that general readers refuse its files.

use serde_json::{Map, Number, Value};

use crate::{
    Error, Result,
    text::{Lines, quote},
};

/// Deeper nesting is not a calibration.
const DEEPEST: usize = 16;

/// A line that says something, and the lines that its brackets continue on.
#[derive(Debug)]
struct Logical {
    number: usize,
    indent: usize,
    text: String,
}

pub(super) fn read(text: &str) -> Result<Value> {
    let mut lines = logical_lines(text)?;
    let mut at = 0;
    if lines.is_empty() {
        return Ok(Value::Object(Map::new()));
    }
    let indent = lines[0].indent;
    let value = block(&mut lines, &mut at, indent, 0)?;
    match lines.get(at) {
        None => Ok(value),
        Some(line) => Err(wrong(line.number, &line.text, "a name that is indented as the others")),
    }
}

fn wrong(number: usize, text: &str, expected: &str) -> Error {
    Error::at_line(number, quote(text.as_bytes()), expected)
}

fn logical_lines(text: &str) -> Result<Vec<Logical>> {
    let mut logical: Vec<Logical> = Vec::new();
    let mut open = Brackets::default();
    let mut lines = Lines::new(text.as_bytes());
    while let Some(line) = lines.next_untrimmed() {
        // lines are cut at ASCII characters, so they are text again
        let whole = std::str::from_utf8(line.text).unwrap_or_default();
        let words = whole.trim();
        if open.depth > 0 {
            let words = open.take(words);
            if let Some(last) = logical.last_mut() {
                last.text.push(' ');
                last.text.push_str(words);
            }
            continue;
        }
        if words.is_empty() || words.starts_with(['#', '%']) || words == "---" || words == "..." {
            continue;
        }
        let indent = whole.len() - whole.trim_start().len();
        let words = open.take(words);
        logical.push(Logical { number: line.number, indent, text: words.to_owned() });
    }
    match logical.last() {
        Some(last) if open.depth > 0 => Err(wrong(last.number, &last.text, "brackets that are closed")),
        _ => Ok(logical),
    }
}

/// How many brackets of flow lists and maps are open.
#[derive(Default)]
struct Brackets {
    depth: usize,
}

impl Brackets {
    /// Counts the brackets of a line; gives the line without its comment.
    fn take<'t>(&mut self, text: &'t str) -> &'t str {
        let mut quoted = None;
        let mut before = ' ';
        for (at, c) in text.char_indices() {
            match (quoted, c) {
                (Some(end), c) => quoted = (c != end).then_some(end),
                (None, '"' | '\'') if !before.is_alphanumeric() => quoted = Some(c),
                (None, '#') if before.is_whitespace() => return text[..at].trim_end(),
                (None, '[' | '{') => self.depth += 1,
                (None, ']' | '}') => self.depth = self.depth.saturating_sub(1),
                _ => {}
            }
            before = c;
        }
        text
    }
}

/// The map, list or value whose lines begin at `indent`.
fn block(lines: &mut [Logical], at: &mut usize, indent: usize, depth: usize) -> Result<Value> {
    if depth > DEEPEST {
        return Err(wrong(lines[*at].number, &lines[*at].text, "less nesting"));
    }
    if is_item(&lines[*at].text) {
        return list(lines, at, indent, depth);
    }
    if split_name(&lines[*at].text).is_none() {
        let value = value(&lines[*at])?;
        *at += 1;
        return Ok(value);
    }
    let mut map = Map::new();
    while let Some(line) = lines.get(*at).filter(|line| line.indent == indent && !is_item(&line.text)) {
        let Some((name, rest)) = split_name(&line.text) else {
            return Err(wrong(line.number, &line.text, "a name and a colon"));
        };
        let (name, rest) = (name.trim_matches(['"', '\'']).to_owned(), without_tag(rest));
        let number = line.number;
        let child = if rest.is_empty() {
            *at += 1;
            match lines.get(*at).map(|next| (next.indent, is_item(&next.text))) {
                Some((inner, is_item)) if inner > indent || inner == indent && is_item => {
                    block(lines, at, inner, depth + 1)?
                }
                _ => Value::Null,
            }
        } else {
            let child = value(&Logical { number, indent, text: rest.to_owned() })?;
            *at += 1;
            child
        };
        if map.insert(name.clone(), child).is_some() {
            return Err(Error::at_line(number, format!("a second {}", quote(name.as_bytes())), "names once"));
        }
    }
    Ok(Value::Object(map))
}

fn list(lines: &mut [Logical], at: &mut usize, indent: usize, depth: usize) -> Result<Value> {
    let mut items = Vec::new();
    while lines.get(*at).is_some_and(|line| line.indent == indent && is_item(&line.text)) {
        let line = &mut lines[*at];
        let rest = line.text[1..].trim_start();
        if rest.is_empty() {
            *at += 1;
            let inner = lines.get(*at).map(|next| next.indent).filter(|inner| *inner > indent);
            items.push(match inner {
                Some(inner) => block(lines, at, inner, depth + 1)?,
                None => Value::Null,
            });
        } else {
            // what follows the dash is a block of its own, indented to where it stands
            line.indent += line.text.len() - rest.len();
            line.text = without_tag(rest).to_owned();
            let inner = line.indent;
            items.push(block(lines, at, inner, depth + 1)?);
        }
    }
    Ok(Value::Array(items))
}

fn is_item(text: &str) -> bool {
    text == "-" || text.starts_with("- ")
}

/// Name and value of `name: value`.
fn split_name(text: &str) -> Option<(&str, &str)> {
    if text.starts_with(['[', '{']) {
        return None;
    }
    let (name, rest) = text.split_once(':')?;
    (rest.is_empty() || rest.starts_with([' ', '\t'])).then(|| (name.trim(), rest.trim()))
}

/// Without a type such as `!!opencv-matrix`.
fn without_tag(text: &str) -> &str {
    if text.starts_with('!') {
        text.split_once(char::is_whitespace).map_or("", |(_, rest)| rest.trim())
    } else {
        text
    }
}

fn value(line: &Logical) -> Result<Value> {
    let mut flow = Flow { rest: line.text.trim(), number: line.number };
    if !flow.rest.starts_with(['[', '{']) {
        return Ok(scalar(flow.rest));
    }
    let value = flow.value(0)?;
    if flow.rest.trim().is_empty() {
        Ok(value)
    } else {
        Err(wrong(line.number, flow.rest.trim(), "the end of the line"))
    }
}

fn scalar(text: &str) -> Value {
    let is_quoted = |mark: char| text.len() > 1 && text.starts_with(mark) && text.ends_with(mark);
    if is_quoted('"') || is_quoted('\'') {
        return Value::String(text[1..text.len() - 1].to_owned());
    }
    match text {
        "true" | "True" => Value::Bool(true),
        "false" | "False" => Value::Bool(false),
        "" | "~" | "null" => Value::Null,
        _ => text
            .parse::<f64>()
            .ok()
            .and_then(Number::from_f64)
            .map_or_else(|| Value::String(text.to_owned()), Value::Number),
    }
}

/// A list in `[]` or a map in `{}`.
struct Flow<'t> {
    rest: &'t str,
    number: usize,
}

impl Flow<'_> {
    fn value(&mut self, depth: usize) -> Result<Value> {
        self.rest = self.rest.trim_start();
        if depth > DEEPEST {
            return Err(wrong(self.number, self.rest, "less nesting"));
        }
        if self.take('[') {
            let mut list = Vec::new();
            while !self.ends(']')? {
                list.push(self.value(depth + 1)?);
                self.comma(']')?;
            }
            return Ok(Value::Array(list));
        }
        if self.take('{') {
            let mut map = Map::new();
            while !self.ends('}')? {
                let Some((name, rest)) = self.rest.split_once(':') else {
                    return Err(wrong(self.number, self.rest, "a name and a colon"));
                };
                let name = name.trim().trim_matches(['"', '\'']).to_owned();
                self.rest = rest;
                map.insert(name, self.value(depth + 1)?);
                self.comma('}')?;
            }
            return Ok(Value::Object(map));
        }
        let end = self.rest.find([',', ']', '}']).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Ok(scalar(without_tag(word.trim())))
    }

    fn take(&mut self, mark: char) -> bool {
        let rest = self.rest.strip_prefix(mark);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn ends(&mut self, mark: char) -> Result<bool> {
        self.rest = self.rest.trim_start();
        if self.rest.is_empty() {
            return Err(Error::at_line(self.number, "the end of the list", format!("{mark}")));
        }
        Ok(self.take(mark))
    }

    /// A comma, or the closing bracket, which stays.
    fn comma(&mut self, close: char) -> Result<()> {
        self.rest = self.rest.trim_start();
        if self.take(',') || self.rest.starts_with(close) {
            return Ok(());
        }
        Err(wrong(self.number, self.rest, "a comma or a closing bracket"))
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn what_opencv_and_ros_write_is_read() {
        let text = "%YAML:1.0\n---\ncount: 2 # two\nK: !!opencv-matrix\n   rows: 1\n   dt: d\n   data: [ 1., 2e-1,\n       \
                    -.5 ]\nname: \"a: b\"\nlist:\n- x: 1\n  y: [ {a: 1}, 2 ]\n- 5\nempty:\nlast: { k: v, w: [] }\n";
        let expected = json!({
            "count": 2.0, "K": {"rows": 1.0, "dt": "d", "data": [1.0, 0.2, -0.5]}, "name": "a: b",
            "list": [{"x": 1.0, "y": [{"a": 1.0}, 2.0]}, 5.0], "empty": null, "last": {"k": "v", "w": []},
        });
        assert_eq!(read(text).unwrap(), expected);
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        let message = |text: &str| read(text).unwrap_err().to_string();
        assert_eq!(
            message("a: 1\nb: [1, 2\n"),
            "line 2: found \"b: [1, 2\", expected brackets that are closed"
        );
        assert_eq!(message("a: 1\na: 2\n"), "line 2: found a second \"a\", expected names once");
        assert!(message("a: 1\n  b\n").starts_with("line 2: found \"b\""));
        assert!(message(&"- ".repeat(1000)).contains("less nesting"));
        assert!(message(&format!("a: {}", "[".repeat(1000) + &"]".repeat(1000))).contains("less nesting"));
    }
}
