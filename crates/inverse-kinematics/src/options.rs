use crate::{Chain, Error, Result};

/// Something wanted of a chain, as rows of a linear system `J Δθ = Δx`.
#[derive(Debug, Clone, PartialEq)]
pub enum Task {
    /// these points reach their targets; those that were not measured are left out
    Reach(Vec<usize>),
    /// the overlap with the images rises by what a step along its gradient would give: one row, ∇h
    Overlap,
    /// all coordinates go to the preferred posture
    Posture,
}

/// What the null space of all tasks is used for: `Δθ += α P ∇H`, H = h (if `overlap`) − ½ `posture` |θ − posture|².
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Criterion {
    /// whether the overlap h with the images is raised
    pub overlap: bool,
    /// weight of the preferred posture, an inverse square radian; 0 is none
    pub posture: f64,
}

/// What is wanted, in which order, and how steps are taken.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// tasks, the most important level first; tasks of one level are solved together
    pub levels: Vec<Vec<Task>>,
    /// what remains of freedom
    pub criterion: Criterion,
    /// number of steps of a solve; the paper's is 15
    pub steps: usize,
    /// samples on a segment in each view
    pub samples: usize,
    /// first gain α of the overlap, radians² (h has no unit); it adapts to the curvature met
    pub gain: f64,
    /// largest gain α
    pub max_gain: f64,
    /// farthest that a target is targeted in one step, metres
    pub max_reach_m: f64,
    /// greatest change of a coordinate in one step, radians or metres
    pub max_change: f64,
    /// λ of the damped pseudoinverse at a singularity, metres a radian
    pub damping: f64,
    /// singular value below which damping sets in, metres a radian
    pub damped_below: f64,
}

impl Options {
    /// Plain inverse kinematics: `points` reach their targets.
    pub fn reach(points: &[usize]) -> Self {
        Self {
            levels: vec![vec![Task::Reach(points.to_vec())]],
            criterion: Criterion::default(),
            steps: 15,
            samples: 12,
            gain: 0.02,
            max_gain: 0.5,
            max_reach_m: 0.25,
            max_change: 0.35,
            damping: 0.05,
            damped_below: 0.05,
        }
    }

    /// Priority inverse kinematics: first the points, then the preferred posture.
    pub fn reach_then_posture(points: &[usize]) -> Self {
        let mut options = Self::reach(points);
        options.levels.push(vec![Task::Posture]);
        options
    }

    /// Image-constrained inverse kinematics as printed (mode a): the overlap is the criterion of the null space.
    pub fn image_constrained(points: &[usize]) -> Self {
        Self { criterion: Criterion { overlap: true, posture: 0.0 }, ..Self::reach(points) }
    }

    /// The image at the same level as the points (mode b): rows of one extended Jacobian.
    pub fn extended(points: &[usize]) -> Self {
        let levels = vec![vec![Task::Overlap, Task::Reach(points.to_vec())]];
        Self { levels, ..Self::reach(points) }
    }

    /// The image before the points (mode b, strictly).
    pub fn image_first(points: &[usize]) -> Self {
        let levels = vec![vec![Task::Overlap], vec![Task::Reach(points.to_vec())]];
        Self { levels, ..Self::reach(points) }
    }

    /// First the points, then the image, then the posture: three strict priorities (mode c).
    pub fn reach_then_image_then_posture(points: &[usize]) -> Self {
        let levels = vec![vec![Task::Reach(points.to_vec())], vec![Task::Overlap], vec![Task::Posture]];
        Self { levels, ..Self::reach(points) }
    }

    /// Whether images are looked at.
    pub fn uses_images(&self) -> bool {
        self.criterion.overlap || self.levels.iter().flatten().any(|task| *task == Task::Overlap)
    }

    /// Most rows of a level, for a chain.
    pub(crate) fn max_rows(&self, chain: &Chain) -> usize {
        let rows = |task: &Task| match task {
            Task::Reach(points) => 3 * points.len(),
            Task::Overlap => 1,
            Task::Posture => chain.num_dofs(),
        };
        self.levels.iter().map(|level| level.iter().map(rows).sum()).max().unwrap_or(0)
    }

    pub(crate) fn check(&self, chain: &Chain) -> Result<()> {
        let points = chain.points.len();
        for task in self.levels.iter().flatten() {
            if let Task::Reach(named) = task
                && let Some(&point) = named.iter().find(|&&point| point >= points)
            {
                return Err(Error::UnknownPoint { what: "a task", point, points });
            }
        }
        let positive = [
            ("gain", self.gain),
            ("max_gain", self.max_gain),
            ("max_reach_m", self.max_reach_m),
            ("max_change", self.max_change),
            ("damping", self.damping),
            ("damped_below", self.damped_below),
            ("samples", self.samples as f64),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Setting { name, value, expected: "a positive number" });
            }
        }
        let posture = self.criterion.posture;
        if !(posture >= 0.0 && posture.is_finite()) {
            return Err(Error::Setting { name: "posture", value: posture, expected: "0 or more" });
        }
        Ok(())
    }
}
