use std::sync::{Arc, LazyLock};

use model::Skeleton;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::basis::Basis;
use crate::body::Body;
use crate::features::CHANNELS;
use crate::{Action, Result};

/// A statistical model of motion. It holds no recorded trial: only means and principal components.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    pub(crate) body: Body,
    /// rotation vectors about which the joints' rotation vectors are taken, radians, shape `[joints]`
    pub(crate) references: Vec<Vector3<f64>>,
    /// height of the balls of the feet above the floor when standing, metres
    pub(crate) ball_m: f64,
    /// trials learned from
    pub(crate) motions: usize,
    pub(crate) movements: Vec<Movement>,
}

/// One kind of segment (a walking cycle, a jump, a left punch): mean, styles between trials, variation within.
///
/// A segment is a list of *numbers*: logarithms of the durations between its marks (seconds), then the
/// coefficients of each channel in `shape.basis`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Movement {
    pub shape: MovementShape,
    pub mean: Quantised,
    /// one deviation of each style component; components of the same index of an action's movements belong together
    pub style: Vec<Quantised>,
    /// one deviation of each component of the variation from segment to segment
    pub variation: Vec<Quantised>,
}

/// A movement as the file's header describes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MovementShape {
    pub action: Action,
    pub name: String,
    pub basis: Basis,
    /// phases of the marks, from 0 to 1
    pub phases: Vec<f64>,
    /// how often it is done among the action's movements, sums to 1
    pub share: f64,
    /// shortest and longest pause after it, seconds
    pub pause_secs: (f64, f64),
    /// correlation of the variation from one segment to the next, one per variation component
    pub persistence: Vec<f64>,
    /// lowest and highest value of each channel that was seen, shape `[CHANNELS]`
    pub ranges: Vec<(f64, f64)>,
    /// number of segments and of groups (trials, or blocks of long trials) learned from
    pub segments: usize,
    pub groups: usize,
}

impl MovementShape {
    /// Number of durations.
    pub fn num_durations(&self) -> usize {
        self.phases.len().saturating_sub(1)
    }

    /// Numbers that describe a segment.
    pub fn num_numbers(&self) -> usize {
        self.num_durations() + CHANNELS * self.basis.len()
    }
}

/// Numbers in 16 bits each, with a common scale.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Quantised {
    pub scale: f32,
    pub steps: Vec<i16>,
}

impl Quantised {
    pub fn new(numbers: &[f64]) -> Self {
        let largest = numbers.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let scale = ((largest / f64::from(i16::MAX)) as f32).max(f32::MIN_POSITIVE);
        let step = |v: &f64| (v / f64::from(scale)).round().clamp(-32767.0, 32767.0) as i16;
        Self { scale, steps: numbers.iter().map(step).collect() }
    }

    /// Adds `factor` times the numbers to `sum`.
    pub fn add_to(&self, sum: &mut [f64], factor: f64) {
        let factor = factor * f64::from(self.scale);
        sum.iter_mut().zip(&self.steps).for_each(|(s, &q)| *s += factor * f64::from(q));
    }
}

/// What a movement of a model was learned from.
#[derive(Debug, Clone, PartialEq)]
pub struct MovementSummary {
    /// the action it belongs to
    pub action: Action,
    /// its name
    pub name: String,
    /// cycles or events learned from
    pub segments: usize,
    /// trials (or blocks of long trials) they came from
    pub groups: usize,
    /// numbers that describe one segment
    pub numbers: usize,
    /// components of style between trials
    pub style_components: usize,
    /// components of variation within a trial
    pub variation_components: usize,
}

static BUNDLED: LazyLock<Model> = LazyLock::new(|| {
    // A test draws from it, so a build whose file does not read cannot pass.
    Model::from_bytes(include_bytes!("../data/cmu.motion-model"))
        .expect("the bundled model is read by its tests")
});

impl Model {
    /// The model that comes with the program, learned from the CMU trials.
    pub fn bundled() -> &'static Self {
        &BUNDLED
    }

    /// A skeleton with the joints and channels of the CMU skeletons, its bone lengths drawn by seed.
    ///
    /// # Errors
    /// Only if the model's file was made by hand: [`crate::Error::Model`].
    pub fn skeleton(&self, subject: u64) -> Result<Arc<Skeleton>> {
        self.body.draw(subject)
    }

    /// What each movement was learned from.
    pub fn summary(&self) -> Vec<MovementSummary> {
        let summary = |m: &Movement| MovementSummary {
            action: m.shape.action,
            name: m.shape.name.clone(),
            segments: m.shape.segments,
            groups: m.shape.groups,
            numbers: m.shape.num_numbers(),
            style_components: m.style.len(),
            variation_components: m.variation.len(),
        };
        self.movements.iter().map(summary).collect()
    }
}
