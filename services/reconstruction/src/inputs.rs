//! From a session's files to evidence: skeleton, control points, and the truth if it is known.

use crate::{
    control::{self, Markers},
    error::InputError,
};
use bytes::Bytes;
use formats::{
    FileRole, Read, archive, asf,
    session::{self, MotionFormat, PointsFormat, SkeletonFormat},
};
use model::{Motion, PointTrajectories, Skeleton};
use service::FileError;
use sparse::{FarSamples, Session};
use std::sync::Arc;

/// A file's content.
#[derive(Debug, Clone)]
pub(crate) struct NamedBytes {
    /// Name given by the user.
    pub name: String,
    /// What it is for.
    pub role: FileRole,
    /// The content.
    pub bytes: Bytes,
}

impl NamedBytes {
    /// The same file, unpacked if its name says that it is compressed.
    ///
    /// # Errors
    /// If it can't be unpacked, to at most `max_bytes`, or is an archive of several files.
    pub fn unpacked(self, max_bytes: u64) -> Result<Self, InputError> {
        let unpacked = archive::unpacked(&self.name, &self.bytes, max_bytes);
        match unpacked.map_err(|source| FileError::File { file: self.name.clone(), source })? {
            Some(bytes) => Ok(Self { bytes: bytes.into(), ..self }),
            None => Ok(self),
        }
    }
}

/// Which trajectories of a file are the control points.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Selection<'a> {
    /// Names of control points or joints; empty: all that the markers make.
    pub points: &'a [String],
    /// What the file's names stand for.
    pub markers: &'a Markers,
    /// How the files are to be read.
    pub reading: session::Options,
}

/// What a session's files say.
#[derive(Debug)]
pub(crate) struct Evidence {
    /// Skeleton, points and trajectories at 60 frames a second.
    pub session: Session,
    /// What was doubtful, each with the file's name.
    pub warnings: Vec<String>,
    /// Whether a file had the skeleton; otherwise it is the fallback.
    pub has_skeleton: bool,
}

/// Reads a session's files. `fallback`: the skeleton when none of them is one.
///
/// # Errors
/// Whatever is wrong, with the file's name and the place in it.
pub(crate) fn read(
    files: &[NamedBytes],
    selection: &Selection<'_>,
    fallback: &Arc<Skeleton>,
) -> Result<Evidence, InputError> {
    let mut warnings = Vec::new();
    let own = at_most_one(files, FileRole::Skeleton)?;
    let skeleton = match own {
        Some(file) => read_skeleton(file, selection.reading, &mut warnings)?.skeleton,
        None => fallback.clone(),
    };
    let (file, trajectories) = measured_points(files, selection.reading, &mut warnings)?;
    let Selection { points, markers, .. } = *selection;
    let chosen = control::choose(&file, trajectories, markers, points, &skeleton, &mut warnings)?;
    let far = FarSamples::find(&chosen.trajectories, &chosen.points)?;
    warnings.extend(far.map(|far| format!("{file}: {far}")));
    let session = Session::new(skeleton, chosen.points, &chosen.trajectories)?;
    if let Some(truth) = ground_truth(files, fallback, selection.reading, session.num_frames() as f64 / 60.0)?
    {
        warnings.extend(truth.warnings.iter().map(|w| w.to_string()));
        if !truth.value.skeleton().same_structure(&session.skeleton) {
            warnings.push("the ground truth uses a different skeleton, so it was not compared".to_owned());
        }
    }
    Ok(Evidence { session, warnings, has_skeleton: own.is_some() })
}

/// The motion that really was, if a file has it; `seconds`: how long the session is, from which the frame rate of an AMC
/// that does not state it is guessed.
///
/// # Errors
/// If the file can't be read.
pub(crate) fn ground_truth(
    files: &[NamedBytes],
    fallback: &Arc<Skeleton>,
    reading: session::Options,
    seconds: f64,
) -> Result<Option<Read<Motion>>, InputError> {
    let Some(file) = at_most_one(files, FileRole::GroundTruth)? else { return Ok(None) };
    let format = MotionFormat::from_name(&file.name).ok_or_else(|| kind_error(file))?;
    let is_asf = |f: &&NamedBytes| SkeletonFormat::from_name(&f.name) == Some(SkeletonFormat::Asf);
    let own = match format {
        MotionFormat::Amc => at_most_one(files, FileRole::Skeleton)?.filter(is_asf),
        MotionFormat::Bvh => None,
    };
    let acclaim = match own {
        Some(skeleton) => read_skeleton(skeleton, reading, &mut Vec::new())?,
        None => asf::File { skeleton: fallback.clone(), metres_per_unit: asf::CMU_METRES_PER_UNIT },
    };
    let read = format.read(&file.bytes, &acclaim, seconds, &reading);
    Ok(Some(read.map_err(FileError::in_file(&file.name))?))
}

fn read_skeleton(
    file: &NamedBytes,
    reading: session::Options,
    warnings: &mut Vec<String>,
) -> Result<asf::File, InputError> {
    let format = SkeletonFormat::from_name(&file.name).ok_or_else(|| kind_error(file))?;
    let read = format.read(&file.bytes, &reading);
    Ok(note(read.map_err(FileError::in_file(&file.name))?, file, warnings))
}

/// The name of the file of measured points, and what is in it.
///
/// # Errors
/// If there is none, or it can't be read.
pub(crate) fn measured_points(
    files: &[NamedBytes],
    reading: session::Options,
    warnings: &mut Vec<String>,
) -> Result<(String, PointTrajectories), InputError> {
    let role = FileRole::ControlPoints;
    let file = at_most_one(files, role)?.ok_or(FileError::Missing { role })?;
    Ok((file.name.clone(), read_points(file, reading, warnings)?))
}

fn read_points(
    file: &NamedBytes,
    reading: session::Options,
    warnings: &mut Vec<String>,
) -> Result<PointTrajectories, InputError> {
    let format = PointsFormat::from_name(&file.name).ok_or_else(|| kind_error(file))?;
    let read = format.read(&file.bytes, &reading);
    Ok(note(read.map_err(FileError::in_file(&file.name))?, file, warnings))
}

fn note<T>(read: Read<T>, file: &NamedBytes, warnings: &mut Vec<String>) -> T {
    warnings.extend(read.warnings.iter().map(|w| format!("{}: {w}", file.name)));
    read.value
}

fn at_most_one(files: &[NamedBytes], role: FileRole) -> Result<Option<&NamedBytes>, InputError> {
    let found: Vec<&NamedBytes> = files.iter().filter(|f| f.role == role).collect();
    if found.len() > 1 {
        let names = found.iter().map(|file| file.name.clone()).collect();
        return Err(FileError::Several { role, names }.into());
    }
    Ok(found.first().copied())
}

fn kind_error(file: &NamedBytes) -> InputError {
    InputError::Kind { file: file.name.clone(), role: file.role }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is read of two points, of which one is at `x` in one frame of four.
    fn read_with(x: &str, everywhere: bool) -> Result<Evidence, InputError> {
        let mut text = "time,head_x,head_y,head_z,root_x,root_y,root_z\n".to_owned();
        for frame in 0..4 {
            let x = if frame == 2 || everywhere { x } else { "0" };
            let root_x = if everywhere { x } else { "0" };
            text.push_str(&format!("{},{x},1.6,0,{root_x},1,0\n", f64::from(frame) / 60.0));
        }
        let (name, role) = ("walk.csv".to_owned(), FileRole::ControlPoints);
        let files = [NamedBytes { name, role, bytes: text.into() }];
        let model = body::BodyModel::shipped();
        let skeleton = model.skeleton(&model.shape(&[])).unwrap();
        let selection =
            Selection { points: &[], markers: &Markers::Auto, reading: session::Options::default() };
        read(&files, &selection, &Arc::new(skeleton))
    }

    #[test]
    fn samples_far_from_the_origin_are_warned_of_or_refused() {
        assert_eq!(read_with("0", false).unwrap().warnings, [""; 0]);
        let warnings = read_with("500000", false).unwrap().warnings;
        assert!(
            warnings[0].starts_with("walk.csv: 1 of 8 measured samples is more than 100 km from the origin")
                && warnings[0].ends_with("the first: head in frame 2"),
            "{warnings:?}"
        );
        let error = read_with("500000", true).unwrap_err().to_string();
        assert!(error.contains("8 of 8 measured samples are more than 100 km from the origin"), "{error}");
        assert!(error.contains("expected metres from an origin near the capture"), "{error}");
    }
}
