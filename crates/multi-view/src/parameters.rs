use model::shown;
use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// What decides the result of a run on several cameras. All fields have defaults.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameters {
    /// first frame that is looked at, from 0; pose and shape are found in it
    pub first_frame: usize,
    /// how many frames silhouettes are made of, from `first_frame`; `None`: all
    pub num_frames: Option<usize>,
    /// frames that pose and shape are found from, together: more sharpen the shape
    pub shape_frames: usize,
    /// frames from one of these to the next; `None`: spread over the session
    pub shape_step: Option<usize>,
    /// videos whose longer side has more pixels are read smaller
    pub largest_side: u32,
    /// a view that disagrees with all others is left out, rather than ending the run
    pub leave_out_bad_view: bool,
    /// a body that covers less of the silhouettes (mean intersection over union) is a failure
    pub least_overlap: f64,
    /// width of the smallest cubes of the visual hull, metres
    pub hull_voxel_m: f64,
    /// how silhouettes are told from the background
    pub background: background::Parameters,
    /// the person is followed through all frames; otherwise they are found in the first ones only
    pub track: bool,
    /// frames a second, where no video tells, or tells it wrong
    pub frame_rate: Option<f64>,
    /// frames that are tracked in one piece; each piece begins with a key frame of its own
    pub chunk_frames: usize,
    /// frames that a piece goes on into the next, over which poses go from one to the other
    pub overlap_frames: usize,
    /// particles of the search for what is misaligned; 0: local optimisation alone
    pub particles: usize,
    /// iterations of that search
    pub iterations: usize,
    /// known poses guide that search
    pub prior: bool,
    /// pictures are searched for points that can be followed; nothing comes of it where there are only masks
    pub texture: bool,
    /// what the random numbers of that search come from
    pub seed: u64,
    /// a video of every camera with the body's outline
    pub overlay: bool,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            first_frame: 0,
            num_frames: None,
            shape_frames: 1,
            shape_step: None,
            largest_side: 2048,
            leave_out_bad_view: true,
            least_overlap: 0.72,
            hull_voxel_m: 0.01,
            background: background::Parameters::default(),
            track: true,
            frame_rate: None,
            chunk_frames: 150,
            overlap_frames: 10,
            particles: 25,
            iterations: 10,
            prior: true,
            texture: true,
            seed: 0,
            overlay: true,
        }
    }
}

impl Parameters {
    /// The fields that decide the silhouettes. All others are of what comes after them.
    pub const OF_SILHOUETTES: [&str; 4] = ["first_frame", "num_frames", "largest_side", "background"];

    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Background`] names the first that isn't.
    pub fn check(&self) -> Result<()> {
        let whole = [
            ("first_frame", self.first_frame, 0..=10_000_000, "0 to 10000000"),
            ("num_frames", self.num_frames.unwrap_or(1), 1..=10_000_000, "1 to 10000000"),
            ("shape_frames", self.shape_frames, 1..=16, "1 to 16"),
            ("shape_step", self.shape_step.unwrap_or(1), 1..=10_000, "1 to 10000"),
            ("largest_side", self.largest_side as usize, 64..=8192, "64 to 8192 pixels"),
            ("chunk_frames", self.chunk_frames, 5..=3000, "5 to 3000 frames"),
            ("overlap_frames", self.overlap_frames, 0..=300, "0 to 300 frames"),
            ("particles", self.particles, 0..=2000, "2 to 2000, or 0 for none"),
            ("iterations", self.iterations, 1..=200, "1 to 200"),
        ];
        for (name, found, range, expected) in whole {
            if !range.contains(&found) {
                return Err(Error::Parameter { name, found: found.to_string(), expected });
            }
        }
        if self.particles == 1 {
            let expected = "2 to 2000, or 0 for none";
            return Err(Error::Parameter { name: "particles", found: "1".into(), expected });
        }
        if self.overlap_frames >= self.chunk_frames {
            let found = self.overlap_frames.to_string();
            return Err(Error::Parameter {
                name: "overlap_frames",
                found,
                expected: "less than chunk_frames",
            });
        }
        if let Some(rate) = self.frame_rate.filter(|rate| !(1.0..=1000.0).contains(rate)) {
            let found = shown(rate);
            return Err(Error::Parameter {
                name: "frame_rate",
                found,
                expected: "1 to 1000 frames a second",
            });
        }
        if !(0.002..=0.1).contains(&self.hull_voxel_m) {
            let found = shown(self.hull_voxel_m);
            return Err(Error::Parameter { name: "hull_voxel_m", found, expected: "0.002 to 0.1 metres" });
        }
        if !(0.3..=1.0).contains(&self.least_overlap) {
            let found = shown(self.least_overlap);
            return Err(Error::Parameter { name: "least_overlap", found, expected: "0.3 to 1" });
        }
        Ok(self.background.check()?)
    }

    /// The frames that pose and shape are found from, at most those before `end`.
    pub fn shape_fit_frames(&self, end: usize) -> Vec<usize> {
        let spread = end.saturating_sub(self.first_frame) / self.shape_frames;
        let step = self.shape_step.unwrap_or(spread).max(1);
        (0..self.shape_frames)
            .map(|index| self.first_frame + index * step)
            .take_while(|&frame| frame < end)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_in_range_and_a_number_that_is_not_is_named() {
        Parameters::default().check().unwrap();
        let bad = Parameters { shape_frames: 0, ..Parameters::default() };
        assert_eq!(bad.check().unwrap_err().to_string(), "shape_frames is 0, expected 1 to 16");
        let bad = Parameters { overlap_frames: 150, ..Parameters::default() };
        assert_eq!(
            bad.check().unwrap_err().to_string(),
            "overlap_frames is 150, expected less than chunk_frames"
        );
        assert!(Parameters { particles: 1, ..Parameters::default() }.check().is_err());
        Parameters { particles: 0, ..Parameters::default() }.check().unwrap();
        assert!(Parameters { frame_rate: Some(0.0), ..Parameters::default() }.check().is_err());
        let bad = Parameters { hull_voxel_m: f64::NAN, ..Parameters::default() };
        assert!(bad.check().is_err());
    }

    #[test]
    fn shape_fit_frames_end_with_the_clip() {
        let spread = Parameters { first_frame: 5, shape_frames: 3, ..Parameters::default() };
        assert_eq!(spread.shape_fit_frames(305), [5, 105, 205]);
        assert_eq!(spread.shape_fit_frames(7), [5, 6]);
        let parameters = Parameters { shape_step: Some(10), ..spread };
        assert_eq!(parameters.shape_fit_frames(100), [5, 15, 25]);
        assert_eq!(parameters.shape_fit_frames(16), [5, 15]);
    }
}
