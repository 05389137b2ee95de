/// How much of an error stays from one frame to the next where nothing is measured. With it, joints that no point sees
/// are as uncertain as they are, and uncertainty grows over a gap (tuned on every third trial of five-actions).
const RETAINED: f64 = 0.98;
/// What the model leaves out: neighbours that are all alike, points that hang from a skeleton (tuned likewise).
const SCALE: f64 = 0.55;

/// Variance of every coordinate, carried from frame to frame.
///
/// A frame's own posterior (see [`posterior::MapSolver::standard_deviations`]) takes the poses before it as known. What is
/// uncertain of them is carried on here, coordinate by coordinate: `P ← r (ρ² P + Σ)`, with the prior's variance Σ and the
/// share r of it that the measurements leave.
#[derive(Debug, Clone)]
pub struct Uncertainty {
    variances: Vec<f64>,
    /// of what does not change: the performer's zero pose
    constant: Vec<f64>,
    is_new: bool,
}

impl Uncertainty {
    /// Before the first frame. `constant`: variance of the zero pose, radians², shape `[dofs]`.
    pub fn new(constant: &[f64]) -> Self {
        Self { variances: vec![0.0; constant.len()], constant: constant.to_vec(), is_new: true }
    }

    /// Forgets the frames before: the pose was found anew.
    pub fn restart(&mut self) {
        self.is_new = true;
    }

    /// Variances of every coordinate, shape `[dofs]`; `None` before the first frame.
    pub fn variances(&self) -> Option<&[f64]> {
        (!self.is_new).then_some(&self.variances)
    }

    /// Goes on from [`Self::variances`] that were given out, of as many coordinates.
    pub fn resume(&mut self, variances: Option<&[f64]>) {
        self.is_new = variances.is_none();
        if let Some(variances) = variances {
            self.variances.copy_from_slice(variances);
        }
    }

    /// Takes in a frame, whose prior variance of coordinate d is `prior(d)`; `sigmas` holds the standard deviations of its
    /// posterior and receives those with what was uncertain before, shape `[dofs]`.
    pub fn update(&mut self, prior: impl Fn(usize) -> f64, sigmas: &mut [f64]) {
        for (d, sigma) in sigmas.iter_mut().enumerate() {
            let own = prior(d).max(1e-300);
            let left = (*sigma * *sigma / own).min(1.0);
            let before = if self.is_new { own / (1.0 - RETAINED * RETAINED) } else { self.variances[d] };
            // Where a person stands and which way they face is known from the frame before only: nothing of it is forgotten.
            let retained = if matches!(d, 0 | 2 | kinematics::HEADING) { 1.0 } else { RETAINED * RETAINED };
            self.variances[d] = left * (retained * before + own);
            *sigma = (SCALE * SCALE * self.variances[d] + self.constant[d]).sqrt();
        }
        self.is_new = false;
    }
}
