//! Which file is which camera's, told from names.

use std::collections::BTreeMap;

use crate::{Error, Result};

/// Words that say what a file is for and nothing of its camera.
const ROLES: [&str; 12] = [
    "plate",
    "plates",
    "background",
    "bg",
    "mask",
    "masks",
    "silhouette",
    "silhouettes",
    "images",
    "frames",
    "ext",
    "empty",
];
/// Most cameras that a message lists.
const NAMED: usize = 12;

/// A file, or folder of an archive, and its camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assigned {
    /// index among the names given
    pub source: usize,
    /// index among the cameras
    pub camera: usize,
}

/// Finds the camera of every name: that of `map`, else the camera of the same name (but for case, signs, and words such as
/// `plate`), else the only one with the same number in its name. Names may have folders: the last that tells counts.
///
/// # Errors
/// [`Error::Camera`] for a name that leads to none or several, [`Error::Twice`] for a camera with two, [`Error::Map`] for an
/// entry of the map that names nothing.
pub fn assign(names: &[String], cameras: &[String], map: &BTreeMap<String, String>) -> Result<Vec<Assigned>> {
    check_map(names, cameras, map)?;
    let mut assigned: Vec<Assigned> = Vec::new();
    for (source, name) in names.iter().enumerate() {
        let camera = match map.get(name).and_then(|wanted| find_camera(wanted, cameras)) {
            Some(camera) => camera,
            None => by_name(name, cameras)?,
        };
        if let Some(other) = assigned.iter().find(|other| other.camera == camera) {
            let (first, second) = (names[other.source].clone(), name.clone());
            return Err(Error::Twice { camera: cameras[camera].clone(), first, second });
        }
        assigned.push(Assigned { source, camera });
    }
    Ok(assigned)
}

/// The camera that a person calls `name`: the one of that name, else, as for files, the one whose name differs from it in case,
/// signs and zeros only, else the only one with the same number. `None` if that is none, or several.
pub fn find_camera(name: &str, cameras: &[String]) -> Option<usize> {
    let same = cameras.iter().position(|camera| camera == name);
    same.or_else(|| by_name(name, cameras).ok())
}

fn check_map(names: &[String], cameras: &[String], map: &BTreeMap<String, String>) -> Result<()> {
    for (name, camera) in map {
        if !names.contains(name) {
            return Err(Error::Map { found: name.clone(), expected: format!("one of {}", listed(names)) });
        }
        if find_camera(camera, cameras).is_none() {
            return Err(Error::Map {
                found: camera.clone(),
                expected: format!("a camera: {}", listed(cameras)),
            });
        }
    }
    Ok(())
}

fn by_name(name: &str, cameras: &[String]) -> Result<usize> {
    let mut several = Vec::new();
    for part in name.rsplit('/').filter(|part| !part.is_empty()) {
        match candidates(part, cameras)[..] {
            [] => {}
            [camera] => return Ok(camera),
            [..] if !several.is_empty() => {}
            ref found => several = found.iter().map(|&camera| cameras[camera].clone()).collect(),
        }
    }
    let found = if several.is_empty() {
        "no camera".to_owned()
    } else {
        format!("several cameras ({})", listed(&several))
    };
    Err(Error::Camera { source_name: name.to_owned(), found, cameras: listed(cameras) })
}

/// Cameras that a name may mean.
fn candidates(name: &str, cameras: &[String]) -> Vec<usize> {
    let own = words(name);
    let all = |is: &dyn Fn(&Words) -> bool| -> Vec<usize> {
        (0..cameras.len()).filter(|&camera| is(&words(&cameras[camera]))).collect()
    };
    match all(&|camera| camera.letters == own.letters) {
        found if !found.is_empty() => found,
        _ => all(&|camera| camera.number.is_some() && camera.number == own.number),
    }
}

/// What names are compared by.
#[derive(Debug, PartialEq, Eq)]
struct Words {
    /// letters and digits in lower case, without roles; numbers without zeros in front
    letters: String,
    /// the only number among them, or the one after `cam`
    number: Option<u64>,
}

fn words(name: &str) -> Words {
    let stem = name.split_once('.').map_or(name, |(stem, _)| stem);
    // `cam01` is two words
    let mut parts: Vec<String> = Vec::new();
    let mut last = None;
    for c in stem.chars().flat_map(char::to_lowercase) {
        let kind = if c.is_ascii_digit() { Some(true) } else { c.is_alphanumeric().then_some(false) };
        match (kind, parts.last_mut()) {
            (Some(_), Some(part)) if kind == last => part.push(c),
            (Some(_), _) => parts.push(c.to_string()),
            (None, _) => {}
        }
        last = kind;
    }
    parts.retain(|part| !ROLES.contains(&part.as_str()));
    let number = |part: &String| part.parse::<u64>().ok();
    let after_camera =
        parts.windows(2).find(|pair| pair[0].starts_with("cam")).and_then(|pair| number(&pair[1]));
    let numbers: Vec<u64> = parts.iter().filter_map(number).collect();
    let only = if let [only] = numbers[..] { Some(only) } else { None };
    let letters = parts.iter().map(|part| number(part).map_or(part.clone(), |n| format!("{n}."))).collect();
    Words { letters, number: after_camera.or(only) }
}

fn listed(names: &[String]) -> String {
    let mut shown: Vec<&str> = names.iter().take(NAMED).map(String::as_str).collect();
    if names.len() > NAMED {
        shown.push("…");
    }
    shown.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(names: &[&str], cameras: &[&str]) -> std::result::Result<Vec<usize>, String> {
        let own = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let assigned = assign(&own(names), &own(cameras), &BTreeMap::new());
        assigned.map(|a| a.iter().map(|a| a.camera).collect()).map_err(|e| e.to_string())
    }

    #[test]
    fn files_find_their_cameras_by_name_or_number() {
        assert_eq!(found(&["cam02.mp4", "cam01.mp4"], &["cam01", "cam02"]), Ok(vec![1, 0]));
        assert_eq!(found(&["Cam_2.MP4", "masks/cam1"], &["cam01", "cam02"]), Ok(vec![1, 0]));
        assert_eq!(found(&["cam01.plate.png", "cam02_ext.png"], &["cam01", "cam02"]), Ok(vec![0, 1]));
        assert_eq!(found(&["camera_3.mp4"], &["int_cam1_img", "int_cam3_img"]), Ok(vec![1]));
        assert_eq!(found(&["left.mp4"], &["Left", "right"]), Ok(vec![0]));
        assert_eq!(found(&["take3_cam2.mp4"], &["cam1", "cam2", "cam3"]), Ok(vec![1]));
        assert_eq!(found(&["all.zip/cam2/masks", "cam1.zip/frames"], &["cam1", "cam2"]), Ok(vec![1, 0]));
    }

    #[test]
    fn a_file_without_its_camera_is_named_with_the_cameras_there_are() {
        let message = found(&["gopro.mp4"], &["cam01", "cam02"]).unwrap_err();
        assert!(
            message.starts_with("gopro.mp4 belongs to no camera") && message.contains("cam01, cam02"),
            "{message}"
        );
        let message = found(&["cam1.mp4"], &["a1", "b1"]).unwrap_err();
        assert!(message.contains("several cameras (a1, b1)"), "{message}");
        let message = found(&["cam1.mp4", "cam01.avi"], &["cam01"]).unwrap_err();
        assert_eq!(message, "cam1.mp4 and cam01.avi both belong to camera cam01, expected one");
    }

    #[test]
    fn cameras_are_found_as_leniently_as_their_files() {
        let cameras = ["cam1", "cam2", "Kinect left"].map(str::to_owned);
        for (name, expected) in [("cam1", 0), ("cam01", 0), ("CAM_2", 1), ("2", 1), ("kinect-left", 2)] {
            assert_eq!(find_camera(name, &cameras), Some(expected), "{name}");
        }
        assert_eq!(find_camera("cam3", &cameras), None);
        // the very name goes before what is like it
        let alike = ["cam1", "cam01"].map(str::to_owned);
        assert_eq!(find_camera("cam01", &alike), Some(1));
        assert_eq!(find_camera("cam001", &alike), None, "either may be meant");
    }

    #[test]
    fn the_map_says_what_names_do_not() {
        let names = ["gopro.mp4".to_owned(), "cam2.mp4".to_owned()];
        let cameras = ["cam1".to_owned(), "cam2".to_owned()];
        let map = |from: &str, to: &str| BTreeMap::from([(from.to_owned(), to.to_owned())]);
        let assigned = assign(&names, &cameras, &map("gopro.mp4", "cam1")).unwrap();
        assert_eq!(assigned[0], Assigned { source: 0, camera: 0 });
        assert_eq!(assign(&names, &cameras, &map("gopro.mp4", "Cam 01")).unwrap(), assigned);
        assert!(
            assign(&names, &cameras, &map("gopro.mp4", "cam9")).unwrap_err().to_string().contains("cam9")
        );
        assert!(
            assign(&names, &cameras, &map("phone.mp4", "cam1"))
                .unwrap_err()
                .to_string()
                .contains("phone.mp4")
        );
    }
}
