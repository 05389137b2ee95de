use serde::{Deserialize, Serialize};

use crate::Options;

/// The methods that runs and calls choose from, by name.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// end effectors alone: what is free stays as it was
    Plain,
    /// end effectors, then a neutral posture
    Priority,
    /// end effectors; images in their null space, as printed (mode a), with a little of the posture
    #[default]
    ImageConstrained,
    /// images and end effectors in one Jacobian (mode b)
    Extended,
    /// images before end effectors (mode b, strictly)
    ImageFirst,
    /// end effectors, images, posture: three strict priorities (mode c)
    ReachThenImageThenPosture,
}

/// Weight of the posture beside the overlap, an inverse square radian. Tuned on trials 13_17 and 07_01 of the CMU database.
const POSTURE: f64 = 0.8;

impl Method {
    /// Whether images are looked at.
    pub fn uses_images(self) -> bool {
        !matches!(self, Self::Plain | Self::Priority)
    }

    /// How it is solved, with these points as end effectors.
    pub fn options(self, points: &[usize]) -> Options {
        match self {
            Self::Plain => Options::reach(points),
            Self::Priority => Options::reach_then_posture(points),
            Self::ImageConstrained => {
                let mut options = Options::image_constrained(points);
                options.criterion.posture = POSTURE;
                options
            }
            Self::Extended => Options::extended(points),
            Self::ImageFirst => Options::image_first(points),
            Self::ReachThenImageThenPosture => Options::reach_then_image_then_posture(points),
        }
    }
}
