use std::sync::LazyLock;

use crate::{Error, MarkerMap, Result};

/// The texts of the presets, in the order in which they are listed; a test reads every one.
const TEXTS: [&str; 12] = [
    include_str!("../presets/plug-in-gait.toml"),
    include_str!("../presets/cmu-41.toml"),
    include_str!("../presets/vicon-53.toml"),
    include_str!("../presets/fullbody-2009.toml"),
    include_str!("../presets/helen-hayes.toml"),
    include_str!("../presets/gait2392.toml"),
    include_str!("../presets/qualisys-animation.toml"),
    include_str!("../presets/qualisys-sports.toml"),
    include_str!("../presets/optitrack-baseline.toml"),
    include_str!("../presets/isb-landmarks.toml"),
    include_str!("../presets/opencap.toml"),
    include_str!("../presets/keypoints.toml"),
];

static PRESETS: LazyLock<Vec<MarkerMap>> =
    LazyLock::new(|| TEXTS.iter().filter_map(|text| MarkerMap::parse(text).ok()).collect());

/// The maps of common marker sets.
pub fn presets() -> &'static [MarkerMap] {
    &PRESETS
}

/// The preset of that name or alias.
///
/// # Errors
/// If there is none.
pub fn preset(name: &str) -> Result<&'static MarkerMap> {
    let is_called = |map: &&MarkerMap| map.name == name || map.aliases.iter().any(|alias| alias == name);
    presets().iter().find(is_called).ok_or_else(|| Error::NoSuchPreset {
        name: name.to_owned(),
        known: presets().iter().map(|map| map.name.as_str()).collect::<Vec<_>>().join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_reads_and_is_whole() {
        for text in TEXTS {
            let map = MarkerMap::parse(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert!(!map.name.is_empty() && !map.description.is_empty(), "{text}");
            assert!(map.prefix.is_none());
            for point in map.points() {
                for group in &point.choices {
                    let sigma = group.sigma_m.unwrap();
                    assert!((0.005..=0.05).contains(&sigma), "{}: {}", map.name, point.name);
                    for marker in &group.markers {
                        assert!(map.markers.contains(marker), "{}: {marker} is not in markers", map.name);
                    }
                }
            }
        }
        assert_eq!(presets().len(), TEXTS.len());
    }

    #[test]
    fn what_is_left_is_the_mirror_of_what_is_right() {
        for map in presets() {
            for point in map.points() {
                let Some(side) = point.name.strip_prefix("left_") else { continue };
                let other = map.point(&format!("right_{side}")).unwrap();
                assert_eq!(point.choices.len(), other.choices.len());
                for (left, right) in point.choices.iter().zip(&other.choices) {
                    let [x, y, z] = left.offset_m;
                    assert_eq!(right.offset_m, [-x, y, z], "{} {}", map.name, point.name);
                    assert_eq!((&left.weights, left.sigma_m), (&right.weights, right.sigma_m));
                    assert!(left.markers.iter().all(|m| !right.markers.contains(m)));
                }
            }
        }
    }

    #[test]
    fn names_and_aliases_lead_to_one_preset() {
        let mut names: Vec<&str> =
            presets().iter().flat_map(|m| m.aliases.iter().chain([&m.name])).map(String::as_str).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all);
        assert_eq!(preset("optitrack-conventional").unwrap().name, "plug-in-gait");
        assert!(preset("x").unwrap_err().to_string().contains("plug-in-gait, cmu-41"));
    }
}
