use kinematics::State;
use nalgebra::Vector3;

use crate::gain::Gain;
use crate::{Chain, Error, ImageView, Options, Overlap, Priorities, Result, Task};

/// What was measured in a frame.
#[derive(Debug, Clone, Copy)]
pub struct Evidence<'a> {
    /// where the chain's points are, metres, in the world; `None` where not measured; shape `[points]`
    pub targets: &'a [Option<Vector3<f64>>],
    /// cameras and silhouettes, any number
    pub views: &'a [ImageView],
    /// the preferred posture, metres and radians, shape `[dofs]`
    pub posture: &'a [f64],
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// steps taken
    pub steps: usize,
    /// greatest distance of a targeted point from its target, metres
    pub residual_m: f64,
    /// overlap h with the images, in [−1, 1]; 0 without images
    pub overlap: f64,
    /// coordinates that a limit stopped in the last step
    pub limited: usize,
}

/// Inverse kinematics of one chain. Made once; solving takes no memory.
///
/// A coordinate that a step would take past its limit is put on the limit and taken out, and all levels are solved again
/// with what is left, as often as another one meets its limit: the others make up for it (Baerlocher and Boulic 2004,
/// section 5; docs/papers.md#image-constrained-inverse-kinematics).
#[derive(Debug, Clone)]
pub struct Solver {
    chain: Chain,
    options: Options,
    state: State,
    positions: Vec<Vector3<f64>>,
    /// of all points, shape `[3·points, dofs]`
    jacobian: Vec<f64>,
    overlap: Overlap,
    /// ∇h, shape `[dofs]`
    gradient: Vec<f64>,
    gain: Gain,
    priorities: Priorities,
    /// coordinates that are neither locked nor stopped, in rising order
    free: Vec<usize>,
    /// change of all coordinates, shape `[dofs]`
    change: Vec<f64>,
    /// of the free coordinates: rows of one level, what they want, the change, a direction and its free part
    rows: Vec<f64>,
    wanted: Vec<f64>,
    free_change: Vec<f64>,
    direction: Vec<f64>,
    projected: Vec<f64>,
}

impl Solver {
    /// Makes all memory for a chain.
    ///
    /// # Errors
    /// [`Error::UnknownPoint`] or [`Error::Setting`] if the options don't fit the chain.
    pub fn new(chain: Chain, options: Options) -> Result<Self> {
        options.check(&chain)?;
        let (dofs, points) = (chain.num_dofs(), chain.points.len());
        let rows = options.max_rows(&chain);
        Ok(Self {
            state: chain.kinematics.state(),
            positions: vec![Vector3::zeros(); points],
            jacobian: vec![0.0; 3 * points * dofs],
            overlap: Overlap::new(&chain, options.samples),
            gradient: vec![0.0; dofs],
            gain: Gain::new(dofs, options.gain, options.max_gain),
            priorities: Priorities::new(dofs, rows, options.damping, options.damped_below),
            free: Vec::with_capacity(dofs),
            change: vec![0.0; dofs],
            rows: vec![0.0; rows * dofs],
            wanted: vec![0.0; rows],
            free_change: vec![0.0; dofs],
            direction: vec![0.0; dofs],
            projected: vec![0.0; dofs],
            chain,
            options,
        })
    }

    /// The chain.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Positions of the points after the last solve, metres, shape `[points]`.
    pub fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// The criterion at the coordinates that the last solve found: H = h − ½ w |θ − posture|².
    pub fn criterion(&self, x: &[f64], evidence: &Evidence<'_>) -> f64 {
        let limits = self.chain.limits.iter();
        let off = limits
            .zip(x.iter().zip(evidence.posture))
            .map(|([low, high], (x, posture))| if low < high { (x - posture) * (x - posture) } else { 0.0 });
        self.overlap.value - 0.5 * self.options.criterion.posture * off.sum::<f64>()
    }

    /// Moves `x` (metres and radians, shape `[dofs]`), usually the solution of the frame before, to what is wanted.
    ///
    /// # Errors
    /// [`Error::Count`] or [`Error::NotFinite`] if the coordinates or the evidence don't fit the chain.
    pub fn solve(&mut self, x: &mut [f64], evidence: &Evidence<'_>) -> Result<Outcome> {
        self.check(x, evidence)?;
        self.gain.restart();
        let mut outcome = Outcome { steps: 0, residual_m: 0.0, overlap: 0.0, limited: 0 };
        while outcome.steps < self.options.steps {
            self.look(x, evidence, true);
            outcome.limited = self.find_change(x, evidence);
            outcome.steps += 1;
            let greatest = self.change.iter().fold(0.0f64, |greatest, v| greatest.max(v.abs()));
            let share = (self.options.max_change / greatest).min(1.0);
            dense::add_scaled(x, share, &self.change);
            if greatest < 1e-10 {
                break;
            }
        }
        self.look(x, evidence, false);
        outcome.overlap = self.overlap.value;
        outcome.residual_m = self.residual(evidence);
        Ok(outcome)
    }

    fn check(&self, x: &[f64], evidence: &Evidence<'_>) -> Result<()> {
        let (dofs, points) = (self.chain.num_dofs(), self.chain.points.len());
        let counts = [
            ("coordinates", x.len(), dofs),
            ("numbers of the preferred posture", evidence.posture.len(), dofs),
            ("targets", evidence.targets.len(), points),
        ];
        for (what, found, expected) in counts {
            if found != expected {
                return Err(Error::Count { what, found, expected });
            }
        }
        let numbers = x.iter().enumerate().chain(evidence.posture.iter().enumerate());
        match numbers.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((dof, &value)) => Err(Error::NotFinite { dof, value }),
            None => Ok(()),
        }
    }

    /// Positions and overlap at `x`, and their derivatives where a step follows.
    fn look(&mut self, x: &[f64], evidence: &Evidence<'_>, with_derivatives: bool) {
        let Chain { kinematics, points, segments, .. } = &self.chain;
        points.positions(kinematics, x, &mut self.state, &mut self.positions);
        if with_derivatives {
            points.jacobian(kinematics, &self.state, &self.positions, &mut self.jacobian);
        }
        if !evidence.views.is_empty() && self.options.uses_images() {
            self.overlap.update(segments, &self.positions, evidence.views);
            if with_derivatives {
                self.overlap.gradient(&self.jacobian, &mut self.gradient);
            }
        } else {
            self.overlap.value = 0.0;
            self.gradient.fill(0.0);
        }
    }

    /// Fills in `self.change`; returns how many coordinates a limit stopped.
    fn find_change(&mut self, x: &[f64], evidence: &Evidence<'_>) -> usize {
        self.change.fill(0.0);
        self.free.clear();
        let limits = &self.chain.limits;
        self.free.extend((0..x.len()).filter(|&dof| limits[dof][0] < limits[dof][1]));
        self.gain.measure();
        let mut stopped = 0;
        loop {
            self.solve_levels(x, evidence);
            for (&dof, &change) in self.free.iter().zip(&self.free_change) {
                self.change[dof] = change;
            }
            let change = &mut self.change;
            let before = self.free.len();
            self.free.retain(|&dof| {
                let [low, high] = self.chain.limits[dof];
                let after = x[dof] + change[dof];
                let is_within = (low..=high).contains(&after);
                if !is_within {
                    change[dof] = after.clamp(low, high) - x[dof];
                }
                is_within
            });
            if self.free.len() == before {
                return stopped;
            }
            stopped += before - self.free.len();
        }
    }

    /// All levels and the criterion, over the free coordinates, into `self.free_change`.
    fn solve_levels(&mut self, x: &[f64], evidence: &Evidence<'_>) {
        let count = self.free.len();
        self.priorities.start(count);
        self.free_change.fill(0.0);
        let levels = std::mem::take(&mut self.options.levels);
        for level in &levels {
            let mut rows = 0;
            for task in level {
                rows = self.add_task(task, rows, x, evidence);
            }
            let (jacobian, wanted) = (&self.rows[..rows * count], &self.wanted[..rows]);
            self.priorities.add_level(jacobian, wanted, &mut self.free_change);
        }
        self.options.levels = levels;
        let criterion = self.options.criterion;
        if !criterion.overlap && criterion.posture == 0.0 {
            return;
        }
        for (direction, &dof) in self.direction.iter_mut().zip(&self.free) {
            let overlap = if criterion.overlap { self.gradient[dof] } else { 0.0 };
            *direction = overlap - criterion.posture * (x[dof] - evidence.posture[dof]);
        }
        self.priorities.project(&self.direction[..count], &mut self.projected);
        let gain = self.gain.choose(&self.free, &self.projected[..count]);
        dense::add_scaled(&mut self.free_change[..count], gain, &self.projected[..count]);
    }

    /// Writes the rows of a task behind the first `rows`; returns how many there are then.
    fn add_task(&mut self, task: &Task, mut rows: usize, x: &[f64], evidence: &Evidence<'_>) -> usize {
        let (count, dofs) = (self.free.len(), x.len());
        match task {
            Task::Reach(points) => {
                for &point in points {
                    let Some(target) = evidence.targets[point].filter(is_finite) else { continue };
                    let miss = target - self.positions[point];
                    let wanted = miss * (self.options.max_reach_m / miss.norm()).min(1.0);
                    for axis in 0..3 {
                        let all = &self.jacobian[(3 * point + axis) * dofs..(3 * point + axis + 1) * dofs];
                        // what the stopped coordinates do already; those that are free are 0 here or overwritten
                        let mut done = dense::inner_product(all, &self.change);
                        let out = &mut self.rows[rows * count..(rows + 1) * count];
                        for (out, &dof) in out.iter_mut().zip(&self.free) {
                            *out = all[dof];
                            done -= all[dof] * self.change[dof];
                        }
                        self.wanted[rows] = wanted[axis] - done;
                        rows += 1;
                    }
                }
            }
            Task::Overlap => {
                for (direction, &dof) in self.direction.iter_mut().zip(&self.free) {
                    *direction = self.gradient[dof];
                }
                let direction = &self.direction[..count];
                self.priorities.project(direction, &mut self.projected);
                let projected = &self.projected[..count];
                let slope = dense::inner_product(projected, projected);
                // without a slope there is nothing to want
                if slope > 1e-12 {
                    let gain = self.gain.choose(&self.free, projected);
                    let done = dense::inner_product(direction, &self.free_change[..count]);
                    self.rows[rows * count..(rows + 1) * count].copy_from_slice(direction);
                    self.wanted[rows] = gain * slope + done;
                    rows += 1;
                }
            }
            Task::Posture => {
                for (place, &dof) in self.free.iter().enumerate() {
                    let out = &mut self.rows[rows * count..(rows + 1) * count];
                    out.fill(0.0);
                    out[place] = 1.0;
                    self.wanted[rows] = evidence.posture[dof] - x[dof];
                    rows += 1;
                }
            }
        }
        rows
    }

    fn residual(&self, evidence: &Evidence<'_>) -> f64 {
        let targeted = self.options.levels.iter().flatten().filter_map(|task| match task {
            Task::Reach(points) => Some(points),
            _ => None,
        });
        let misses = targeted.flatten().filter_map(|&point| {
            let target = evidence.targets[point].filter(is_finite)?;
            Some((target - self.positions[point]).norm())
        });
        misses.fold(0.0, f64::max)
    }
}

fn is_finite(point: &Vector3<f64>) -> bool {
    point.iter().all(|v| v.is_finite())
}
