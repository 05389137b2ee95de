use model::{PointTrajectories, Samples};
use posterior::Solution;

use crate::Parameters;

/// What was measured at a frame.
#[derive(Debug, Clone, Copy)]
pub struct Observed<'a> {
    pub now: Samples<'a>,
    /// all that was measured, and the index of the frame, where the frames around it join the search
    pub session: Option<(&'a PointTrajectories, usize)>,
}

/// What is known of the person at a frame: the last m poses, newest first, in world coordinates (metres, radians,
/// the performer's scale), and the rows that matched last.
#[derive(Debug, Clone)]
pub struct Track {
    pub history: Vec<Vec<f64>>,
    pub matches: Vec<usize>,
}

impl Track {
    /// Room for a track under `parameters`; it stands nowhere yet.
    pub fn blank(dofs: usize, parameters: &Parameters) -> Self {
        Self {
            history: vec![vec![0.0; dofs]; parameters.window],
            matches: Vec::with_capacity(parameters.neighbours),
        }
    }

    pub fn newest(&self) -> &[f64] {
        &self.history[0]
    }

    /// Becomes a copy of `other`, a track with as many poses, in the memory there is.
    pub fn copy_from(&mut self, other: &Self) {
        for (to, from) in self.history.iter_mut().zip(&other.history) {
            to.copy_from_slice(from);
        }
        self.matches.clone_from(&other.matches);
    }
}

/// One frame's outcome.
#[derive(Debug, Clone, Copy)]
pub struct Step {
    pub solution: Solution,
    /// coordinates that were measured, three a point
    pub measured: usize,
    /// distance of the nearest window, degrees and centimetres per root of the number of features
    pub neighbour_distance: f64,
}

impl Step {
    /// Energy per measured coordinate: about 1 when measurement and prediction agree within their uncertainties.
    pub fn energy(&self) -> f64 {
        if self.measured == 0 {
            return 0.0;
        }
        (self.solution.likelihood_energy + self.solution.prior_energy) / self.measured as f64
    }
}
