use std::io::Cursor;

use super::{Unpacking, name};
use crate::{Error, Result};

const FORMAT: &str = "zip";

/// Files only: folders and symbolic links are skipped.
pub(super) fn read(bytes: &[u8], unpacking: &mut Unpacking<'_>) -> Result<()> {
    let damaged = |e: ::zip::result::ZipError| Error::Damaged { format: FORMAT, message: e.to_string() };
    let mut archive = ::zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| match e {
        ::zip::result::ZipError::InvalidArchive(_) => {
            let message = "the list of its members can't be read: it is cut off or damaged".into();
            Error::Damaged { format: FORMAT, message }
        }
        e => damaged(e),
    })?;
    for index in 0..archive.len() {
        let member = archive.by_index(index).map_err(|e| {
            let place = format!("member {index}");
            damaged(e).in_file(place)
        })?;
        if !member.is_file() {
            continue;
        }
        let name = member.name_raw().to_vec();
        if !unpacking.takes_next(&name)? {
            continue;
        }
        if member.encrypted() {
            let message = "the member is encrypted".into();
            return Err(Error::Damaged { format: FORMAT, message }.in_file(name::shown(&name)));
        }
        let content = unpacking.read(FORMAT, &name, member)?;
        unpacking.push_member(&name, content)?;
    }
    Ok(())
}
