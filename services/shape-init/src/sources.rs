//! Which files are which camera's.

use std::collections::BTreeMap;

use bytes::Bytes;
use formats::FileRole;
use jobs::{
    InputFile,
    multi_view::{Members, Source, SourceKind},
};
use model::counted;
use multi_view::{assign, find_camera};
use service::FileError;

use crate::{
    InputError,
    members::{groups, is_picture, pictures},
};

/// Pictures and plate of one camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraSources {
    /// index among the calibrated cameras
    pub camera: usize,
    pub pictures: Source,
    pub plate: Option<Source>,
}

/// How a file is read, by its role; `None` for those that hold no pictures.
fn source_kind(role: FileRole) -> Option<SourceKind> {
    match role {
        FileRole::Video => Some(SourceKind::Video),
        FileRole::Images => Some(SourceKind::Images),
        FileRole::Masks => Some(SourceKind::Masks),
        FileRole::Plate => Some(SourceKind::Plate),
        FileRole::Skeleton
        | FileRole::ControlPoints
        | FileRole::GroundTruth
        | FileRole::Motion
        | FileRole::Scans
        | FileRole::Calibration => None,
    }
}

/// Whether the file has to be looked into to know its sources.
pub(crate) fn is_archive(file: &InputFile) -> bool {
    source_kind(file.role).is_some_and(|kind| kind != SourceKind::Video) && !is_picture(&file.name)
}

/// The sources of an archive: folders of frames, or single plates.
///
/// # Errors
/// If the archive is damaged or holds no picture.
pub(crate) fn from_archive(
    file: &InputFile,
    bytes: &Bytes,
    max_bytes: u64,
) -> Result<Vec<Source>, InputError> {
    let Some(kind) = source_kind(file.role) else { return Ok(Vec::new()) };
    let names = pictures(&file.name, bytes, max_bytes)?;
    if names.is_empty() {
        return Err(FileError::unexpected(&file.name, "no PNG or JPEG in it", "pictures, one a frame").into());
    }
    let source = |inside: &str, members: Members| {
        let name = if inside.is_empty() { file.name.clone() } else { format!("{}/{inside}", file.name) };
        Source { name, kind, file: file.clone(), members: Some(members) }
    };
    if kind == SourceKind::Plate {
        return Ok(names.iter().map(|name| source(name, Members::One(name.clone()))).collect());
    }
    let from_group = |members: Members| {
        let inside = match &members {
            Members::Prefix { folder, prefix } if !folder.is_empty() => format!("{folder}/{prefix}"),
            Members::Folder(inside) | Members::One(inside) | Members::Prefix { prefix: inside, .. } => {
                inside.clone()
            }
        };
        source(&inside, members)
    };
    Ok(groups(&names).into_iter().map(from_group).collect())
}

/// The source that a file is by itself.
pub(crate) fn from_file(file: &InputFile) -> Option<Source> {
    let kind = source_kind(file.role)?;
    Some(Source { name: file.name.clone(), kind, file: file.clone(), members: None })
}

/// Puts sources and cameras together. Cameras that nobody asked for and that have no pictures are left out, with a warning.
///
/// # Errors
/// If a file has no camera, a camera two, or one that was asked for none.
pub(crate) fn match_cameras(
    sources: Vec<Source>,
    cameras: &[String],
    asked: &[String],
    map: &BTreeMap<String, String>,
    warnings: &mut Vec<String>,
) -> Result<Vec<CameraSources>, InputError> {
    let asked = asked.iter().map(|name| {
        find_camera(name, cameras)
            .ok_or_else(|| InputError::NoCamera { name: name.clone(), known: cameras.join(", ") })
    });
    let asked: Vec<usize> = asked.collect::<Result<_, _>>()?;
    let (plates, pictures): (Vec<Source>, Vec<Source>) =
        sources.into_iter().partition(|source| source.kind == SourceKind::Plate);
    let known = |sources: &[Source]| -> (Vec<String>, BTreeMap<String, String>) {
        let names: Vec<String> = sources.iter().map(|source| source.name.clone()).collect();
        let own = map.iter().filter(|(name, _)| names.contains(name));
        let own = own.map(|(name, camera)| (name.clone(), camera.clone())).collect();
        (names, own)
    };
    let (names, own) = known(&pictures);
    let (plate_names, plate_map) = known(&plates);
    if let Some(stray) = map.keys().find(|name| !own.contains_key(*name) && !plate_map.contains_key(*name)) {
        let all = names.iter().chain(&plate_names).cloned().collect::<Vec<_>>().join(", ");
        return Err(FileError::unexpected(
            "--camera FILE=CAMERA (camera_files)",
            format!("{stray:?}"),
            format!("one of {all}"),
        )
        .into());
    }
    let assigned = assign(&names, cameras, &own)?;
    let mut found: Vec<CameraSources> = assigned
        .into_iter()
        .map(|a| CameraSources { camera: a.camera, pictures: pictures[a.source].clone(), plate: None })
        .collect();
    for assigned in assign(&plate_names, cameras, &plate_map)? {
        match found.iter_mut().find(|seen| seen.camera == assigned.camera) {
            Some(seen) => seen.plate = Some(plates[assigned.source].clone()),
            None => warnings.push(format!("{}: its camera has no pictures", plate_names[assigned.source])),
        }
    }
    found.sort_by_key(|seen| seen.camera);
    if !asked.is_empty() {
        found.retain(|seen| asked.contains(&seen.camera));
    }
    for (index, name) in cameras.iter().enumerate() {
        let is_missing = found.iter().all(|seen| seen.camera != index);
        if is_missing && asked.contains(&index) {
            return Err(FileError::unexpected(
                format!("camera {name}"),
                "no video, pictures or masks",
                "a file named after it",
            )
            .into());
        }
        if is_missing && asked.is_empty() {
            warnings.push(format!("camera {name} has no video, pictures or masks: it is not used"));
        }
    }
    Ok(found)
}

/// Refuses sessions with fewer than `least` cameras.
///
/// # Errors
/// If there are fewer.
pub(crate) fn check_count(found: &[CameraSources], least: usize) -> Result<(), InputError> {
    if found.len() >= least {
        return Ok(());
    }
    let seen = format!("pictures of {}", counted(found.len(), "camera"));
    Err(FileError::unexpected("session", seen, format!("at least {least}")).into())
}
