//! PostgreSQL's lock files, which name the process that holds a folder or a socket.
//!
//! The server takes a lock file for valid as long as a process has the pid in it. A killed server that nobody reaps (in
//! a container whose first process doesn't) keeps its pid, and after a restart of the machine the pid may be somebody
//! else's. Neither lets a server start, and stopping what the file names would wait for the one and end the other.

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::config::Config;

/// Above the kernel's limit of 2^22: no process ever has it.
const NO_PID: i32 = i32::MAX;

/// What tells one folder from another, whatever its path: device and inode.
type FolderId = (u64, u64);

/// What is known of the process that a lock file names.
#[derive(Debug, Clone, Copy)]
struct Holder {
    /// letter of its state, as in `/proc/PID/stat`
    state: char,
    /// the folder that it works in, if it lets us know
    working_folder: Option<FolderId>,
}

impl Holder {
    /// None if there is no such process, or no way to know.
    fn find(pid: u32) -> Option<Self> {
        let process = PathBuf::from(format!("/proc/{pid}"));
        let stat = fs::read(process.join("stat")).ok()?;
        let state = state(&String::from_utf8_lossy(&stat))?;
        Some(Self { state, working_folder: folder_id(&process.join("cwd")) })
    }

    /// Whether it is surely no live server of this folder: it has ended, or it works in another folder. A server enters
    /// its data folder before it writes a lock file, and stays there.
    fn is_no_server(self, data_dir: FolderId) -> bool {
        matches!(self.state, 'Z' | 'X') || self.working_folder.is_some_and(|folder| folder != data_dir)
    }
}

/// The state in the text of `/proc/PID/stat`: after the program's name, which may hold blanks and parentheses.
fn state(stat: &str) -> Option<char> {
    stat.rsplit_once(')')?.1.trim_start().chars().next()
}

fn folder_id(path: &Path) -> Option<FolderId> {
    path.metadata().ok().map(|metadata| (metadata.dev(), metadata.ino()))
}

/// Lets go of the lock files of a cluster whose pid is surely no live server's.
///
/// They stay, with a pid that nobody has: the rest of `postmaster.pid` names the shared memory, by which a new server
/// sees whether processes of the old one are still at work.
pub(crate) fn release(config: &Config, socket: &Path) -> Result<(), Error> {
    let Some(data_dir) = folder_id(&config.data_dir) else { return Ok(()) };
    let mut socket_lock = socket.to_owned().into_os_string();
    socket_lock.push(".lock");
    for path in [config.data_dir.join("postmaster.pid"), socket_lock.into()] {
        let Ok(text) = fs::read_to_string(&path) else { continue };
        let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
        let Ok(pid) = first.trim().parse() else { continue };
        if Holder::find(pid).is_some_and(|holder| holder.is_no_server(data_dir)) {
            tracing::warn!(file = %path.display(), pid, "lock file of a server that has ended");
            // At once and never shorter, so that there is no moment at which the file is empty.
            let text = format!("{NO_PID}\n{rest}");
            let file = File::options().write(true).open(&path);
            file.and_then(|mut file| file.write_all(text.as_bytes())).map_err(Error::io(&path))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: FolderId = (1, 2);

    #[test]
    fn the_state_comes_after_the_name_whatever_that_holds() {
        assert_eq!(state("41 (postgres) Z 1 41 41 0 -1"), Some('Z'));
        assert_eq!(state("41 (a) Z (b) S 1 41"), Some('S'));
        assert_eq!(state("41 (postgres)"), None);
        assert_eq!(state(""), None);
    }

    #[test]
    fn only_what_is_surely_no_server_of_the_folder_loses_its_lock() {
        let is_no_server = |state, working_folder| Holder { state, working_folder }.is_no_server(OURS);
        // a zombie has no working folder any more
        assert!(is_no_server('Z', None));
        assert!(is_no_server('S', Some((1, 3))), "a pid that another process has now");
        assert!(!is_no_server('S', Some(OURS)));
        assert!(!is_no_server('T', Some(OURS)), "stopped, and may go on");
        assert!(!is_no_server('S', None), "may be a server: we cannot see");
    }
}
