//! A process that stops the server when ours has ended, in whatever way.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Stdio};

use crate::Error;
use crate::config::Config;
use crate::programs::Programs;
use crate::server_user::ServerUser;

/// Waits for the end of its standard input, whose other end only we hold: the kernel closes it with us.
/// `$1` pg_ctl, `$2` data folder, `$3` mode; then whatever is to be removed.
const SCRIPT: &str = r#"
trap '' INT TERM HUP
read -r _
"$1" stop -w -t 60 -D "$2" -m "$3" >/dev/null 2>&1
shift 3
for folder in "$@"; do rm -rf -- "$folder"; done
"#;

pub(crate) struct Watchdog(Child);

impl Watchdog {
    pub(crate) fn start(programs: &Programs, user: &ServerUser, config: &Config) -> Result<Self, Error> {
        let mut command = user.command(Path::new("/bin/sh"));
        command.arg("-c").arg(SCRIPT).arg("postgres-watchdog").arg(programs.pg_ctl()).arg(&config.data_dir);
        if config.durable {
            command.arg("fast");
        } else {
            command.arg("immediate").arg(&config.data_dir).arg(&config.socket_dir);
        }
        // A group of its own, so that Ctrl-C at a terminal goes to us first.
        command.process_group(0).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        command.spawn().map(Self).map_err(Error::io("/bin/sh"))
    }

    /// Lets it do its work now, and waits.
    pub(crate) fn finish(&mut self) {
        drop(self.0.stdin.take());
        if let Err(error) = self.0.wait() {
            tracing::warn!(%error, "watchdog of the private cluster could not be awaited");
        }
    }
}
