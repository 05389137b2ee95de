use body::{BodyModel, ROOT_DOFS};
use model::Motion;
use motion_db::MotionDatabase;
use rayon::prelude::*;

use super::covering::{covering, squared};
use crate::{Error, Recording, Result};

/// Poses of recordings are taken so far apart, seconds: a fifth of a second later people are in another pose.
const EVERY_S: f64 = 0.2;
/// Most poses that are chosen from: what choosing takes grows with their square.
const MOST: usize = 12_000;
/// This share more is chosen first, and the loneliest are left out.
const SPARE: usize = 5;

/// The poses of recordings on the body, in their order, 0.2 s apart: root, and angles within the rig's limits. Every recording
/// has a name, for messages. Recordings are brought to the body on all cores; the result doesn't depend on how many there are.
///
/// # Errors
/// [`Error::Recording`] with the first whose skeleton is not the CMU database's.
pub fn recorded_poses(model: &BodyModel, recordings: &[(&str, &Motion)]) -> Result<Vec<Vec<f64>>> {
    let shape = model.shape(&[]);
    let poses = |&(name, motion): &(&str, &Motion)| {
        let step = (EVERY_S * motion.frame_rate()).round().max(1.0) as usize;
        let recording = Recording::new(model, &shape, motion, step);
        recording.map_err(|source| Error::Recording { name: name.to_owned(), source: Box::new(source) })
    };
    let found: Vec<Result<Recording>> = recordings.par_iter().map(poses).collect();
    let mut all = Vec::new();
    for recording in found {
        all.extend(recording?.poses);
    }
    Ok(all)
}

/// As [`recorded_poses`], of the clips of a database whose subject `is_wanted`.
///
/// # Errors
/// As there, or [`Error::Motion`].
pub fn database_poses(
    model: &BodyModel,
    database: &MotionDatabase,
    is_wanted: impl Fn(&str) -> bool,
) -> Result<Vec<Vec<f64>>> {
    let skeleton = database.skeleton();
    let mut coordinates = vec![0.0; database.num_dofs()];
    let mut motions = Vec::new();
    // a fifth of a second in frames, so that no more is copied than is used
    let every = (EVERY_S * motion_db::FRAME_RATE).round().max(1.0) as usize;
    for clip in database.clips().iter().filter(|clip| is_wanted(&clip.subject)) {
        let mut values = Vec::new();
        for pose in (clip.first_pose..clip.first_pose + clip.num_poses).step_by(every) {
            database.copy_pose(pose, &mut coordinates);
            let first = values.len();
            values.resize(first + skeleton.num_dofs(), 0.0);
            let parametrisation = database.parametrisation();
            parametrisation.pose_from_coordinates(skeleton, &coordinates, None, &mut values[first..]);
        }
        let motion = Motion::new(skeleton.clone(), 1.0 / EVERY_S, values);
        let motion = motion.map_err(|source| Error::Motion { name: clip.name.clone(), source })?;
        motions.push((clip.name.as_str(), motion));
    }
    let named: Vec<_> = motions.iter().map(|(name, motion)| (*name, motion)).collect();
    recorded_poses(model, &named)
}

/// So many poses that stand for all of `poses`, with the root at zero: the training poses of a Parzen prior. Of a few more
/// that do ([`covering`]), those that are loneliest are left out: the density's width is the largest distance of a training pose
/// from its nearest neighbour, and one odd pose would make it flat.
///
/// # Errors
/// [`Error::TooFewPoses`] if there are fewer.
pub fn training_poses(poses: &[Vec<f64>], count: usize) -> Result<Vec<Vec<f64>>> {
    if poses.len() < count {
        return Err(Error::TooFewPoses { found: poses.len(), every: EVERY_S, expected: count });
    }
    let every = poses.len().div_ceil(MOST).max(1);
    let thinned: Vec<&[f64]> = poses.iter().step_by(every).map(Vec::as_slice).collect();
    let mut chosen: Vec<Vec<f64>> = covering(&thinned, count + count / SPARE)
        .into_iter()
        .map(|index| {
            let mut pose = thinned[index].to_vec();
            pose.iter_mut().take(ROOT_DOFS).for_each(|x| *x = 0.0);
            pose
        })
        .collect();
    while chosen.len() > count {
        let nearest = |i: usize| {
            let others = chosen.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, other)| squared(&chosen[i], other)).fold(f64::INFINITY, f64::min)
        };
        let loneliest = (0..chosen.len()).max_by(|&a, &b| nearest(a).total_cmp(&nearest(b)));
        chosen.remove(loneliest.unwrap_or(0));
    }
    Ok(chosen)
}
