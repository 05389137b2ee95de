//! Files that commands write, beside those that they read.

use std::{
    fs,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};

/// A file with the option that names it.
pub type Named<'a> = (&'a str, Option<&'a PathBuf>);

/// That `outputs` can be written: each is a file of its own, none of the `inputs`, in a folder that there is. Known before the
/// work that takes its time.
///
/// # Errors
/// If it is not so.
pub fn check(inputs: &[Named<'_>], outputs: &[Named<'_>]) -> anyhow::Result<()> {
    let mut taken = given(inputs);
    for (option, path) in given(outputs) {
        if let Some(own) = Identity::from_path(path) {
            let same = |other: &Path| Identity::from_path(other).as_ref() == Some(&own);
            if let Some((other, by)) = taken.iter().find(|(_, other)| same(other)) {
                let shown = path.display();
                let also =
                    if *by == path { String::new() } else { format!(", also called {}", by.display()) };
                bail!("{other} and {option} are both {shown}{also}; give each a file of its own");
            }
        }
        taken.push((option, path));
    }
    given(outputs).into_iter().try_for_each(|(option, path)| can_be_file(option, path))
}

fn given<'a>(options: &[Named<'a>]) -> Vec<(&'a str, &'a Path)> {
    options.iter().filter_map(|(option, path)| Some((*option, path.as_ref()?.as_path()))).collect()
}

/// That nothing but a file is there, in a folder that there is.
fn can_be_file(option: &str, path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{option}: {} is a folder, expected a file to write", path.display());
    }
    let folder = match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => return Ok(()),
    };
    let found = fs::metadata(folder).with_context(|| {
        format!("{option}: {} can't be written, as its folder can't be opened", path.display())
    })?;
    if !found.is_dir() {
        bail!("{option}: {} can't be written: {} is not a folder", path.display(), folder.display());
    }
    Ok(())
}

/// What makes a file the same one under whatever name.
#[derive(Debug, PartialEq, Eq)]
enum Identity {
    /// one that there is: device and inode
    There(u64, u64),
    /// one to be made
    Place(PathBuf),
}

impl Identity {
    /// None for a terminal, a pipe or the like: what is written there replaces nothing.
    fn from_path(path: &Path) -> Option<Self> {
        if let Ok(found) = fs::metadata(path) {
            let replaces = found.is_file() || found.is_dir();
            return replaces.then(|| Self::There(found.dev(), found.ino()));
        }
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        Some(Self::Place(match (absolute.parent().map(Path::canonicalize), absolute.file_name()) {
            (Some(Ok(folder)), Some(name)) => folder.join(name),
            _ => absolute,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_file_is_named_twice() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("truth.json"), "{}").unwrap();
        std::os::unix::fs::symlink(at("truth.json"), at("link.json")).unwrap();
        fs::hard_link(at("truth.json"), at("hard.json")).unwrap();
        let check = |json: &str, html: &str| {
            let truth = at("truth.json");
            // inputs may be one file
            let inputs = [("--truth", Some(&truth)), ("--again", Some(&truth))];
            check(&inputs, &[("--json", Some(&at(json))), ("--markdown", None), ("--html", Some(&at(html)))])
        };
        check("errors.json", "report.html").unwrap();
        for (json, html, expected) in [
            ("x", "x", "--json and --html are both"),
            ("x", "./x", "--json and --html are both"),
            ("truth.json", "x", "--truth and --json are both"),
            ("link.json", "x", "--truth and --json are both"),
            ("x", "hard.json", "--truth and --html are both"),
        ] {
            let error = check(json, html).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
        let null = PathBuf::from("/dev/null");
        super::check(&[("FILE", Some(&null))], &[("--json", Some(&null)), ("--html", Some(&null))]).unwrap();
    }

    #[test]
    fn what_can_not_be_written_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "").unwrap();
        for (name, expected) in [
            ("", "is a folder, expected a file"),
            ("none/x", "its folder can't be opened"),
            ("file/x", "file is not a folder"),
        ] {
            let error = check(&[], &[("--html", Some(&at(name)))]).unwrap_err().to_string();
            assert!(error.starts_with("--html: ") && error.contains(expected), "{error}");
        }
        check(&[], &[("--html", Some(&PathBuf::from("report.html")))]).unwrap();
    }
}
