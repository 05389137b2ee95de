//! The pictures of a camera, fetched so that they can be read.

use std::path::Path;

use formats::archive::Entry;
use jobs::multi_view::{Source, SourceKind};
use queue::JobError;
use service::{Resources, compute};

use crate::{InputError, frames::Frames, members, scratch};

/// The pictures of a camera, ready to be read.
pub(crate) enum Opened {
    /// silhouettes that people made themselves
    Masks(Vec<Entry>),
    /// what a camera saw
    Frames(Frames),
}

/// Fetches a source; a video is copied into the folder `scratch`, and read with sides of at most `largest_side` pixels.
///
/// # Errors
/// If it is gone or can't be unpacked.
pub(crate) async fn open(
    resources: &Resources,
    source: &Source,
    largest_side: u32,
    scratch: &Path,
) -> Result<Opened, JobError> {
    let name = source.name.clone();
    match source.kind {
        SourceKind::Video => {
            let path = scratch::copy(&resources.store, &source.file, scratch).await?;
            Ok(Opened::Frames(Frames::Video { path, name, largest_side }))
        }
        SourceKind::Masks => Ok(Opened::Masks(entries(resources, source).await?)),
        SourceKind::Images | SourceKind::Plate => {
            let entries = entries(resources, source).await?;
            Ok(Opened::Frames(Frames::Pictures { entries, name }))
        }
    }
}

/// The members of an archive that are a source, or the one file that is.
///
/// # Errors
/// As [`open`].
pub(crate) async fn entries(resources: &Resources, source: &Source) -> Result<Vec<Entry>, JobError> {
    let bytes = resources.read_file(&source.file, resources.memory.max_object_bytes).await?;
    let (name, members) = (source.file.name.clone(), source.members.clone());
    let most = resources.memory.max_build_bytes;
    let read = compute::run(move || match &members {
        Some(members) => members::read(&name, &bytes, members, most),
        None => Ok(vec![Entry { name, bytes: bytes.to_vec() }]),
    });
    Ok(read.await.map_err(InputError::from)?)
}
