//! Cameras in a tree of named values: what JSON, YAML and TOML hold, in the names that programs give them.

use std::{cmp::Ordering, collections::BTreeSet};

use model::counted;
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::{Map, Value};

use super::{FileCamera, FileCameras, MOST_CAMERAS, UpAxis, up::Stated};
use crate::{Error, Place, Result, points, read::Warnings, text::quote};

const MATRIX: [&str; 8] = [
    "K",
    "camera_matrix",
    "cameraMatrix",
    "Camera_Matrix",
    "intrinsic_matrix",
    "intrinsics",
    "matrix",
    "mtx",
];
const DISTORTION: [&str; 10] = [
    "dist",
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "distortion_coeffs",
    "distortions",
    "distortion",
    "coefficients",
    "D",
];
const ROTATION: [&str; 5] = ["R", "rotation", "rotation_matrix", "rvec", "rot_mat"];
const TRANSLATION: [&str; 6] = ["t", "T", "translation", "translation_vector", "tvec", "trans"];
const WIDTH: [&str; 3] = ["image_width", "image_Width", "width"];
const HEIGHT: [&str; 3] = ["image_height", "image_Height", "height"];
const SIZE: [&str; 4] = ["size", "image_size", "img_size", "resolution"];

/// The cameras of the tree; `usual` is the axis that points up where the file doesn't say it.
pub(super) fn read(
    file_name: &str,
    tree: &Value,
    usual: UpAxis,
    warnings: &mut Warnings,
) -> Result<FileCameras> {
    let empty = Map::new();
    let top = tree.as_object().unwrap_or(&empty);
    let mut cameras = Vec::new();
    for part in parts(file_name, tree)? {
        if part.map.get("ignore") == Some(&Value::Bool(true)) {
            warnings.add(Place::File, format!("camera {}: left out, as the file says `ignore`", part.name));
            continue;
        }
        cameras.push(part.camera(top, warnings)?);
    }
    let up = match top.get("up") {
        None => Stated::Usual(usual),
        Some(up) => Stated::Certain(up.as_str().unwrap_or_default().parse().map_err(|_| {
            Error::whole_file(format!("up {}", quote(up.to_string().as_bytes())), "x, y, z, -x, -y or -z")
        })?),
    };
    let metres = match top.get("unit").or_else(|| top.get("units")) {
        None => None,
        Some(unit) => {
            Some(points::metres(unit.as_str().unwrap_or_default().as_bytes()).ok_or_else(|| {
                Error::whole_file(format!("unit {}", quote(unit.to_string().as_bytes())), "mm, cm, m or in")
            })?)
        }
    };
    Ok(FileCameras { cameras, up, metres })
}

/// Where the values of a camera are: in `map`, under names that begin with `prefix`.
struct Part<'a> {
    name: String,
    map: &'a Map<String, Value>,
    prefix: String,
}

/// The parts of the tree that have a camera matrix.
fn parts<'a>(file_name: &str, tree: &'a Value) -> Result<Vec<Part<'a>>> {
    let parts_from = |list: &'a [Value]| {
        if list.len() > MOST_CAMERAS {
            let found = counted(list.len(), "camera");
            return Err(Error::whole_file(found, format!("at most {MOST_CAMERAS}")));
        }
        let part = |(index, value): (usize, &'a Value)| {
            let map = value.as_object().ok_or_else(|| {
                Error::whole_file(
                    format!("camera {index} is {}", quote(value.to_string().as_bytes())),
                    "an object",
                )
            })?;
            Ok(Part { name: name_of(map, &format!("cam{index}")), map, prefix: String::new() })
        };
        list.iter().enumerate().map(part).collect()
    };
    if let Some(list) = tree.as_array() {
        return parts_from(list);
    }
    let Some(top) = tree.as_object() else { return Ok(Vec::new()) };
    match top.get("cameras") {
        Some(Value::Array(list)) => return parts_from(list),
        Some(Value::Object(map)) => return Ok(tables(map)),
        _ => {}
    }
    if has_any(top, "", &MATRIX) {
        let file = file_name.rsplit(['/', '\\']).next().unwrap_or_default();
        let stem = file.split('.').next().unwrap_or_default();
        let stem = if stem.is_empty() { "cam0" } else { stem };
        return Ok(vec![Part { name: name_of(top, stem), map: top, prefix: String::new() }]);
    }
    let mut parts = tables(top);
    let prefixes: BTreeSet<&str> = top
        .keys()
        .filter_map(|key| MATRIX.iter().find_map(|matrix| key.strip_suffix(matrix)))
        .filter(|prefix| prefix.len() > 1 && prefix.ends_with('_'))
        .collect();
    parts.extend(prefixes.into_iter().map(|prefix| Part {
        name: prefix.trim_end_matches('_').to_owned(),
        map: top,
        prefix: prefix.to_owned(),
    }));
    parts.sort_by(|a, b| natural_order(&a.name, &b.name));
    Ok(parts)
}

/// The members of a table that have a camera matrix, by the numbers in their names.
fn tables(map: &Map<String, Value>) -> Vec<Part<'_>> {
    let mut parts: Vec<_> = map
        .iter()
        .filter_map(|(key, value)| Some((key, value.as_object()?)))
        .filter(|(_, map)| has_any(map, "", &MATRIX))
        .map(|(key, map)| Part { name: name_of(map, key), map, prefix: String::new() })
        .collect();
    parts.sort_by(|a, b| natural_order(&a.name, &b.name));
    parts
}

fn name_of(map: &Map<String, Value>, otherwise: &str) -> String {
    map.get("name").and_then(Value::as_str).filter(|name| !name.is_empty()).unwrap_or(otherwise).to_owned()
}

fn has_any(map: &Map<String, Value>, prefix: &str, names: &[&str]) -> bool {
    names.iter().any(|name| map.contains_key(&format!("{prefix}{name}")))
}

/// By letters, but `cam2` before `cam10`.
fn natural_order(a: &str, b: &str) -> Ordering {
    let key = |text: &str| {
        let start = text.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = text[start.len()..].parse::<u64>().ok();
        (start.to_owned(), number)
    };
    key(a).cmp(&key(b)).then_with(|| a.cmp(b))
}

impl Part<'_> {
    fn get(&self, names: &[&str]) -> Option<&Value> {
        names.iter().find_map(|name| self.map.get(&format!("{}{name}", self.prefix)))
    }

    fn error(&self, found: impl std::fmt::Display, expected: &str) -> Error {
        Error::whole_file(format!("camera {}: {found}", self.name), expected)
    }

    fn numbers(&self, what: &str, names: &[&str], counts: &[usize], expected: &str) -> Result<Vec<f64>> {
        let Some(value) = self.get(names) else {
            return Err(self.error(format!("no {what}"), &format!("{expected}, named {}", names.join(", "))));
        };
        let numbers = numbers(value)
            .ok_or_else(|| self.error(format!("{what} {}", quote(value.to_string().as_bytes())), expected))?;
        if !counts.is_empty() && !counts.contains(&numbers.len()) {
            return Err(self.error(format!("{what} of {}", counted(numbers.len(), "number")), expected));
        }
        Ok(numbers)
    }

    fn camera(&self, top: &Map<String, Value>, warnings: &mut Warnings) -> Result<FileCamera> {
        let is_fisheye = self.get(&["fisheye", "fish_eye"]) == Some(&Value::Bool(true));
        let model = self.get(&["distortion_model", "model"]).and_then(Value::as_str).unwrap_or_default();
        if is_fisheye || ["fisheye", "equidistant"].contains(&model.to_ascii_lowercase().as_str()) {
            return Err(self.error("a fisheye lens", "a lens with radial and tangential distortion"));
        }
        let matrix = self.numbers("camera matrix", &MATRIX, &[9], "3 x 3 numbers")?;
        let distortion = match self.get(&DISTORTION) {
            Some(_) => self.numbers("distortion", &DISTORTION, &[], "numbers")?,
            None => {
                let message = format!("camera {}: no distortion is given; taken as none", self.name);
                warnings.add(Place::File, message);
                Vec::new()
            }
        };
        let expected = "a rotation matrix of 3 x 3 numbers or a rotation vector of 3";
        let rotation = self.numbers("rotation", &ROTATION, &[3, 9], expected)?;
        let rotation = if rotation.len() == 9 {
            Matrix3::from_row_slice(&rotation)
        } else {
            Rotation3::new(Vector3::from_column_slice(&rotation)).into_inner()
        };
        let translation = self.numbers("translation", &TRANSLATION, &[3], "3 numbers")?;
        if self.map.get("rotation_count").and_then(Value::as_f64).is_some_and(|count| count != 0.0) {
            let message = format!(
                "camera {}: its pictures were turned for the calibration (rotation_count); upload them turned",
                self.name
            );
            warnings.add(Place::File, message);
        }
        Ok(FileCamera {
            name: self.name.clone(),
            place: Place::File,
            size: self.size(top)?,
            matrix: Matrix3::from_row_slice(&matrix),
            distortion,
            rotation,
            translation: Vector3::from_column_slice(&translation),
        })
    }

    /// Width and height of the pictures: of this camera, else of all.
    fn size(&self, top: &Map<String, Value>) -> Result<Option<[u32; 2]>> {
        let everywhere = Part { name: self.name.clone(), map: top, prefix: String::new() };
        for part in [self, &everywhere] {
            let sides = match (part.get(&WIDTH), part.get(&HEIGHT), part.get(&SIZE)) {
                (Some(width), Some(height), _) => vec![width.as_f64(), height.as_f64()],
                (_, _, Some(size)) => numbers(size).unwrap_or_default().into_iter().map(Some).collect(),
                _ => continue,
            };
            let side = |value: &Option<f64>| {
                value.filter(|side| (1.0..=32768.0).contains(side)).map(|side| side.round() as u32)
            };
            return match sides.as_slice() {
                [width, height] if side(width).is_some() => Ok(side(width)
                    .zip(side(height))
                    .map(|(width, height)| Some([width, height]))
                    .ok_or_else(|| self.error("a picture's height out of range", "1 to 32768 pixels"))?),
                _ => Err(self.error("a picture's size out of range", "width and height, 1 to 32768 pixels")),
            };
        }
        Ok(None)
    }
}

/// The numbers of a list, of a list of lists, or of an OpenCV matrix.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Array(list) => {
            let mut numbers = Vec::new();
            for value in list {
                match value {
                    Value::Array(row) => {
                        for value in row {
                            numbers.push(value.as_f64()?);
                        }
                    }
                    value => numbers.push(value.as_f64()?),
                }
            }
            Some(numbers)
        }
        Value::Object(matrix) => {
            let numbers = matrix.get("data").filter(|data| data.is_array()).and_then(numbers)?;
            let side = |name| matrix.get(name).map(|value: &Value| value.as_f64());
            let count = match (side("rows"), side("cols")) {
                (Some(rows), Some(cols)) => rows? * cols?,
                _ => numbers.len() as f64,
            };
            (count == numbers.len() as f64).then_some(numbers)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tenth_camera_comes_after_the_second() {
        let mut names = ["cam10", "left", "cam2", "cam1", "back"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["back", "cam1", "cam2", "cam10", "left"]);
    }

    #[test]
    fn a_matrix_has_as_many_numbers_as_it_says() {
        let parsed = |text: &str| numbers(&serde_json::from_str(text).unwrap());
        assert_eq!(parsed("[[1, 2], [3, 4]]"), Some(vec![1.0, 2.0, 3.0, 4.0]));
        assert_eq!(parsed(r#"{"rows": 1, "cols": 2, "data": [1, 2]}"#), Some(vec![1.0, 2.0]));
        assert_eq!(parsed(r#"{"rows": 2, "cols": 2, "data": [1, 2]}"#), None);
        assert_eq!(parsed(r#"[1, "a"]"#), None);
        assert_eq!(parsed(r#"{"data": {"data": [1]}}"#), None);
    }
}
