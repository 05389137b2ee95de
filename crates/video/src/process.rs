use std::{
    ffi::OsStr,
    io::{self, Read},
    path::PathBuf,
    process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio},
    thread::JoinHandle,
};

use crate::{Error, Result};

/// How much of what a program complains about is kept, bytes; the end says most.
const KEPT_COMPLAINTS: usize = 4096;

/// Where the programs are; by default wherever the system finds them by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Programs {
    /// reads and writes frames
    pub ffmpeg: PathBuf,
    /// tells what is in a file
    pub ffprobe: PathBuf,
}

impl Default for Programs {
    fn default() -> Self {
        Self { ffmpeg: "ffmpeg".into(), ffprobe: "ffprobe".into() }
    }
}

/// A program that was started; it is killed and waited for when this is dropped.
pub(crate) struct Running {
    name: String,
    child: Child,
    complaints: Option<JoinHandle<Vec<u8>>>,
}

/// Both ends of a program's pipes that are ours; the input is there if it was asked for.
pub(crate) struct Pipes {
    pub input: Option<ChildStdin>,
    pub output: ChildStdout,
}

impl Running {
    /// Starts a program with pipes for output, complaints and, if `with_input`, input.
    pub fn start<A: AsRef<OsStr>>(
        program: &PathBuf,
        arguments: impl IntoIterator<Item = A>,
        with_input: bool,
    ) -> Result<(Self, Pipes)> {
        let name = program.display().to_string();
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(if with_input { Stdio::piped() } else { Stdio::null() })
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|source| match source.kind() {
                io::ErrorKind::NotFound => Error::ProgramMissing { program: name.clone() },
                _ => Error::Program { program: name.clone(), source },
            })?;
        let (input, output, errors) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let mut running = Self { name, child, complaints: None };
        let (Some(output), Some(errors)) = (output, errors) else {
            return Err(running.failed(io::Error::other("started without pipes")));
        };
        running.complaints = Some(std::thread::spawn(move || last_bytes(errors)));
        Ok((running, Pipes { input, output }))
    }

    /// The error of talking to this program.
    pub fn failed(&self, source: io::Error) -> Error {
        Error::Program { program: self.name.clone(), source }
    }

    /// Waits for the end; gives how it ended and what it complained about.
    pub fn wait(&mut self) -> Result<(ExitStatus, String)> {
        let status = self.child.wait().map_err(|source| self.failed(source))?;
        let complaints = self.complaints.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        Ok((status, one_line(&String::from_utf8_lossy(&complaints))))
    }
}

impl Running {
    /// Kills the program if it still runs, and waits for it.
    pub fn stop(&mut self) {
        // Both fail only where the program has ended and was waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(thread) = self.complaints.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
    }
}

fn last_bytes(mut from: impl Read) -> Vec<u8> {
    let mut kept = Vec::new();
    let mut buffer = [0; 4096];
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..count]);
        if kept.len() > 2 * KEPT_COMPLAINTS {
            kept.drain(..kept.len() - KEPT_COMPLAINTS);
        }
    }
    kept.drain(..kept.len().saturating_sub(KEPT_COMPLAINTS));
    kept
}

/// The last three lines, without the addresses that ffmpeg prints.
fn one_line(complaints: &str) -> String {
    let lines: Vec<_> = complaints
        .lines()
        .map(|line| {
            line.split_once("] ").filter(|_| line.starts_with('[')).map_or(line, |(_, text)| text).trim()
        })
        .filter(|line| !line.is_empty())
        .collect();
    lines[lines.len().saturating_sub(3)..].join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complaints_are_short_and_without_addresses() {
        let text = "first\n\n[mov,mp4 @ 0x55d0] moov atom not found\nx.mp4: Invalid data\nlast\n";
        assert_eq!(one_line(text), "moov atom not found; x.mp4: Invalid data; last");
        assert_eq!(one_line(""), "");
    }

    #[test]
    fn only_the_end_of_long_complaints_is_kept() {
        let long = vec![b'x'; 100_000];
        assert_eq!(last_bytes(&long[..]).len(), KEPT_COMPLAINTS);
    }
}
