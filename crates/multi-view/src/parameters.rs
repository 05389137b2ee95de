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
    /// frames from one of these to the next
    pub shape_step: usize,
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
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            first_frame: 0,
            num_frames: None,
            shape_frames: 1,
            shape_step: 10,
            largest_side: 2048,
            leave_out_bad_view: true,
            least_overlap: 0.72,
            hull_voxel_m: 0.01,
            background: background::Parameters::default(),
        }
    }
}

impl Parameters {
    /// Checks that every number is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] or [`Error::Background`] names the first that isn't.
    pub fn check(&self) -> Result<()> {
        let whole = [
            ("first_frame", self.first_frame, 0..=10_000_000, "0 to 10000000"),
            ("num_frames", self.num_frames.unwrap_or(1), 1..=10_000_000, "1 to 10000000"),
            ("shape_frames", self.shape_frames, 1..=16, "1 to 16"),
            ("shape_step", self.shape_step, 1..=10_000, "1 to 10000"),
            ("largest_side", self.largest_side as usize, 64..=8192, "64 to 8192 pixels"),
        ];
        for (name, found, range, expected) in whole {
            if !range.contains(&found) {
                return Err(Error::Parameter { name, found: found.to_string(), expected });
            }
        }
        if !(0.002..=0.1).contains(&self.hull_voxel_m) {
            let found = self.hull_voxel_m.to_string();
            return Err(Error::Parameter { name: "hull_voxel_m", found, expected: "0.002 to 0.1 metres" });
        }
        if !(0.3..=1.0).contains(&self.least_overlap) {
            let found = self.least_overlap.to_string();
            return Err(Error::Parameter { name: "least_overlap", found, expected: "0.3 to 1" });
        }
        Ok(self.background.check()?)
    }

    /// The frames that pose and shape are found from, at most those before `end`.
    pub fn frames_of_shape(&self, end: usize) -> Vec<usize> {
        (0..self.shape_frames)
            .map(|index| self.first_frame + index * self.shape_step)
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
        let bad = Parameters { hull_voxel_m: f64::NAN, ..Parameters::default() };
        assert!(bad.check().is_err());
    }

    #[test]
    fn frames_of_the_shape_end_with_the_clip() {
        let parameters = Parameters { first_frame: 5, shape_frames: 3, ..Parameters::default() };
        assert_eq!(parameters.frames_of_shape(100), [5, 15, 25]);
        assert_eq!(parameters.frames_of_shape(16), [5, 15]);
    }
}
