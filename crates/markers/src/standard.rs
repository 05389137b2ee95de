//! Files that hold control points already.

/// The control points that every CMU-like skeleton has.
pub const STANDARD: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

/// Of so many names that are control points, runs take a file's names as they are.
const MIN_NAMES: usize = 2;

/// The names of a file that are standard control points, letter by letter, if there are enough of them for a run to take
/// the file without a map; else none.
pub fn standard_names(names: &[String]) -> Vec<&str> {
    let found: Vec<&str> = names.iter().map(String::as_str).filter(|name| STANDARD.contains(name)).collect();
    if found.len() < MIN_NAMES { Vec::new() } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{MarkerMap, names::tests::names, template};

    #[test]
    fn two_standard_names_make_a_file_of_control_points() {
        let two = names(&["head", "C7", "left_wrist"]);
        assert_eq!(standard_names(&two), ["head", "left_wrist"]);
        for others in [&["head", "C7"][..], &["Head", "LEFT_WRIST"], &["Anna:head", "Anna:root"], &[]] {
            assert!(standard_names(&names(others)).is_empty(), "{others:?}");
        }
    }

    #[test]
    fn a_template_of_control_points_is_a_map_of_them() {
        let all = names(&STANDARD);
        let text = template(&all, None);
        let map = MarkerMap::parse(&text).unwrap();
        assert_eq!(map.points().count(), STANDARD.len());
        for point in map.points() {
            assert_eq!(point.choices[0].markers, [point.name.as_str()]);
        }
        assert!(text.contains("can be used without a map"), "{text}");
    }
}
