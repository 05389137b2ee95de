use std::ops::Range;

use model::Motion;
use motion_db::{FRAME_RATE, MotionDatabase};

use crate::{Error, FrameQuality, Parameters, Reconstruction, Result, Session};

/// A piece of a session that one worker reconstructs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk {
    /// place in the order of time
    pub index: usize,
    /// frames that are computed: warm-up before, blending after
    pub frames: Range<usize>,
    /// frames that are this chunk's own
    pub keep: Range<usize>,
}

/// Cuts a session into chunks of `chunk_frames`, each computed from `warm_up_frames` before its own and to
/// `blend_frames` after. The cut depends on the parameters alone, never on the number of workers.
pub fn plan_chunks(num_frames: usize, parameters: &Parameters) -> Vec<Chunk> {
    let mut chunks = Vec::new();
    let mut start = 0;
    while start < num_frames {
        let mut end = (start + parameters.chunk_frames).min(num_frames);
        // A remainder shorter than half a chunk goes to the chunk before.
        if num_frames - end < parameters.chunk_frames / 2 {
            end = num_frames;
        }
        chunks.push(Chunk {
            index: chunks.len(),
            frames: start.saturating_sub(parameters.warm_up_frames)
                ..(end + parameters.blend_frames).min(num_frames),
            keep: start..end,
        });
        start = end;
    }
    chunks
}

/// A whole session put together.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// the motion on the performer's skeleton, in the file's own channels, 60 frames a second
    pub motion: Motion,
    /// shape `[frames]`
    pub quality: Vec<FrameQuality>,
    /// standard deviations of the smooth coordinates of every frame (see [`crate::Reconstruction`]), metres and radians,
    /// shape `[frames, dofs]`
    pub sigmas: Vec<f64>,
}

/// Puts chunks together: over the first `blend_frames` of a chunk's own frames, the chunk before is faded out.
///
/// # Errors
/// If the reconstructions do not cover the session as [`plan_chunks`] laid it out.
pub fn merge(
    database: &MotionDatabase,
    session: &Session,
    parameters: &Parameters,
    reconstructions: &[Reconstruction],
) -> Result<Merged> {
    let dofs = database.num_dofs();
    let frames = session.num_frames();
    let chunks = plan_chunks(frames, parameters);
    if reconstructions.len() != chunks.len() {
        let found = chunks.get(reconstructions.len()).map_or(frames, |c| c.keep.start);
        return Err(Error::Chunks { found, expected: frames });
    }
    let mut coordinates = vec![0.0; frames * dofs];
    let mut quality = Vec::with_capacity(frames);
    let mut sigmas = Vec::with_capacity(frames * dofs);
    let mut blended = vec![0.0; dofs];
    for (chunk, part) in chunks.iter().zip(reconstructions) {
        let found = part.first_frame + part.quality.len();
        if part.first_frame != chunk.frames.start
            || found != chunk.frames.end
            || part.coordinates.len() != part.quality.len() * dofs
            || part.sigmas.len() != part.coordinates.len()
        {
            return Err(Error::Chunks { found, expected: chunk.frames.end });
        }
        let own = chunk.keep.start - part.first_frame;
        quality.extend_from_slice(&part.quality[own..own + chunk.keep.len()]);
        sigmas.extend_from_slice(&part.sigmas[own * dofs..(own + chunk.keep.len()) * dofs]);
        for (i, frame) in (chunk.keep.start..chunk.frames.end).enumerate() {
            let new = &part.coordinates[(own + i) * dofs..][..dofs];
            let out = &mut coordinates[frame * dofs..][..dofs];
            if chunk.index == 0 || i >= parameters.blend_frames {
                out.copy_from_slice(new);
                continue;
            }
            let share = smooth_step((i + 1) as f64 / (parameters.blend_frames + 1) as f64);
            blended.copy_from_slice(new);
            database.parametrisation().unwrap_near(&mut blended, out);
            for (old, new) in out.iter_mut().zip(&blended) {
                *old += share * (new - *old);
            }
        }
    }
    let mut values = vec![0.0; frames * dofs];
    for frame in 0..frames {
        let (done, rest) = values.split_at_mut(frame * dofs);
        let previous = (frame > 0).then(|| &done[(frame - 1) * dofs..]);
        let x = &coordinates[frame * dofs..][..dofs];
        database.parametrisation().pose_from_coordinates(&session.skeleton, x, previous, &mut rest[..dofs]);
    }
    let motion = Motion::new(session.skeleton.clone(), FRAME_RATE, values)?;
    Ok(Merged { motion, quality, sigmas })
}

/// 0 to 1 with flat ends.
fn smooth_step(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_keep_every_frame_once() {
        let parameters = Parameters::default();
        for frames in [1, 59, 600, 899, 900, 901, 12_345] {
            let chunks = plan_chunks(frames, &parameters);
            let mut next = 0;
            for chunk in &chunks {
                assert_eq!(chunk.keep.start, next);
                assert!(chunk.frames.start <= chunk.keep.start && chunk.keep.end <= chunk.frames.end);
                next = chunk.keep.end;
            }
            assert_eq!(next, frames);
        }
    }
}
