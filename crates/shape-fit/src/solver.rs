//! Levenberg–Marquardt over the poses of all frames and their one shape, with new correspondences at every step.

use body::BodyModel;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use vision::Topology;

use crate::{
    Options,
    contour_term::{PosedBody, Quadratic, Scratch, Term, Weighting},
    observation::Observation,
    prior_term::{add_pose, add_shape},
};

/// The unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// shape `[frames][dofs]`
    pub poses: Vec<Vec<f64>>,
    /// shape `[components]`
    pub alpha: Vec<f64>,
}

/// One step from coarse to fine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// resolution: index of the observation's level
    pub level: usize,
    pub weighting: Weighting,
    /// first coefficients of the shape that may change
    pub components: usize,
    /// most evaluations
    pub evaluations: usize,
}

/// The body to be found in the views of some frames.
pub struct Problem<'a> {
    pub model: &'a BodyModel,
    pub topology: &'a Topology,
    /// shape `[frames][views]`
    pub frames: Vec<Vec<&'a Observation>>,
    pub options: Options,
}

/// Steps are shortened so that no angle (radians), coefficient or coordinate (metres) changes by more.
const LONGEST: f64 = 0.5;
/// Relative gain of energy below which it is over.
const LEAST_GAIN: f64 = 1e-3;

struct System {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    energy: f64,
}

impl Problem<'_> {
    /// Goes through the passes; the energy is that of the last.
    pub fn solve(&self, mut state: State, passes: &[Pass]) -> (State, f64) {
        let mut energy = f64::INFINITY;
        for pass in passes {
            (state, energy) = self.descend(state, pass);
        }
        (state, energy)
    }

    fn descend(&self, mut state: State, pass: &Pass) -> (State, f64) {
        let mut system = self.linearise(&state, pass);
        let mut damping = 1e-3;
        let (mut is_last, mut refused) = (false, 0);
        for _ in 1..pass.evaluations {
            let Some(next) = self.step(&state, &system, damping) else { break };
            let next_system = self.linearise(&next, pass);
            if next_system.energy < system.energy {
                let gain = (system.energy - next_system.energy) / system.energy;
                (state, system) = (next, next_system);
                damping = (damping * 0.3).max(1e-6);
                refused = 0;
                // correspondences change, so that one small gain may be followed by a larger one
                if gain < LEAST_GAIN && is_last {
                    break;
                }
                is_last = gain < LEAST_GAIN;
            } else {
                damping = (damping * 10.0).max(1e-2);
                refused += 1;
                if refused == 3 {
                    break;
                }
            }
        }
        (state, system.energy)
    }

    fn step(&self, state: &State, system: &System, damping: f64) -> Option<State> {
        let mut matrix = system.matrix.clone();
        for i in 0..matrix.nrows() {
            matrix[(i, i)] = matrix[(i, i)] * (1.0 + damping) + 1e-9;
        }
        let mut step = matrix.cholesky()?.solve(&system.gradient);
        let longest = step.amax();
        if longest > LONGEST {
            step *= LONGEST / longest;
        }
        let dofs = self.model.rig().num_dofs();
        let mut next = state.clone();
        for (frame, pose) in next.poses.iter_mut().enumerate() {
            let frame_step = step.rows(frame * dofs, dofs);
            pose.iter_mut().zip(frame_step.iter()).for_each(|(x, step)| *x -= step);
        }
        let shape_step = step.rows(state.poses.len() * dofs, state.alpha.len());
        next.alpha.iter_mut().zip(shape_step.iter()).for_each(|(x, step)| *x -= step);
        Some(next)
    }

    /// Half the Hessian (Gauss–Newton), half the gradient, and the energy.
    fn linearise(&self, state: &State, pass: &Pass) -> System {
        let (dofs, components) = (self.model.rig().num_dofs(), state.alpha.len());
        let frames = state.poses.len();
        let (width, columns) = (dofs + components, dofs + components + 1);
        let shape_at = frames * dofs;
        let mut system = System {
            matrix: DMatrix::zeros(shape_at + components, shape_at + components),
            gradient: DVector::zeros(shape_at + components),
            energy: 0.0,
        };
        for (frame, found) in self.evaluate(state, pass).into_iter().enumerate() {
            let at = |i: usize| if i < dofs { frame * dofs + i } else { shape_at + i - dofs };
            // views are summed in their order, whatever thread they came from
            for Quadratic { product, energy } in found {
                system.energy += energy;
                for i in 0..width {
                    for j in 0..width {
                        system.matrix[(at(i), at(j))] += product[i * columns + j];
                    }
                    system.gradient[at(i)] += product[i * columns + width];
                }
            }
            let System { matrix, gradient, energy } = &mut system;
            *energy += add_pose(self.model, &state.poses[frame], |d, weight, slope| {
                matrix[(at(d), at(d))] += weight;
                gradient[at(d)] += slope;
            });
        }
        let System { matrix, gradient, energy } = &mut system;
        *energy += add_shape(&state.alpha, |i, weight, slope| {
            matrix[(shape_at + i, shape_at + i)] += weight;
            gradient[shape_at + i] += slope;
        });
        for i in pass.components.min(components)..components {
            let i = shape_at + i;
            matrix.row_mut(i).fill(0.0);
            matrix.column_mut(i).fill(0.0);
            matrix[(i, i)] = 1.0;
            gradient[i] = 0.0;
        }
        system
    }

    /// Of every view of every frame.
    fn evaluate(&self, state: &State, pass: &Pass) -> Vec<Vec<Quadratic>> {
        let shape = self.model.shape(&state.alpha);
        self.frames
            .par_iter()
            .zip(&state.poses)
            .map(|(views, pose)| {
                let mut body = PosedBody::default();
                shape.pose(self.model, pose, &mut body.posed);
                body.drift.update(self.model, &body.posed);
                body.shape = Some(shape.clone());
                let term = Term {
                    model: self.model,
                    topology: self.topology,
                    body: &body,
                    weighting: pass.weighting,
                    components: self.model.num_components(),
                    options: &self.options,
                };
                let evaluate = |scratch: &mut Scratch, view: &&Observation| {
                    term.evaluate(&view.levels[pass.level], scratch)
                };
                views.par_iter().map_init(Scratch::default, evaluate).collect()
            })
            .collect()
    }
}
