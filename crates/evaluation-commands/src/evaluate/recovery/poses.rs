//! The poses that bodies are drawn in, and those of the prior.

use std::path::PathBuf;

use anyhow::{Context, bail};
use body::BodyModel;
use clap::ValueEnum;
use evaluation::training_poses::{covering, recorded_poses, training_poses};
use model::counted;
use motion_db::Clip;
use sample_motion::{Action, DrawOptions, Model};

use crate::motions;

/// Poses of a prior.
pub(in crate::evaluate) const TRAINING_POSES: usize = 100;
/// Parts that performers are divided into.
const PARTS: usize = 3;
/// Frames of a trial of synthetic motion, at 60 a second, and trials for each pose that is needed.
const FRAMES: usize = 240;

/// Whose poses bodies are drawn in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// performers that nothing was tried on
    Report,
    /// performers that settings may be tried on
    Tune,
}

pub struct Poses {
    /// one a start, shape `[starts][dofs]`
    pub drawn: Vec<Vec<f64>>,
    /// of other performers; `None` for the built-in ones
    pub prior: Option<Vec<Vec<f64>>>,
    /// whose poses they are
    pub note: String,
}

/// Poses of recordings, or of synthetic motion if there are none.
pub fn read(
    model: &BodyModel,
    folders: &[PathBuf],
    part: Part,
    starts: usize,
    seed: u64,
) -> anyhow::Result<Poses> {
    if folders.is_empty() {
        return synthetic(model, part, starts, seed);
    }
    let clips = motions::read(folders)?;
    let mut performers: Vec<&str> = clips.iter().map(|clip| clip.subject.as_str()).collect();
    performers.sort_unstable();
    performers.dedup();
    if performers.len() < PARTS {
        bail!("found recordings of {} performers, expected at least {PARTS}", performers.len());
    }
    let in_part = |part: usize| -> (Vec<&str>, Vec<&Clip>) {
        let those: Vec<&str> = performers.iter().skip(part).step_by(PARTS).copied().collect();
        let clips = clips.iter().filter(|clip| those.contains(&clip.subject.as_str())).collect();
        (those, clips)
    };
    let (drawn_of, drawn) = in_part(if part == Part::Report { 0 } else { 1 });
    let (prior_of, prior) = in_part(2);
    eprintln!("bringing {} to the body", counted(drawn.len() + prior.len(), "recording"));
    let [drawn, prior] = [drawn, prior].map(|clips| poses(model, &clips));
    Ok(Poses {
        drawn: chosen(&drawn?, starts)?,
        prior: Some(training_poses(&prior?, TRAINING_POSES)?),
        note: format!(
            "bodies in poses of performers {}, prior of {}",
            drawn_of.join(" "),
            prior_of.join(" ")
        ),
    })
}

/// Poses of recordings on the body.
pub(in crate::evaluate) fn poses(model: &BodyModel, clips: &[&Clip]) -> anyhow::Result<Vec<Vec<f64>>> {
    let named: Vec<_> = clips.iter().map(|clip| (clip.name.as_str(), &clip.motion)).collect();
    Ok(recorded_poses(model, &named)?)
}

fn synthetic(model: &BodyModel, part: Part, starts: usize, seed: u64) -> anyhow::Result<Poses> {
    let drawer = Model::bundled();
    // 20 poses a trial, of which the most different are taken
    let trials = starts.div_ceil(5) as u64;
    let first = if part == Part::Report { 1 << 32 } else { 0 };
    let motions = (0..trials)
        .map(|trial| {
            let action = Action::ALL[trial as usize % Action::ALL.len()];
            let options = DrawOptions { frames: FRAMES, subject: first + trial };
            drawer.draw(action, seed.wrapping_add(first + trial), &options)
        })
        .collect::<Result<Vec<_>, _>>()
        .context("cannot make synthetic motion")?;
    let named: Vec<_> = motions.iter().map(|motion| ("synthetic motion", motion)).collect();
    let drawn = chosen(&recorded_poses(model, &named)?, starts)?;
    Ok(Poses { drawn, prior: None, note: "bodies in poses of synthetic motion, built-in prior".to_owned() })
}

/// The poses that stand for all others best, as many as there are starts.
fn chosen(poses: &[Vec<f64>], starts: usize) -> anyhow::Result<Vec<Vec<f64>>> {
    if poses.len() < starts {
        bail!("the recordings have {}, expected at least --starts, {starts}", counted(poses.len(), "pose"));
    }
    Ok(covering(poses, starts).into_iter().map(|index| poses[index].clone()).collect())
}
