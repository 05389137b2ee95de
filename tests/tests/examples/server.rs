//! A `marey up` of its own, and shell scripts that talk to it.

use std::{
    fs,
    io::{BufRead, BufReader},
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Child, Command, Stdio},
};

use anyhow::{Context, Result, bail};
use tempfile::TempDir;

/// This program as `marey`, built beside the tests.
pub const MAREY: &str = env!("CARGO_BIN_EXE_marey-under-test");

/// What the scripts call instead of the program: `marey up` is there already, and of runs that are started the ids are kept.
const WRAPPER: &str = r#"#!/usr/bin/env bash
set -uo pipefail
if [[ ${1:-} == up ]]; then exec "$MAREY_UNDER_TEST" health "$MAREY_URL"; fi
"$MAREY_UNDER_TEST" "$@" | tee "$SCRATCH/said"
status=${PIPESTATUS[0]}
sed -n 's/^run \([0-9a-f-]\{36\}\)$/\1/p' "$SCRATCH/said" >>"$SCRATCH/runs"
exit "$status"
"#;
/// Before every script. `make build` is what built the tests.
const PREAMBLE: &str = r#"set -euo pipefail
trap 'echo "failed at line $LINENO: $BASH_COMMAND" >&2' ERR
make() { [[ $1 == build ]] || command make "$@"; }
"#;
/// What a page may take, seconds.
const PAGE_SECONDS: &str = "150";

/// `marey up` in a folder that is thrown away.
pub struct Server {
    child: Child,
    folder: TempDir,
    url: String,
}

impl Server {
    pub fn start() -> Result<Self> {
        // the user who runs PostgreSQL must be able to enter
        let folder = TempDir::new_in("/var/tmp")?;
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755))?;
        let mut child = Command::new(MAREY)
            .args(["up", "--listen", "127.0.0.1:0"])
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()?;
        let lines = BufReader::new(child.stdout.take().context("no output")?).lines();
        let mut url = None;
        for line in lines {
            let line = line?;
            let address = line.split_whitespace().find(|word| word.starts_with("http://127.0.0.1:"));
            url = url.or(address.map(str::to_owned));
            if line.contains("Ctrl-C") {
                let url = url.context("marey up told no address")?;
                return Ok(Self { child, folder, url });
            }
        }
        bail!("marey up ended with {}", child.wait()?)
    }

    /// Where pages have their folders; commands in them find the server.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A key to a new project of that name.
    pub fn key(&self, project: &str) -> Result<String> {
        let output = Command::new(MAREY)
            .args(["key", "create", "--project", project])
            .current_dir(self.folder())
            .output()?;
        let key = String::from_utf8(output.stdout)?.trim().to_owned();
        anyhow::ensure!(key.starts_with("mk_"), "no key: {}", String::from_utf8_lossy(&output.stderr));
        Ok(key)
    }

    /// Runs a script in a folder; what it said, if it failed.
    pub fn run(&self, script: &str, folder: &Path, key: &str) -> Result<()> {
        let programs = folder.join(".programs");
        fs::create_dir_all(&programs)?;
        fs::write(programs.join("marey"), WRAPPER)?;
        fs::set_permissions(programs.join("marey"), fs::Permissions::from_mode(0o755))?;
        fs::write(programs.join("preamble"), PREAMBLE)?;
        let path = programs.join("script");
        fs::write(&path, script)?;
        let search = format!("{}:{}", programs.display(), std::env::var("PATH")?);
        let output = Command::new("timeout")
            .args([PAGE_SECONDS, "bash", "-c", ". .programs/preamble; . .programs/script"])
            .current_dir(folder)
            .env("PATH", search)
            .env("SCRATCH", &programs)
            .env("MAREY_UNDER_TEST", MAREY)
            .env("MAREY_URL", &self.url)
            .env("MAREY_API_KEY", key)
            .stdin(Stdio::null())
            .output()?;
        if output.status.success() {
            return Ok(());
        }
        let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let last: Vec<&str> = said.iter().flat_map(|text| text.lines()).collect();
        bail!("{}\n{}", output.status, last[last.len().saturating_sub(25)..].join("\n"))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let id = rustix::process::Pid::from_child(&self.child);
        // a server that has died already is what some test has to tell, not this
        let _ = rustix::process::kill_process(id, rustix::process::Signal::TERM);
        let _ = self.child.wait();
    }
}
