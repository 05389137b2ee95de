//! Names the commit that is built, for `run.json`: `MAREY_COMMIT` if it is set, else what git says, else none.

use std::{path::Path, process::Command};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed=MAREY_COMMIT");
    watch_head();
    let given = std::env::var("MAREY_COMMIT").ok().filter(|commit| !commit.is_empty());
    // Under another name: an image is built with MAREY_COMMIT empty when nobody says it, and that is no commit.
    if let Some(commit) = given.or_else(from_git) {
        println!("cargo::rustc-env=MAREY_BUILT_COMMIT={commit}");
    }
}

/// Has this run again when another commit is checked out or made. Without a checkout there is nothing to watch.
fn watch_head() {
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    // The branch has a file of its own until it is packed; the log grows with every commit.
    for name in ["HEAD", "logs/HEAD", "packed-refs"].into_iter().chain(branch.as_deref()) {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
}

/// The commit, with `-dirty` behind it if tracked files were changed since.
fn from_git() -> Option<String> {
    let commit = git(&["rev-parse", "HEAD"]).filter(|commit| !commit.is_empty())?;
    let is_dirty = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if is_dirty { format!("{commit}-dirty") } else { commit })
}

/// What git answers in our own checkout; nothing without one, whatever there is further up.
fn git(arguments: &[&str]) -> Option<String> {
    if !Path::new("../../.git").exists() {
        return None;
    }
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
