use model::Motion;

use crate::{Clip, Error, Result, mirror};

/// Motion made of recorded motion, to be indexed beside it.
///
/// Every clip comes in all combinations: as it was and mirrored, as fast as it was and at every speed of `speeds`. A
/// variant is named after its clip, `16_15~mirror`, `16_15~x0.8`, `16_15~mirror~x0.8`; see [`trial_name`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Augment {
    /// whether left and right are exchanged, see [`mirror`]
    pub mirror: bool,
    /// speeds relative to the recorded one, see [`warp`]; 1 is always there and need not be named
    pub speeds: Vec<f64>,
}

/// Largest change of speed; the smallest is its inverse. Bounds the memory that a variant takes.
const MAX_SPEED: f64 = 16.0;
/// Between a trial's name and what was made of it.
const VARIANT: char = '~';

/// Name of the trial that a clip was made of: `16_15` of `16_15~mirror~x0.8`. Whoever leaves a trial out leaves out all
/// that was made of it.
pub fn trial_name(clip: &str) -> &str {
    clip.split(VARIANT).next().unwrap_or(clip)
}

impl Augment {
    /// Mirroring and the speeds 0.8 and 1.25: about six times as much motion.
    pub fn all() -> Self {
        Self { mirror: true, speeds: Self::warps() }
    }

    /// The speeds of time-warping: 0.8 and 1.25.
    pub fn warps() -> Vec<f64> {
        vec![0.8, 1.25]
    }

    /// The clip itself, first, and its variants.
    ///
    /// # Errors
    /// If it is to be mirrored and the skeleton has no left and right that are alike, or a speed is past its bounds.
    pub fn clips(&self, clip: &Clip) -> Result<Vec<Clip>> {
        let mut sides = vec![clip.clone()];
        if self.mirror {
            let name = format!("{}{VARIANT}mirror", clip.name);
            sides.push(Clip { name, motion: mirror(&clip.motion)?, ..clip.clone() });
        }
        let mut all = sides.clone();
        for speed in self.speeds.iter().filter(|speed| **speed != 1.0) {
            for side in &sides {
                all.push(warp(side, *speed)?);
            }
        }
        Ok(all)
    }
}

/// The clip `speed` times as fast: the same poses at other times. The database resamples it to 60 frames a second.
///
/// # Errors
/// [`Error::Speed`] if the speed is not between 1/16 and 16.
pub fn warp(clip: &Clip, speed: f64) -> Result<Clip> {
    let wrong = Error::Speed { found: speed, max: MAX_SPEED };
    if !(1.0 / MAX_SPEED..=MAX_SPEED).contains(&speed) {
        return Err(wrong);
    }
    let motion = &clip.motion;
    let values = motion.values().to_vec();
    let motion = Motion::new(motion.skeleton().clone(), motion.frame_rate() * speed, values);
    let name = format!("{}{VARIANT}x{speed}", clip.name);
    Ok(Clip { name, motion: motion.map_err(|_| wrong)?, ..clip.clone() })
}
