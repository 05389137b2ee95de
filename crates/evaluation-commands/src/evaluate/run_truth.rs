//! The true motion of a run, out of its session's files.

use anyhow::{Context, bail};
use formats::{
    FileRole, asf,
    session::{self, MotionFormat, SkeletonFormat},
};
use model::Motion;

/// A file, unpacked.
pub struct File {
    pub name: String,
    pub role: FileRole,
    pub bytes: Vec<u8>,
}

/// The file of a role, if there is any.
pub fn only(files: &[File], role: FileRole) -> anyhow::Result<Option<&File>> {
    let found: Vec<&File> = files.iter().filter(|file| file.role == role).collect();
    if found.len() > 1 {
        bail!(role.keep_one(&found.iter().map(|file| file.name.as_str()).collect::<Vec<_>>()));
    }
    Ok(found.first().copied())
}

/// The true motion: a BVH's own, an AMC's on the session's ASF or, without one, on the skeleton of what was found.
pub fn true_motion(
    truth: &File,
    skeleton: Option<&File>,
    found: &Motion,
    reading: &session::Options,
) -> anyhow::Result<Motion> {
    let format = MotionFormat::from_name(&truth.name)
        .with_context(|| format!("{}: not a {} file", truth.name, FileRole::GroundTruth.endings()))?;
    let acclaim =
        match skeleton.filter(|file| SkeletonFormat::from_name(&file.name) == Some(SkeletonFormat::Asf)) {
            Some(file) if format == MotionFormat::Amc => {
                asf::read(&file.bytes).with_context(|| file.name.clone())?.value
            }
            _ => asf::File { skeleton: found.skeleton().clone(), metres_per_unit: asf::CMU_METRES_PER_UNIT },
        };
    let seconds = found.num_frames() as f64 / found.frame_rate();
    Ok(format.read(&truth.bytes, &acclaim, seconds, reading).with_context(|| truth.name.clone())?.value)
}
