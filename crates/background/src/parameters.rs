use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// Which background model is used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// the plate if there is one, else adaptive
    #[default]
    Auto,
    /// a picture of the scene without the person
    Plate,
    /// one colour and its spread a pixel, learned from the clip
    Adaptive,
    /// several colours a pixel, for backgrounds that move
    Mixture,
}

/// How silhouettes are made. All fields have defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// which model
    pub model: ModelKind,
    /// frames of the clip that a model is learned from, 3 to 64
    pub sample_frames: usize,
    /// share of background pixels that are to be found as such; it sets the thresholds
    pub detection_rate: f64,
    /// smallest standard deviation of a colour channel, grey levels
    pub noise_floor: f64,
    /// the darkest that a shadow makes the background, share of its brightness; what is darker is the person
    pub darkest_shadow: f64,
    /// the brightest that light makes the background, times its brightness; what is brighter is the person
    pub brightest_highlight: f64,
    /// share of a background pixel's new colour that the model takes over at each frame
    pub update_rate: f64,
    /// whether the frame's overall gain is measured and taken out (automatic exposure and white balance)
    pub follow_gain: bool,
    /// how far a plate is looked for off its place, pixels
    pub max_shift: u32,
    /// how far a plate may be off its place after alignment, pixels; widens the tolerance at edges
    pub edge_tolerance: f64,
    /// of the mixture
    pub mixture: MixtureParameters,
    /// of the cleaning
    pub cleaning: CleaningParameters,
}

/// Parameters of the Gaussian mixture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MixtureParameters {
    /// squared distance from a mode, in variances, up to which a colour belongs to the background
    pub threshold: f64,
    /// weight that the modes of the background have together; the rest is for the person, who may be at one spot for no
    /// more than this is below 1
    pub background_weight: f64,
    /// variance of a new mode, grey levels squared
    pub first_variance: f64,
}

/// Parameters of the cleaning. Lengths are shares of the picture's diagonal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CleaningParameters {
    /// specks up to twice this wide are removed, pixels
    pub opening: u32,
    /// gaps up to twice this wide are closed, pixels
    pub closing: u32,
    /// holes up to this share of the person's area are filled
    pub largest_hole: f64,
    /// pieces nearer than this to the person are parts of it
    pub join_distance: f64,
    /// pieces smaller than this share of the person are not joined
    pub smallest_piece: f64,
    /// a region is the person of the frame before if it shares at least this much of that one's area
    pub continuity: f64,
    /// silhouettes smaller than this share of the picture are not a person
    pub smallest_person: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            model: ModelKind::Auto,
            sample_frames: 24,
            detection_rate: 0.999,
            noise_floor: 1.5,
            darkest_shadow: 0.65,
            brightest_highlight: 1.2,
            update_rate: 0.002,
            follow_gain: true,
            max_shift: 12,
            edge_tolerance: 0.2,
            mixture: MixtureParameters::default(),
            cleaning: CleaningParameters::default(),
        }
    }
}

impl Default for MixtureParameters {
    fn default() -> Self {
        Self { threshold: 16.0, background_weight: 0.7, first_variance: 15.0 }
    }
}

impl Default for CleaningParameters {
    fn default() -> Self {
        Self {
            opening: 1,
            closing: 3,
            largest_hole: 0.004,
            join_distance: 0.016,
            smallest_piece: 0.004,
            continuity: 0.2,
            smallest_person: 0.001,
        }
    }
}

impl Parameters {
    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] names the first that isn't.
    pub fn check(&self) -> Result<()> {
        let (mixture, cleaning) = (&self.mixture, &self.cleaning);
        let ranges = [
            ("sample_frames", self.sample_frames as f64, 3.0, 64.0),
            ("detection_rate", self.detection_rate, 0.9, 0.999_999_9),
            ("noise_floor", self.noise_floor, 0.1, 50.0),
            ("darkest_shadow", self.darkest_shadow, 0.0, 1.0),
            ("brightest_highlight", self.brightest_highlight, 1.0, 10.0),
            ("update_rate", self.update_rate, 0.0, 0.5),
            ("max_shift", f64::from(self.max_shift), 0.0, 64.0),
            ("edge_tolerance", self.edge_tolerance, 0.0, 4.0),
            ("mixture.threshold", mixture.threshold, 1.0, 1000.0),
            ("mixture.background_weight", mixture.background_weight, 0.1, 1.0),
            ("mixture.first_variance", mixture.first_variance, 1.0, 5000.0),
            ("cleaning.opening", f64::from(cleaning.opening), 0.0, 32.0),
            ("cleaning.closing", f64::from(cleaning.closing), 0.0, 32.0),
            ("cleaning.largest_hole", cleaning.largest_hole, 0.0, 1.0),
            ("cleaning.join_distance", cleaning.join_distance, 0.0, 0.1),
            ("cleaning.smallest_piece", cleaning.smallest_piece, 0.0, 1.0),
            ("cleaning.continuity", cleaning.continuity, 0.0, 1.0),
            ("cleaning.smallest_person", cleaning.smallest_person, 0.0, 1.0),
        ];
        match ranges.into_iter().find(|&(_, found, low, high)| !(found >= low && found <= high)) {
            Some((name, found, low, high)) => Err(Error::Parameter { name, found, low, high }),
            None => Ok(()),
        }
    }
}
