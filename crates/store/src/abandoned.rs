//! Removing uploads that nobody will finish.

use std::{
    fs, io,
    path::PathBuf,
    time::{Duration, SystemTime},
};

use crate::{Error, Store};

impl Store {
    /// Removes what writes that were cut off left in a folder store, if nothing was added to it for so long: a process that
    /// was killed can't. Returns how many files. Does nothing in other stores.
    ///
    /// # Errors
    /// [`Error::Backend`] if a folder can't be read, or a file can't be removed.
    pub async fn remove_abandoned_uploads(&self, idle: Duration) -> Result<usize, Error> {
        let Some(folder) = self.folder.clone() else { return Ok(0) };
        let swept = tokio::task::spawn_blocking(move || sweep(folder, idle)).await;
        swept.map_err(io::Error::other).flatten().map_err(Error::from_io)
    }
}

fn sweep(folder: PathBuf, idle: Duration) -> io::Result<usize> {
    let mut removed = 0;
    let mut open = vec![folder];
    while let Some(folder) = open.pop() {
        let Some(entries) = unless_gone(fs::read_dir(&folder))? else { continue };
        for entry in entries {
            let entry = entry?;
            let kind = entry.file_type()?;
            if kind.is_dir() {
                open.push(entry.path());
            } else if kind.is_file() && is_unfinished(&entry.file_name().to_string_lossy()) {
                removed += usize::from(remove_if_idle(&entry, idle)?);
            }
        }
    }
    Ok(removed)
}

fn remove_if_idle(entry: &fs::DirEntry, idle: Duration) -> io::Result<bool> {
    let Some(found) = unless_gone(entry.metadata())? else { return Ok(false) };
    // one from the future, by a clock that is set wrong, is as good as new
    let age = SystemTime::now().duration_since(found.modified()?).unwrap_or_default();
    Ok(age >= idle && unless_gone(fs::remove_file(entry.path()))?.is_some())
}

/// Other processes rename and remove files meanwhile.
fn unless_gone<T>(done: io::Result<T>) -> io::Result<Option<T>> {
    match done {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Objects are written as `NAME#1` and renamed when they are whole; the names of objects have no `#`.
fn is_unfinished(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, number)| !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit()))
}
