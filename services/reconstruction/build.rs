//! Names the commit that is built, for the reports of runs: `MAREY_COMMIT` if it is set, else what git says.

use std::process::Command;

fn main() {
    println!("cargo::rerun-if-env-changed=MAREY_COMMIT");
    // The head moves with every commit; without a checkout there is nothing to watch.
    for path in ["../../.git/HEAD", "../../.git/logs/HEAD"] {
        if std::path::Path::new(path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    println!("cargo::rerun-if-changed=build.rs");
    let given = std::env::var("MAREY_COMMIT").ok().filter(|commit| !commit.is_empty());
    if let Some(commit) = given.or_else(from_git) {
        println!("cargo::rustc-env=MAREY_COMMIT={commit}");
    }
}

/// The commit, with `-dirty` behind it if tracked files were changed since.
fn from_git() -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "HEAD"])?;
    let is_dirty = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if is_dirty { format!("{commit}-dirty") } else { commit })
}
