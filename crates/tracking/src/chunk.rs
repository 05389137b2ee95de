//! Sessions in chunks, so that many workers share one: each begins with a key frame of its own.

use body::{BodyModel, Posed, Shape};
use nalgebra::Vector3;

use crate::{Error, Result, Tracked, blended, predict::unwind};

/// Chunks that put a joint more than this apart where they meet do not agree, metres: one of them lost the person.
const AGREE_M: f64 = 0.08;

/// The frames of one chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkPlan {
    /// the key frame, which `shape_fit` finds without a start
    pub first: usize,
    /// one past the last frame; the last ones belong to the next chunk as well
    pub end: usize,
}

/// Divides a session into chunks of `length` frames, each of which extends `overlap` frames into the next.
pub fn plan_chunks(num_frames: usize, length: usize, overlap: usize) -> Vec<ChunkPlan> {
    let length = length.max(1);
    (0..num_frames)
        .step_by(length)
        .map(|first| ChunkPlan { first, end: (first + length).saturating_add(overlap).min(num_frames) })
        .collect()
}

/// What was tracked in one chunk, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Chunk {
    /// in order, without gaps
    pub frames: Vec<Tracked>,
}

/// Where two chunks meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seam {
    /// first frame that the later chunk gave, in part or wholly
    pub frame: usize,
    /// largest distance between the same joint of both chunks in their common frames, metres; `None` without common frames
    pub apart_m: Option<f64>,
    /// poses go over smoothly; otherwise each common frame is that of the chunk that covers the silhouettes better
    pub is_smooth: bool,
}

/// A whole session.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// in order, without gaps
    pub frames: Vec<Tracked>,
    /// one between each two chunks
    pub seams: Vec<Seam>,
}

/// Puts chunks of one person together, in the order of their frames. Where two have frames in common and agree, poses go over
/// from one to the other smoothly; quality is that of the chunk with the larger share. The root's rotation vector goes on without
/// jumps of whole turns.
///
/// # Errors
/// [`Error::Gap`] if frames are missing between two chunks.
pub fn merge(model: &BodyModel, shape: &Shape, chunks: &[Chunk]) -> Result<Merged> {
    let mut merged = Merged { frames: Vec::new(), seams: Vec::new() };
    for (index, chunk) in chunks.iter().enumerate() {
        let (Some(from), Some(last)) = (chunk.frames.first(), merged.frames.last()) else {
            merged.frames.extend_from_slice(&chunk.frames);
            continue;
        };
        let end = last.frame + 1;
        let begin = merged.frames[0].frame;
        if from.frame > end || from.frame < begin {
            return Err(Error::Gap { index, found: from.frame, expected: end });
        }
        let common = end - from.frame;
        let at = merged.frames.len() - common;
        let pairs = || merged.frames[at..].iter().zip(&chunk.frames);
        let apart = |(a, b): (&Tracked, &Tracked)| largest_distance(&a.joints, &b.joints);
        let apart_m = (common > 0).then(|| pairs().map(apart).fold(0.0, f64::max));
        let is_smooth = apart_m.is_some_and(|apart| apart <= AGREE_M);
        merged.seams.push(Seam { frame: from.frame, apart_m, is_smooth });
        for (i, (earlier, later)) in merged.frames[at..].iter_mut().zip(&chunk.frames).enumerate() {
            let share = smooth_step((i + 1) as f64 / (common + 1) as f64);
            if is_smooth {
                let pose = blended(&earlier.pose, &later.pose, share);
                if share > 0.5 {
                    *earlier = later.clone();
                }
                earlier.joints = joints(model, shape, &pose);
                earlier.pose = pose;
            } else if later.mean_iou() > earlier.mean_iou() {
                *earlier = later.clone();
            }
        }
        merged.frames.extend(chunk.frames.iter().skip(common).cloned());
    }
    // each chunk counts whole turns from its own key frame
    for i in 1..merged.frames.len() {
        let (before, here) = merged.frames.split_at_mut(i);
        unwind(&mut here[0].pose, &before[i - 1].pose);
    }
    Ok(merged)
}

fn joints(model: &BodyModel, shape: &Shape, pose: &[f64]) -> Vec<Vector3<f64>> {
    let mut posed = Posed::default();
    shape.pose_joints(model, pose, &mut posed);
    posed.joints
}

fn largest_distance(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn smooth_step(x: f64) -> f64 {
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Misalignment, Stage};

    fn chunk(model: &BodyModel, shape: &Shape, plan: ChunkPlan, offset: f64, iou: f64) -> Chunk {
        let frame = |frame: usize| {
            let mut pose = vec![0.0; model.rig().num_dofs()];
            (pose[0], pose[8]) = (frame as f64 * 0.01 + offset, 0.3);
            Tracked {
                frame,
                joints: joints(model, shape, &pose),
                pose,
                ious: vec![Some(iou)],
                misalignment: Misalignment::from_errors([0.0; 10], 0.03),
                stage: Stage::Local,
                effective_sample_size: None,
            }
        };
        Chunk { frames: (plan.first..plan.end).map(frame).collect() }
    }

    #[test]
    fn chunks_that_agree_are_merged_without_a_seam() {
        let model = BodyModel::shipped();
        let shape = model.shape(&[]);
        let plans = plan_chunks(40, 15, 5);
        assert_eq!(plans[1], ChunkPlan { first: 15, end: 35 });
        assert_eq!((plans.len(), plans[2].end), (3, 40));
        let chunks: Vec<_> = plans
            .iter()
            .zip([0.0, 0.03, 0.01])
            .map(|(plan, offset)| chunk(&model, &shape, *plan, offset, 0.9))
            .collect();
        let merged = merge(&model, &shape, &chunks).unwrap();
        assert!(merged.seams.iter().all(|seam| seam.is_smooth) && merged.seams.len() == 2);
        assert!((0..40).eq(merged.frames.iter().map(|tracked| tracked.frame)));
        for pair in merged.frames.windows(2) {
            // 1 cm of movement, and no more than a fair part of 3 cm
            let moved = largest_distance(&pair[0].joints, &pair[1].joints);
            assert!(moved < 0.018, "{moved} m before frame {}", pair[1].frame);
        }
    }

    #[test]
    fn where_chunks_disagree_the_one_that_covers_better_is_believed() {
        let model = BodyModel::shipped();
        let shape = model.shape(&[]);
        let plans = [ChunkPlan { first: 0, end: 12 }, ChunkPlan { first: 10, end: 20 }];
        let chunks = [chunk(&model, &shape, plans[0], 0.5, 0.4), chunk(&model, &shape, plans[1], 0.0, 0.9)];
        let merged = merge(&model, &shape, &chunks).unwrap();
        assert!(!merged.seams[0].is_smooth && (merged.seams[0].apart_m.unwrap() - 0.5).abs() < 1e-9);
        assert_eq!(merged.frames[10], chunks[1].frames[0]);
        let apart = [chunks[0].clone(), chunk(&model, &shape, ChunkPlan { first: 13, end: 15 }, 0.0, 0.9)];
        assert_eq!(merge(&model, &shape, &apart), Err(Error::Gap { index: 1, found: 13, expected: 12 }));
    }
}
