/// Why markers can't be mapped to control points.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A map that is not TOML, or has other keys than a map has.
    #[error("marker map: {message}")]
    Syntax {
        /// what is wrong, with its line
        message: String,
    },
    /// A value of a map that makes no sense.
    #[error("marker map: {what} is {found}, expected {expected}")]
    Value {
        /// which value
        what: String,
        /// what it is
        found: String,
        /// what it may be
        expected: &'static str,
    },
    /// Too few or too many of something in a map.
    #[error("marker map: {place}found {found} {what}, expected {expected}")]
    Count {
        /// the point with `: ` behind it, or nothing
        place: String,
        /// what was counted
        what: &'static str,
        /// how many there are
        found: usize,
        /// how many there may be
        expected: &'static str,
    },
    /// No preset has that name.
    #[error("there is no marker set {name:?}, expected one of: {known}")]
    NoSuchPreset {
        /// the name asked for
        name: String,
        /// the names there are
        known: String,
    },
    /// None of a control point's markers is in the file.
    #[error("none of the markers of control point {point} ({markers}) is in the file; it has {has}")]
    NoMarkers {
        /// the control point
        point: String,
        /// its markers
        markers: String,
        /// names in the file
        has: String,
    },
    /// None of the markers of a whole map is in the file.
    #[error("the file has none of {map}'s markers ({markers}); it has {has}")]
    NoneOfMap {
        /// the map: its name, or "the marker map"
        map: String,
        /// its markers
        markers: String,
        /// names in the file
        has: String,
    },
    /// A name of a map stands for several of the file.
    #[error(
        "marker {name} could be any of {found} in the file; choose one by its prefix or by its full name"
    )]
    Unclear {
        /// the marker's name in the map
        name: String,
        /// what it may be in the file
        found: String,
    },
    /// The file's names belong to no preset.
    #[error(
        "the file's markers match no known marker set ({nearest}); describe them in a marker map: --map FILE"
    )]
    Unknown {
        /// what came nearest
        nearest: String,
    },
    /// The file's names belong to several presets, or to several people.
    #[error("the file's markers could be any of {candidates}; choose one")]
    Ambiguous {
        /// presets and prefixes
        candidates: String,
    },
    /// The combined trajectories contradict each other; a bug in this crate.
    #[error(transparent)]
    Model(#[from] model::Error),
}
