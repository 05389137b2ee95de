use crate::archive::without_compression;

/// What a file's name tells about its format: its extension in lower case, without `.zst` or `.gz` behind it; empty if there is
/// none.
pub(crate) fn extension(name: &str) -> String {
    let lower = name.to_ascii_lowercase();
    let inner = without_compression(&lower);
    let extension = match inner.rsplit_once('.') {
        _ if inner.ends_with(".qca.txt") => "qca.txt",
        Some((_, extension)) => extension,
        None => return String::new(),
    };
    let has_stem = inner.len() > extension.len() + 1;
    if has_stem { extension.to_owned() } else { String::new() }
}

/// Endings with these extensions, as a sentence has them: `.csv, .trc or .c3d`.
pub(crate) fn endings(extensions: &[&str]) -> String {
    let dotted: Vec<String> = extensions.iter().map(|extension| format!(".{extension}")).collect();
    match dotted.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => dotted.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extensions_are_without_compression() {
        assert_eq!(extension("16_15.AMC.zst"), "amc");
        assert_eq!(extension("points"), "");
        assert_eq!(extension(".qca.txt"), "");
    }
}
