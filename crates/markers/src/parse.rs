//! Maps as people write them: TOML.

use std::collections::BTreeMap;

use model::counted;
use serde::Deserialize;

use crate::{Error, Group, MarkerMap, Point, Result};

/// Longest text of a map, bytes.
const MAX_BYTES: usize = 64 * 1024;
/// Most control points, choices for one, markers of one, and markers of a set.
const MAX_POINTS: usize = 64;
const MAX_CHOICES: usize = 8;
const MAX_GROUP: usize = 32;
const MAX_MARKERS: usize = 512;
/// Deepest nesting of brackets, and most dots in a line: more is not a map, and would overflow a reader's stack.
const MAX_DEPTH: usize = 64;
const MAX_DOTS: usize = 256;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    name: String,
    #[serde(default)]
    aliases: Vec<String>,
    #[serde(default)]
    description: String,
    prefix: Option<String>,
    sigma_mm: Option<f64>,
    #[serde(default)]
    markers: Vec<String>,
    points: BTreeMap<String, Entry>,
}

#[derive(Deserialize)]
#[serde(
    untagged,
    expecting = "expected a marker's name, a list of names, a table with markers, or a list of such tables"
)]
enum Entry {
    One(String),
    Mean(Vec<String>),
    Group(GroupEntry),
    Choices(Vec<GroupEntry>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GroupEntry {
    markers: Vec<String>,
    weights: Option<Vec<f64>>,
    offset_mm: Option<[f64; 3]>,
    sigma_mm: Option<f64>,
}

impl MarkerMap {
    /// Reads a map from TOML (see `docs/markers.md`).
    ///
    /// # Errors
    /// If it is not TOML, has unknown keys, or a number out of its range.
    pub fn parse(text: &str) -> Result<Self> {
        if text.len() > MAX_BYTES {
            return Err(value("text", format!("{} bytes long", text.len()), "at most 65536 bytes"));
        }
        check_depth(text)?;
        let file: File =
            toml::from_str(text).map_err(|error| Error::Syntax { message: one_line(text, &error) })?;
        count("", "points", file.points.len(), 1, MAX_POINTS, "1 to 64")?;
        count("", "markers", file.markers.len(), 0, MAX_MARKERS, "at most 512")?;
        let mut points = BTreeMap::new();
        for (name, entry) in file.points {
            let point = point(&name, entry, file.sigma_mm)?;
            points.insert(name, point);
        }
        let File { name, aliases, description, prefix, markers, .. } = file;
        Ok(Self { name, aliases, description, prefix, markers, points })
    }
}

fn check_depth(text: &str) -> Result<()> {
    let mut depth = 0_usize;
    let mut deepest = 0;
    for byte in text.bytes() {
        match byte {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    count("", "brackets inside each other", deepest, 0, MAX_DEPTH, "at most 64")?;
    let dots = text.lines().map(|line| line.matches('.').count()).max().unwrap_or(0);
    count("", "dots in a line", dots, 0, MAX_DOTS, "at most 256")
}

fn point(name: &str, entry: Entry, sigma_mm: Option<f64>) -> Result<Point> {
    let plain = |markers| GroupEntry { markers, weights: None, offset_mm: None, sigma_mm: None };
    let entries = match entry {
        Entry::One(marker) => vec![plain(vec![marker])],
        Entry::Mean(markers) => vec![plain(markers)],
        Entry::Group(group) => vec![group],
        Entry::Choices(choices) => choices,
    };
    count(name, "choices", entries.len(), 1, MAX_CHOICES, "1 to 8")?;
    let choices = entries.into_iter().map(|entry| group(name, entry, sigma_mm));
    Ok(Point { name: name.to_owned(), choices: choices.collect::<Result<_>>()? })
}

fn group(point: &str, entry: GroupEntry, sigma_mm: Option<f64>) -> Result<Group> {
    let what = |key: &str| format!("{point}: {key}");
    count(point, "markers", entry.markers.len(), 1, MAX_GROUP, "1 to 32")?;
    if let Some((i, twice)) =
        entry.markers.iter().enumerate().find(|(i, marker)| entry.markers[..*i].contains(marker))
    {
        return Err(value(
            &what(&format!("marker {}", i + 1)),
            format!("{twice:?} again"),
            "each marker once",
        ));
    }
    let weights = match entry.weights {
        None => vec![1.0; entry.markers.len()],
        Some(weights) if weights.len() == entry.markers.len() => weights,
        Some(weights) => {
            return Err(value(&what("weights"), counted(weights.len(), "number"), "one for each marker"));
        }
    };
    if let Some(bad) = weights.iter().find(|w| !(1e-3..=1e3).contains(*w)) {
        return Err(value(&what("weights"), bad.to_string(), "numbers from 0.001 to 1000"));
    }
    let sum: f64 = weights.iter().sum();
    let offset_mm = entry.offset_mm.unwrap_or_default();
    if let Some(bad) = offset_mm.iter().find(|v| !(-2e3..=2e3).contains(*v)) {
        return Err(value(&what("offset_mm"), bad.to_string(), "three numbers from -2000 to 2000"));
    }
    let sigma_mm = entry.sigma_mm.or(sigma_mm);
    if let Some(bad) = sigma_mm.filter(|s| !(0.01..=1e4).contains(s)) {
        return Err(value(&what("sigma_mm"), bad.to_string(), "0.01 to 10000"));
    }
    Ok(Group {
        markers: entry.markers,
        weights: weights.iter().map(|w| w / sum).collect(),
        offset_m: offset_mm.map(|v| v / 1e3),
        sigma_m: sigma_mm.map(|s| s / 1e3),
    })
}

/// Refuses too few or too many of something, in the map or in one of its points.
fn count(
    point: &str,
    what: &'static str,
    found: usize,
    low: usize,
    high: usize,
    expected: &'static str,
) -> Result<()> {
    if (low..=high).contains(&found) {
        return Ok(());
    }
    let place = if point.is_empty() { String::new() } else { format!("{point}: ") };
    Err(Error::Count { place, what, found, expected })
}

fn value(what: &str, found: String, expected: &'static str) -> Error {
    Error::Value { what: what.to_owned(), found, expected }
}

/// What is wrong, after the line where it is; without the picture of the line.
fn one_line(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().trim().replace('\n', ", ");
    let before = error.span().and_then(|span| text.get(..span.start));
    match before {
        Some(before) => format!("line {}: {message}", before.matches('\n').count() + 1),
        None => message,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_ways_to_write_a_point_are_read() {
        let map = MarkerMap::parse(
            r#"
            # a comment
            name = "mine"
            prefix = "Anna:"
            sigma_mm = 15
            [points]
            head = "TOP"
            root = ["LASI", "RASI"]
            left_wrist = { markers = ["A", "B"], weights = [3, 1], offset_mm = [1, -2, 3.5], sigma_mm = 4 }
            [[points.left_ankle]]
            markers = ["LANK", "LMED"]
            [[points.left_ankle]]
            markers = ["LANK"]
            offset_mm = [40, 0, 0]
            "#,
        )
        .unwrap();
        assert_eq!((map.name.as_str(), map.prefix.as_deref()), ("mine", Some("Anna:")));
        let group = |name: &str, choice: usize| map.point(name).unwrap().choices[choice].clone();
        assert_eq!(group("head", 0).markers, ["TOP"]);
        assert_eq!(group("root", 0).weights, [0.5, 0.5]);
        assert_eq!(group("root", 0).sigma_m, Some(0.015));
        let wrist = group("left_wrist", 0);
        assert_eq!((wrist.weights, wrist.sigma_m), (vec![0.75, 0.25], Some(0.004)));
        assert_eq!(wrist.offset_m, [0.001, -0.002, 0.0035]);
        assert_eq!(group("left_ankle", 1).offset_m, [0.04, 0.0, 0.0]);
    }

    #[test]
    fn what_is_wrong_with_a_map_is_said_with_its_place() {
        let cases = [
            ("", "missing field `points`"),
            ("[points]", "found 0 points, expected 1 to 64"),
            ("[points]\nhead = 3", "line 2: expected a marker's name, a list of names"),
            ("[points]\nhead = [[[", "line 2"),
            ("[points]\nhead = []", "head: found 0 markers, expected 1 to 32"),
            ("pionts = 1\n[points]\nhead = 'A'", "line 1: unknown field `pionts`"),
            ("[points]\nhead = ['A', 'A']", "head: marker 2 is \"A\" again, expected each marker once"),
            ("[points]\nhead = {markers = ['A'], weights = [1, 2]}", "head: weights is 2 numbers"),
            ("[points]\nhead = {markers = ['A'], weights = [nan]}", "head: weights is NaN"),
            ("[points]\nhead = {markers = ['A'], offset_mm = [0, inf, 0]}", "head: offset_mm is inf"),
            ("sigma_mm = 0\n[points]\nhead = 'A'", "head: sigma_mm is 0"),
        ];
        for (text, expected) in cases {
            let message = MarkerMap::parse(text).unwrap_err().to_string();
            assert!(message.contains(expected), "{text:?}: {message}");
            assert!(!message.contains('\n'), "{message}");
        }
        let long = format!("# {}\n[points]\nhead = 'A'", "x".repeat(70_000));
        assert!(MarkerMap::parse(&long).unwrap_err().to_string().contains("expected at most 65536 bytes"));
    }
}
