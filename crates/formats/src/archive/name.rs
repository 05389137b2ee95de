use crate::text::quote;

/// A member's name in a message.
pub(super) fn shown(name: &[u8]) -> String {
    quote(name)
}

/// A file's name without the ending of its compression, `.zst` or `.gz`.
pub fn without_compression(name: &str) -> &str {
    let is_ending = |ending: &str| {
        name.len() > ending.len()
            && name.is_char_boundary(name.len() - ending.len())
            && name[name.len() - ending.len()..].eq_ignore_ascii_case(ending)
    };
    [".zst", ".gz"].iter().find(|e| is_ending(e)).map_or(name, |e| &name[..name.len() - e.len()])
}

/// Whether a file's name says that it is an archive of several files.
pub(super) fn is_of_archive(name: &str) -> bool {
    let extension = without_compression(name).rsplit_once('.').map(|(_, extension)| extension);
    extension.is_some_and(|found| ["zip", "tar", "tgz", "tzst"].iter().any(|e| found.eq_ignore_ascii_case(e)))
}

/// Folders and name, separated by `/`, without what could lead out of a folder.
pub(super) fn clean(name: &[u8]) -> String {
    let name = String::from_utf8_lossy(name).replace(char::is_control, "_");
    let parts = name.split(['/', '\\']).filter(|p| !matches!(*p, "" | "." | ".."));
    let parts: Vec<_> = parts.filter(|p| !(p.len() == 2 && p.ends_with(':'))).collect();
    if parts.is_empty() { "unnamed".into() } else { parts.join("/") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_out_stay_inside() {
        for (name, expected) in [
            ("../../etc/passwd", "etc/passwd"),
            ("/abs/16.asf", "abs/16.asf"),
            ("C:\\mocap\\..\\16.asf", "mocap/16.asf"),
            ("a//b/./c", "a/b/c"),
            ("..", "unnamed"),
            ("a\0b", "a_b"),
        ] {
            assert_eq!(clean(name.as_bytes()), expected);
        }
    }

    #[test]
    fn endings_of_compression_are_taken_off() {
        assert_eq!(without_compression("16.asf.ZST"), "16.asf");
        assert_eq!(without_compression("16.asf.gz"), "16.asf");
        assert_eq!(without_compression("é.gz"), "é");
        assert_eq!(without_compression(".gz"), ".gz");
        assert_eq!(without_compression("ézst"), "ézst");
    }
}
