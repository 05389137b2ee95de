//! Refusals by the server, in the words of the command line.

/// A field of a request that an option gives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Field {
    /// the way to it: `inverse_kinematics.stature_m`
    pub path: &'static str,
    /// as it is typed: `--stature`
    pub option: &'static str,
    /// whether it is in the request
    pub is_given: bool,
    /// whether it is given as names and their values, as by `--set NAME=VALUE`
    pub has_names: bool,
}

/// What comes before the field that a sentence of the server is about.
const BEFORE: [&str; 3] = [": ", "so ", "leave "];
/// What comes after it.
const AFTER: [&str; 7] = [" is ", " has ", " names ", " needs ", " and ", " was ", " out"];
/// What comes before a list of fields of the request.
const FIELDS: &str = "they have: ";
/// What comes before a list of names that are no fields of the request itself.
const NAMES: &str = "there are: ";

/// A message of the server about a request, with the option of each field in its place.
///
/// A name of several words or a path (`marker_prefix`, `parameters.particles`) is a field wherever it stands; a plain word
/// (`points`, `method`) only where a sentence is about it. What is in quotes was written by the user.
pub(crate) fn in_options(fields: &[Field], said: &str) -> String {
    if let Some((before, list)) = said.split_once(FIELDS) {
        return format!("{}{FIELDS}{}", sentence(fields, before), listed(fields, list));
    }
    match said.find(NAMES) {
        Some(at) => format!("{}{}", sentence(fields, &said[..at]), &said[at..]),
        None => sentence(fields, said),
    }
}

fn sentence(fields: &[Field], said: &str) -> String {
    let mut shown = String::new();
    let mut rest = said;
    let mut is_quoted = false;
    while let Some(first) = rest.chars().next() {
        let length = if is_of_name(first) {
            rest.find(|c| !is_of_name(c)).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (word, after) = rest.split_at(length);
        is_quoted ^= first == '"' && !shown.ends_with('\\');
        // what ends a sentence is no part of the name
        let name = word.trim_end_matches('.');
        let is_about = |after: &str| {
            let begins = shown.is_empty() || BEFORE.iter().any(|before| shown.ends_with(before));
            begins && AFTER.iter().any(|next| after.starts_with(next))
        };
        let is_field = name.contains(['_', '.']) || is_about(after);
        match option(fields, name).filter(|_| is_field && !is_quoted) {
            Some(option) => {
                shown.push_str(&option);
                shown.push_str(&word[name.len()..]);
            }
            None => shown.push_str(word),
        }
        rest = after;
    }
    shown
}

fn is_of_name(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_.[]-".contains(c)
}

/// What was typed for the field of that path, or for what it is in.
fn option(fields: &[Field], path: &str) -> Option<String> {
    if let Some(field) = fields.iter().find(|field| field.path == path) {
        return Some(field.option.to_owned());
    }
    let inside = fields.iter().find_map(|field| {
        let rest = path.strip_prefix(field.path)?;
        match rest.strip_prefix('.') {
            Some(name) if field.has_names => Some(format!("{} {name}", field.option)),
            // nobody counts the items of a list
            None if rest.starts_with('[') => Some(field.option.to_owned()),
            _ => None,
        }
    });
    if inside.is_some() {
        return inside;
    }
    let mut within = fields.iter().filter(|field| is_within(field, path));
    within.find(|field| field.is_given).map(|field| field.option.to_owned())
}

fn is_within(field: &Field, path: &str) -> bool {
    field.path.strip_prefix(path).is_some_and(|rest| rest.starts_with('.'))
}

/// A list of fields, each option once.
fn listed(fields: &[Field], list: &str) -> String {
    let mut shown: Vec<&str> = Vec::new();
    for name in list.split(", ") {
        let own = fields.iter().filter(|field| field.path == name || is_within(field, name));
        let mut options: Vec<&str> = own.map(|field| field.option).collect();
        if options.is_empty() {
            options.push(name);
        }
        for option in options {
            if !shown.contains(&option) {
                shown.push(option);
            }
        }
    }
    shown.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIELDS: [Field; 10] = [
        field("kind", "--kind", false),
        field("points", "--points", true),
        field("up", "--up", false),
        field("mapping", "--map", false),
        field("marker_map", "--map", true),
        field("camera_files", "--camera", true),
        field("inverse_kinematics.steps", "--steps", false),
        field("inverse_kinematics.stature_m", "--stature", true),
        field("background", "--background", true),
        Field { path: "parameters", option: "--set", is_given: true, has_names: true },
    ];

    const fn field(path: &'static str, option: &'static str, is_given: bool) -> Field {
        Field { path, option, is_given, has_names: false }
    }

    #[test]
    fn fields_are_called_as_they_were_typed() {
        for (said, expected) in [
            (
                "parameters.particles is 5000, expected 2 to 2000, or 0 for none",
                "--set particles is 5000, expected 2 to 2000, or 0 for none",
            ),
            (
                "inverse_kinematics is given, so kind is inverse-kinematics: inverse_kinematics.stature_m is 180 m",
                "--stature is given, so --kind is inverse-kinematics: --stature is 180 m",
            ),
            ("points has 1 name, expected 2 to 16", "--points has 1 name, expected 2 to 16"),
            ("points[2] is 5, expected text", "--points is 5, expected text"),
            (
                "the session has control points, so kind is sparse: background is not a field of sparse runs, but of \
                 multi-view runs; they have: kind, inverse_kinematics, mapping, marker_map, parameters, other",
                "the session has control points, so --kind is sparse: --background is not a field of sparse runs, \
                 but of multi-view runs; they have: --kind, --steps, --stature, --map, --set, other",
            ),
            (
                "background is given twice: here and as parameters.background",
                "--background is given twice: here and as --set background",
            ),
            (
                "parameters.background.model is \"x\", expected auto or plate",
                "--set background.model is \"x\", expected auto or plate",
            ),
            (
                "camera_files names \"camera_files.mp4\", expected a file of the session",
                "--camera names \"camera_files.mp4\", expected a file of the session",
            ),
            (
                "parameters.x is not known; there are: points, up, camera_files",
                "--set x is not known; there are: points, up, camera_files",
            ),
        ] {
            assert_eq!(in_options(&FIELDS, said), expected);
        }
    }

    #[test]
    fn what_is_no_field_stays() {
        for said in [
            "the session has no control points; upload a .csv, .trc or .c3d file first",
            "expected points of the body",
            "there is no motion database \"points\" in this project",
            "\"a \\\" marker_map\" is no name",
            "file points.csv: line 3: found 5",
            "",
        ] {
            assert_eq!(in_options(&FIELDS, said), said);
        }
    }
}
