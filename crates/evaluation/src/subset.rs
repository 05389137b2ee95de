//! Smaller databases out of a larger one.

use motion_db::{Clip, FRAME_RATE};

/// Number of poses of a clip at 60 frames a second.
pub fn poses_at_60(clip: &Clip) -> usize {
    (clip.motion.num_frames() as f64 * FRAME_RATE / clip.motion.frame_rate()).ceil() as usize
}

/// Brings clips into an order that depends on their names alone and mixes performers and actions: by the BLAKE3 of the
/// name. Databases of rising size made of the first clips then contain one another, whatever else there is.
pub fn shuffle_by_name(clips: &mut [Clip]) {
    clips.sort_by_cached_key(|clip| (*blake3::hash(clip.name.as_bytes()).as_bytes(), clip.name.clone()));
}

/// The first clips that together have at least `poses` poses at 60 frames a second (or all), and how many they have.
pub fn first_clips(clips: &[Clip], poses: usize) -> (&[Clip], usize) {
    let mut total = 0;
    for (i, clip) in clips.iter().enumerate() {
        total += poses_at_60(clip);
        if total >= poses {
            return (&clips[..=i], total);
        }
    }
    (clips, total)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::{Axis, Channel, Joint, Motion, Skeleton};
    use std::sync::Arc;

    fn clips(frames: &[usize]) -> Vec<Clip> {
        let root = Joint::root("root", vec![Channel::rotation(Axis::X)]);
        let skeleton = Arc::new(Skeleton::new("s", vec![root]).unwrap());
        let clip = |(i, &frames): (usize, &usize)| Clip {
            name: format!("16_{i:02}"),
            subject: "16".to_owned(),
            action: String::new(),
            motion: Motion::new(skeleton.clone(), 120.0, vec![0.0; frames]).unwrap(),
        };
        frames.iter().enumerate().map(clip).collect()
    }

    fn names(clips: &[Clip]) -> Vec<&str> {
        clips.iter().map(|c| c.name.as_str()).collect()
    }

    #[test]
    fn a_database_of_some_size_has_whole_clips_and_is_part_of_every_larger_one() {
        let mut all = clips(&[100; 20]);
        shuffle_by_name(&mut all);
        assert_ne!(names(&all), names(&clips(&[100; 20])), "mixed");
        let (small, small_poses) = first_clips(&all, 230);
        let (large, large_poses) = first_clips(&all, 500);
        assert_eq!((small.len(), small_poses, large.len(), large_poses), (5, 250, 10, 500));
        assert_eq!(names(small), names(&large[..5]));
        assert_eq!(first_clips(&all, usize::MAX), (&all[..], 1000));
    }

    #[test]
    fn the_order_does_not_depend_on_where_the_clips_came_from() {
        let (mut all, mut reversed) = (clips(&[100; 20]), clips(&[100; 20]));
        reversed.reverse();
        shuffle_by_name(&mut all);
        shuffle_by_name(&mut reversed);
        assert_eq!(names(&all), names(&reversed));
    }
}
