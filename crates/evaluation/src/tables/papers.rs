//! What the papers print, to stand beside what we measure (docs/papers.md). They do not say whether their errors are RMS or mean
//! absolute; their protocol is leave-one-out: *trial out*.

/// Methods in the order of the papers' tables.
pub const METHODS: [&str; 4] = ["gplvm", "lpca", "lpcr", "local-regression"];

/// Mousas et al. (docs/papers.md#local-regression), table 1: errors (degrees) of each of [`METHODS`] for 2 to 6 control points.
pub const POINTS: [[f64; 5]; 4] = [
    [56.76, 41.88, 16.13, 9.45, 5.92],
    [43.27, 29.25, 10.56, 6.39, 3.81],
    [38.71, 23.61, 7.33, 4.73, 3.22],
    [18.63, 7.86, 2.67, 2.25, 1.90],
];

/// Table 2 of Mousas et al. and of Liu et al.: the databases and the errors (degrees) of each of [`METHODS`] with 6
/// control points.
pub const DATABASES: [(&str, [f64; 4]); 4] = [
    ("Mousas 69,888", [5.86, 3.92, 3.38, 2.01]),
    ("Mousas 1.1 M", [26.57, 3.02, 2.75, 1.56]),
    ("Liu 56,731", [5.81, 3.91, 3.29, 2.03]),
    ("Liu 1.2 M", [25.98, 3.04, 2.81, 1.62]),
];

/// Liu et al. (docs/papers.md#sparse-constraints), table 1: errors (degrees) of local regression for windows of 1 to 4 frames.
pub const WINDOWS: [f64; 4] = [2.96, 2.04, 1.89, 1.68];

/// Liu et al., table 1: frames a second for windows of 1 to 4 frames, one core of 2.8 GHz.
pub const FRAMES_PER_SECOND: [f64; 4] = [84.0, 59.0, 34.0, 20.0];

/// The error of Mousas et al. (degrees) of a method for a number of control points.
pub fn for_points(method: &str, points: usize) -> Option<f64> {
    let row = METHODS.iter().position(|m| *m == method)?;
    POINTS[row].get(points.checked_sub(2)?).copied()
}

/// The error of Liu et al. (degrees) and frames a second of local regression for a window.
pub fn for_window(method: &str, window: usize) -> Option<(f64, f64)> {
    let i = window.checked_sub(1).filter(|&i| i < WINDOWS.len() && method == METHODS[3])?;
    Some((WINDOWS[i], FRAMES_PER_SECOND[i]))
}

/// The papers' error (degrees) of a method on the database of that number in [`DATABASES`].
pub fn for_database(method: &str, database: usize) -> Option<f64> {
    let column = METHODS.iter().position(|m| *m == method)?;
    Some(DATABASES.get(database)?.1[column])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_numbers_are_found_by_what_they_are_about() {
        assert_eq!(for_points("local-regression", 6), Some(1.90));
        assert_eq!(for_points("gplvm", 2), Some(56.76));
        assert_eq!(
            (for_points("nearest", 6), for_points("lpca", 7), for_points("lpca", 1)),
            (None, None, None)
        );
        assert_eq!(for_window("local-regression", 4), Some((1.68, 20.0)));
        assert_eq!((for_window("local-regression", 5), for_window("lpca", 2)), (None, None));
        assert_eq!(for_database("lpcr", 1), Some(2.75));
    }
}
