//! Files that commands write, beside those that they read.

use std::path::{Path, PathBuf};

use anyhow::bail;

/// That options name files of their own: none is written twice, or over what is read.
///
/// # Errors
/// If two of them are one file.
pub fn distinct(options: &[(&str, Option<&PathBuf>)]) -> anyhow::Result<()> {
    let given: Vec<(&str, &PathBuf)> =
        options.iter().filter_map(|(option, path)| Some((*option, (*path)?))).collect();
    for (index, (option, path)) in given.iter().enumerate() {
        if let Some((other, _)) = given[..index].iter().find(|(_, other)| place(other) == place(path)) {
            bail!("{other} and {option} are both {}; give each a file of its own", path.display());
        }
    }
    Ok(())
}

/// The path as one of a kind, as far as there is something at it.
fn place(path: &Path) -> PathBuf {
    if let Ok(whole) = path.canonicalize() {
        return whole;
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    match (absolute.parent().map(Path::canonicalize), absolute.file_name()) {
        (Some(Ok(folder)), Some(name)) => folder.join(name),
        _ => absolute,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_file_is_named_twice() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("truth.json"), "{}").unwrap();
        std::os::unix::fs::symlink(at("truth.json"), at("link.json")).unwrap();
        let check = |json: &str, html: &str| {
            distinct(&[
                ("--truth", Some(&at("truth.json"))),
                ("--json", Some(&at(json))),
                ("--markdown", None),
                ("--html", Some(&at(html))),
            ])
        };
        check("errors.json", "report.html").unwrap();
        for (json, html, expected) in [
            ("x", "x", "--json and --html are both"),
            ("x", "./x", "--json and --html are both"),
            ("link.json", "x", "--truth and --json are both"),
        ] {
            let error = check(json, html).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
