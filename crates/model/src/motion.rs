use std::sync::Arc;

use crate::{Error, Result, Skeleton};

/// A motion: one pose per frame on one skeleton.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    skeleton: Arc<Skeleton>,
    frame_rate: f64,
    values: Vec<f64>,
}

impl Motion {
    /// `values`: channel values in the order of the skeleton's DOFs, metres and radians, row-major, shape
    /// `[frames, dofs]`; `frame_rate` in frames per second.
    ///
    /// # Errors
    /// If the number of values is not a multiple of the number of DOFs, the rate is not positive, or a value is
    /// not finite.
    pub fn new(skeleton: Arc<Skeleton>, frame_rate: f64, values: Vec<f64>) -> Result<Self> {
        let dofs = skeleton.num_dofs();
        if dofs == 0 || !values.len().is_multiple_of(dofs) {
            return Err(Error::ValueCount { values: values.len(), dofs });
        }
        if !(frame_rate.is_finite() && frame_rate > 0.0) {
            return Err(Error::FrameRate { found: frame_rate });
        }
        if let Some(bad) = values.iter().position(|v| !v.is_finite()) {
            let (joint, channel) =
                skeleton.channels().nth(bad % dofs).map(|(j, c)| (j, c.to_string())).unwrap_or_default();
            return Err(Error::NotFiniteValue {
                frame: bad / dofs,
                joint: skeleton.joints()[joint].name.clone(),
                channel,
                found: values[bad],
            });
        }
        Ok(Self { skeleton, frame_rate, values })
    }

    /// The skeleton.
    pub fn skeleton(&self) -> &Arc<Skeleton> {
        &self.skeleton
    }

    /// Frames per second.
    pub fn frame_rate(&self) -> f64 {
        self.frame_rate
    }

    /// Number of frames.
    pub fn num_frames(&self) -> usize {
        self.values.len() / self.skeleton.num_dofs()
    }

    /// The pose of a frame: one number per DOF, metres and radians, shape `[dofs]`.
    pub fn pose(&self, frame: usize) -> &[f64] {
        let dofs = self.skeleton.num_dofs();
        &self.values[frame * dofs..(frame + 1) * dofs]
    }

    /// All poses in order of time.
    pub fn poses(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.values.chunks_exact(self.skeleton.num_dofs())
    }

    /// All values, row-major, shape `[frames, dofs]`.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}
