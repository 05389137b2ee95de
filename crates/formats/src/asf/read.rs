use model::{Axis, Channel};
use nalgebra::Vector3;

use super::{
    File,
    sections::{Children, RawBone, Root, Units},
    tree,
};
use crate::{
    Error, Read, Result,
    read::Warnings,
    text::{Line, Lines, finite, name, number, quote, words},
};

/// Reads a skeleton.
///
/// # Errors
/// If a section, a bone or the hierarchy is not as the format wants it, or has something that a skeleton can't
/// represent (the `l` DOF, translations of a bone whose `axis` is not 0).
pub fn read(bytes: &[u8]) -> Result<Read<File>> {
    let mut parser = Parser {
        lines: Lines::new(bytes),
        name: String::new(),
        units: Units { metres: None, radians: None },
        root: None,
        bones: Vec::new(),
        hierarchy: Vec::new(),
        warnings: Warnings::default(),
    };
    parser.sections()?;
    let Parser { lines, name, units, root, bones, hierarchy, mut warnings } = parser;
    let Some(root) = root else {
        return Err(Error::at_line(lines.number(), "the end of the file", "a :root section"));
    };
    let file = tree::build(name, units, root, bones, &hierarchy, &mut warnings)?;
    Ok(warnings.beside(file))
}

struct Parser<'a> {
    lines: Lines<'a>,
    name: String,
    units: Units,
    root: Option<Root>,
    bones: Vec<RawBone>,
    hierarchy: Vec<Children<'a>>,
    warnings: Warnings,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Section {
    Start,
    Skipped,
    Units,
    Root,
    Bones,
    Hierarchy,
}

impl<'a> Parser<'a> {
    fn sections(&mut self) -> Result<()> {
        let mut section = Section::Start;
        while let Some(line) = self.next_line() {
            if line.text.starts_with(b":") {
                section = self.section(line)?;
                continue;
            }
            match section {
                Section::Skipped => {}
                Section::Start => {
                    return Err(Error::at_line(line.number, quote(line.text), "a section such as :version"));
                }
                Section::Units => self.unit(line)?,
                Section::Root => self.root_property(line)?,
                Section::Bones => self.bone(line)?,
                Section::Hierarchy => self.children(line),
            }
        }
        Ok(())
    }

    /// The next line that is neither empty nor a comment.
    fn next_line(&mut self) -> Option<Line<'a>> {
        self.lines.find_map(|line| {
            let end = line.text.iter().position(|b| *b == b'#').unwrap_or(line.text.len());
            let text = line.text[..end].trim_ascii();
            (!text.is_empty()).then_some(Line { text, ..line })
        })
    }

    fn section(&mut self, line: Line<'a>) -> Result<Section> {
        let (key, rest) = key_and_rest(line.text);
        Ok(match key.to_ascii_lowercase().as_slice() {
            b":name" => {
                self.name = name(rest);
                Section::Skipped
            }
            b":version" | b":documentation" => Section::Skipped,
            b":units" => Section::Units,
            b":root" if self.root.is_some() => {
                return Err(Error::at_line(line.number, "a second :root section", "one"));
            }
            b":root" => {
                self.root = Some(Root {
                    line: line.number,
                    channels: Vec::new(),
                    axis_order: None,
                    position: Vector3::zeros(),
                    orientation: [0.0; 3],
                });
                Section::Root
            }
            b":bonedata" => Section::Bones,
            b":hierarchy" => Section::Hierarchy,
            _ => {
                self.warnings.line(line.number, format!("section {} is skipped", quote(key)));
                Section::Skipped
            }
        })
    }

    fn unit(&mut self, line: Line<'a>) -> Result<()> {
        let (key, rest) = key_and_rest(line.text);
        match key.to_ascii_lowercase().as_slice() {
            b"length" => {
                let per_inch = finite(rest).filter(|v| *v > 0.0 && (1e-6..=1e6).contains(v));
                let Some(per_inch) = per_inch else {
                    return Err(Error::at_line(line.number, quote(rest), "a length unit from 1e-6 to 1e6"));
                };
                self.units.metres = Some(0.0254 / per_inch);
            }
            b"angle" if rest.to_ascii_lowercase().starts_with(b"deg") => {
                self.units.radians = Some(1f64.to_radians());
            }
            b"angle" if rest.to_ascii_lowercase().starts_with(b"rad") => self.units.radians = Some(1.0),
            b"angle" => return Err(Error::at_line(line.number, quote(rest), "angle deg or angle rad")),
            _ => {}
        }
        Ok(())
    }

    fn root_property(&mut self, line: Line<'a>) -> Result<()> {
        let (key, rest) = key_and_rest(line.text);
        let Some(root) = &mut self.root else { return Ok(()) };
        match key.to_ascii_lowercase().as_slice() {
            b"order" => root.channels = channels(line.number, rest)?,
            b"axis" => root.axis_order = Some(axis_order(line.number, rest)?),
            b"position" => root.position = three(line.number, rest)?.into(),
            b"orientation" => root.orientation = three(line.number, rest)?,
            _ => self.warnings.line(line.number, format!("{} of the root is skipped", quote(key))),
        }
        Ok(())
    }

    fn bone(&mut self, begin: Line<'a>) -> Result<()> {
        if !begin.text.eq_ignore_ascii_case(b"begin") {
            return Err(Error::at_line(begin.number, quote(begin.text), "begin or the next section"));
        }
        let mut bone = RawBone {
            line: begin.number,
            name: String::new(),
            direction: Vector3::zeros(),
            length: 0.0,
            axis: [0.0; 3],
            axis_order: [Axis::X, Axis::Y, Axis::Z],
            channels: Vec::new(),
            limits: Vec::new(),
        };
        let mut limits_line = None;
        loop {
            let Some(line) = self.next_line() else {
                return Err(Error::at_line(
                    self.lines.number(),
                    "the end of the file",
                    format!("the end of the bone that begins in line {}", begin.number),
                ));
            };
            let (key, rest) = key_and_rest(line.text);
            match key.to_ascii_lowercase().as_slice() {
                b"end" => break,
                b"id" | b"bodymass" | b"cofmass" => {}
                b"name" => bone.name = name(rest),
                b"direction" => bone.direction = three(line.number, rest)?.into(),
                b"length" => {
                    bone.length = finite(rest).ok_or_else(|| bad_number(line.number, rest, "a length"))?;
                }
                b"axis" => (bone.axis, bone.axis_order) = axis(line.number, rest)?,
                b"dof" => bone.channels = channels(line.number, rest)?,
                b"limits" => {
                    limits_line = Some(line.number);
                    limits(line.number, rest, &mut bone.limits)?;
                }
                _ if line.text.starts_with(b"(") && limits_line.is_some() => {
                    limits(line.number, line.text, &mut bone.limits)?;
                }
                _ if line.text.starts_with(b":") || key.eq_ignore_ascii_case(b"begin") => {
                    return Err(Error::at_line(
                        line.number,
                        quote(line.text),
                        format!("the end of the bone that begins in line {}", begin.number),
                    ));
                }
                _ => self.warnings.line(line.number, format!("{} of a bone is skipped", quote(key))),
            }
        }
        if bone.name.is_empty() {
            return Err(Error::at_line(begin.number, "a bone without a name", "a name line"));
        }
        self.keep_limits(&mut bone, limits_line.unwrap_or(begin.number));
        self.bones.push(bone);
        Ok(())
    }

    fn keep_limits(&mut self, bone: &mut RawBone, line: usize) {
        let expected = 2 * bone.channels.len();
        if bone.limits.len() == expected {
            for (channel, pair) in bone.channels.iter_mut().zip(bone.limits.chunks_exact(2)) {
                channel.limits = Some((pair[0], pair[1]));
            }
        } else if !bone.limits.is_empty() {
            let found = bone.limits.len();
            self.warnings.line(
                line,
                format!(
                    "bone {} has {found} limits, expected {expected}; its limits are left out",
                    bone.name
                ),
            );
        }
    }

    fn children(&mut self, line: Line<'a>) {
        let mut names = words(line.text);
        let Some(parent) = names.next() else { return };
        let children: Vec<_> = names.collect();
        let is_bracket = parent.eq_ignore_ascii_case(b"begin") || parent.eq_ignore_ascii_case(b"end");
        if !(is_bracket && children.is_empty()) {
            self.hierarchy.push(Children { line: line.number, parent, children });
        }
    }
}

/// First word of a line, and what follows it.
fn key_and_rest(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(text.len());
    (&text[..end], text[end..].trim_ascii())
}

fn bad_number(line: usize, found: &[u8], expected: &str) -> Error {
    Error::at_line(line, quote(found), expected)
}

fn three(line: usize, text: &[u8]) -> Result<[f64; 3]> {
    let mut numbers = [0.0; 3];
    let mut found = words(text);
    for value in &mut numbers {
        *value = found
            .next()
            .and_then(finite)
            .ok_or_else(|| Error::at_line(line, quote(text), "three finite numbers"))?;
    }
    if found.next().is_some() {
        return Err(Error::at_line(line, quote(text), "three finite numbers"));
    }
    Ok(numbers)
}

/// `-90 0 20 XYZ`; the order may be left out.
fn axis(line: usize, text: &[u8]) -> Result<([f64; 3], [Axis; 3])> {
    let last = words(text).last().unwrap_or_default();
    if last.first().is_some_and(u8::is_ascii_alphabetic) && finite(last).is_none() {
        let numbers = text[..text.len() - last.len()].trim_ascii();
        Ok((three(line, numbers)?, axis_order(line, last)?))
    } else {
        Ok((three(line, text)?, [Axis::X, Axis::Y, Axis::Z]))
    }
}

fn axis_order(line: usize, text: &[u8]) -> Result<[Axis; 3]> {
    let error = || Error::at_line(line, quote(text), "an order of the three axes such as XYZ");
    let [a, b, c] = text else { return Err(error()) };
    let mut order = [Axis::X; 3];
    for (slot, letter) in order.iter_mut().zip([a, b, c]) {
        *slot = axis_letter(*letter).ok_or_else(error)?;
    }
    if order[0] == order[1] || order[0] == order[2] || order[1] == order[2] {
        return Err(error());
    }
    Ok(order)
}

fn axis_letter(letter: u8) -> Option<Axis> {
    match letter.to_ascii_lowercase() {
        b'x' => Some(Axis::X),
        b'y' => Some(Axis::Y),
        b'z' => Some(Axis::Z),
        _ => None,
    }
}

/// `rx ry rz` or `TX TY TZ RX RY RZ`.
fn channels(line: usize, text: &[u8]) -> Result<Vec<Channel>> {
    let mut channels = Vec::<Channel>::new();
    for word in words(text) {
        let channel = match word {
            [b't' | b'T', axis] => axis_letter(*axis).map(Channel::translation),
            [b'r' | b'R', axis] => axis_letter(*axis).map(Channel::rotation),
            _ => None,
        };
        let Some(channel) = channel else {
            let expected =
                "tx, ty, tz, rx, ry or rz (a bone that changes its length, l, can't be represented)";
            return Err(Error::at_line(line, quote(word), expected));
        };
        if channels.contains(&channel) {
            return Err(Error::at_line(line, format!("{channel} twice"), "each DOF once"));
        }
        channels.push(channel);
    }
    Ok(channels)
}

/// `(-160.0 20.0)`, one or more.
fn limits(line: usize, text: &[u8], out: &mut Vec<f64>) -> Result<()> {
    let separator = |b: &u8| b.is_ascii_whitespace() || matches!(b, b'(' | b')' | b',');
    for word in text.split(separator).filter(|w| !w.is_empty()) {
        match number(word) {
            Some(value) if !value.is_nan() => out.push(value),
            _ => return Err(Error::at_line(line, quote(word), "a limit: a number, inf or -inf")),
        }
    }
    Ok(())
}
