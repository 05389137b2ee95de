use motion_db::{Clip, MotionDatabase, SkeletonSize, WindowIndex, resample};

/// Windows of held-out motion that follow one another, as queries.
pub struct Run {
    /// shape `[frames, width]`, principal axes
    features: Vec<f32>,
    width: usize,
}

impl Run {
    /// The queries, in the order of time.
    pub fn queries(&self) -> impl ExactSizeIterator<Item = &[f32]> {
        self.features.chunks_exact(self.width)
    }

    /// The queries of up to `frames` frames from the middle of a clip; `None` if the clip is too short for any.
    pub fn from_clip(
        clip: &Clip,
        database: &MotionDatabase,
        index: &WindowIndex,
        frames: usize,
    ) -> Option<Self> {
        let dofs = database.num_dofs();
        let scale = database.leg_length() / SkeletonSize::leg_length(clip.motion.skeleton());
        let mut coordinates = resample(&clip.motion, database.parametrisation());
        for pose in coordinates.chunks_exact_mut(dofs) {
            pose[..3].iter_mut().for_each(|v| *v *= scale);
        }
        let poses: Vec<&[f64]> = coordinates.chunks_exact(dofs).collect();
        let window = index.window();
        let (possible, width) = (poses.len().checked_sub(window)?, index.width());
        let count = possible.min(frames);
        let first = window + (possible - count) / 2;
        let (mut scratch, mut out) = (vec![0.0; width], vec![0.0; width]);
        let mut features = Vec::with_capacity(count * width);
        for t in first..first + count {
            let newest_first: Vec<&[f64]> = (1..=window).map(|i| poses[t - i]).collect();
            index.query_features(&newest_first, &mut scratch, &mut out);
            features.extend(out.iter().map(|v| *v as f32));
        }
        (count > 0).then_some(Self { features, width })
    }
}
