//! Local optimisation: Gauss–Newton from coarse to fine over the pose with new correspondences at every step.

use body::{BodyModel, Shape};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use shape_fit::{PosedBody, Quadratic, Scratch, Term, Weighting, add_pose};
use vision::Topology;

use crate::{
    ObservedFrame,
    lift::SurfacePoint,
    observed_frame::ObservedView,
    texture_term::{TextureScratch, TextureTerm},
};

/// One step from coarse to fine.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// resolution: index of the observation's level
    level: usize,
    weighting: Weighting,
    /// σ of the robust weight of points of the skin, metres
    texture_m: f64,
    moves: usize,
}

const fn step(level: usize, [scale_m, tangential, normal_m]: [f64; 3], texture_m: f64, moves: usize) -> Step {
    Step { level, weighting: Weighting { scale_m, tangential, normal_m }, texture_m, moves }
}

/// Limbs move by up to 20 cm from frame to frame: far first, then exactly.
const STEPS: [Step; 5] = [
    step(0, [0.25, 0.5, 0.15], 0.04, 2),
    step(0, [0.12, 0.3, 0.10], 0.025, 2),
    step(0, [0.06, 0.1, 0.06], 0.015, 2),
    step(0, [0.03, 0.03, 0.05], 0.01, 2),
    step(1, [0.02, 0.01, 0.04], 0.008, 2),
];
/// Standard deviations of angles and of twists about the prediction, radians: wide, for what no silhouette tells.
const ANGLE: f64 = 0.5;
const TWIST: f64 = 0.25;
/// Index of the step that is descended; in those before it, moves are made whether the energy becomes less or not: with new pairs
/// each time it is another energy anyway.
const LAST: usize = STEPS.len() - 1;
/// Share that is added to the diagonal of the matrix.
const DAMPING: f64 = 1e-3;
/// Steps are shortened so that no angle (radians) or coordinate (metres) changes by more.
const LONGEST: f64 = 0.4;
/// Relative gain of energy below which a step is over.
const LEAST_GAIN: f64 = 1e-2;

/// Buffers of the optimisation, and the body that it poses.
#[derive(Debug)]
pub struct Local {
    /// the body in the pose that was evaluated last
    pub body: PosedBody,
    /// of every view
    scratches: Vec<(Scratch, TextureScratch)>,
}

/// What doesn't change while a pose is fitted.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    pub model: &'a BodyModel,
    pub topology: &'a Topology,
    pub frame: &'a ObservedFrame,
    /// points of the skin that every view found again, shape `[views]`
    pub points: &'a [Vec<SurfacePoint>],
    pub predicted: &'a [f64],
    pub options: &'a shape_fit::Options,
}

struct System {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    energy: f64,
}

impl Local {
    /// For a body at rest.
    pub fn new(shape: Shape) -> Self {
        let body = PosedBody { shape: Some(shape), ..PosedBody::default() };
        Self { body, scratches: Vec::new() }
    }

    /// The pose near the best of several starts. `goes_on` is asked before every evaluation.
    pub fn optimise(
        &mut self,
        problem: &Problem<'_>,
        starts: &[&[f64]],
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Vec<f64>> {
        let mut best: Option<(Vec<f64>, System)> = None;
        for start in starts {
            let system = self.linearise(problem, start, &STEPS[0]);
            if best.as_ref().is_none_or(|(_, best)| system.energy < best.energy) {
                best = Some((start.to_vec(), system));
            }
        }
        let (mut pose, mut system) = best?;
        for (i, step) in STEPS[..LAST].iter().enumerate() {
            for left in (0..step.moves).rev() {
                if !goes_on() {
                    return None;
                }
                let Some(next) = moved(&pose, &system, DAMPING) else { break };
                // pairs are made for the move that comes, so none is looked at twice
                let for_next = if left == 0 { &STEPS[i + 1] } else { step };
                system = self.linearise(problem, &next, for_next);
                pose = next;
            }
        }
        self.descend(problem, pose, system, &STEPS[LAST], goes_on)
    }

    /// Moves as long as that makes the energy less.
    fn descend(
        &mut self,
        problem: &Problem<'_>,
        mut pose: Vec<f64>,
        mut system: System,
        step: &Step,
        goes_on: &dyn Fn() -> bool,
    ) -> Option<Vec<f64>> {
        let mut damping = DAMPING;
        for _ in 0..step.moves {
            if !goes_on() {
                return None;
            }
            let Some(next) = moved(&pose, &system, damping) else { break };
            let next_system = self.linearise(problem, &next, step);
            if next_system.energy < system.energy {
                let gain = (system.energy - next_system.energy) / system.energy;
                (pose, system) = (next, next_system);
                damping = (damping * 0.3).max(1e-6);
                if gain < LEAST_GAIN {
                    break;
                }
            } else {
                damping = (damping * 10.0).max(1e-2);
            }
        }
        Some(pose)
    }

    /// Half the Hessian (Gauss–Newton), half the gradient, and the energy.
    fn linearise(&mut self, problem: &Problem<'_>, pose: &[f64], step: &Step) -> System {
        let Problem { model, topology, frame, points, predicted, options } = *problem;
        self.body.pose(model, pose);
        self.scratches.resize_with(frame.views.len().max(self.scratches.len()), Default::default);
        let weighting = step.weighting;
        let term = Term { model, topology, body: &self.body, weighting, components: 0, options };
        let texture = self.body.shape.as_ref().map(|shape| TextureTerm {
            model,
            shape,
            posed: &self.body.posed,
            scale_m: step.texture_m,
        });
        let views = frame.views.par_iter().zip(points).zip(&mut self.scratches);
        let evaluate =
            |((view, points), (scratch, texture_scratch)): ((&ObservedView, &Vec<_>), &mut (_, _))| {
                let mut found = term.evaluate(&view.observation.levels[step.level], scratch);
                if let Some(texture) = &texture {
                    texture.add(points, texture_scratch, &mut found);
                }
                found
            };
        let found: Vec<Quadratic> = views.map(evaluate).collect();
        let dofs = pose.len();
        let mut system =
            System { matrix: DMatrix::zeros(dofs, dofs), gradient: DVector::zeros(dofs), energy: 0.0 };
        // in the order of the views, whatever thread they came from
        for Quadratic { product, energy } in found {
            system.energy += energy;
            for i in 0..dofs {
                for j in 0..dofs {
                    system.matrix[(i, j)] += product[i * (dofs + 1) + j];
                }
                system.gradient[i] += product[i * (dofs + 1) + dofs];
            }
        }
        let System { matrix, gradient, energy } = &mut system;
        *energy += add_pose(model, pose, |d, weight, slope| {
            matrix[(d, d)] += weight;
            gradient[d] += slope;
        });
        for (d, dof) in model.rig().dofs().iter().enumerate().skip(body::ROOT_DOFS) {
            let weight = if dof.name.ends_with("twist") { TWIST } else { ANGLE }.powi(-2);
            let miss = pose[d] - predicted[d];
            *energy += weight * miss * miss;
            matrix[(d, d)] += weight;
            gradient[d] += weight * miss;
        }
        system
    }
}

fn moved(pose: &[f64], system: &System, damping: f64) -> Option<Vec<f64>> {
    let mut matrix = system.matrix.clone();
    for i in 0..matrix.nrows() {
        matrix[(i, i)] = matrix[(i, i)] * (1.0 + damping) + 1e-9;
    }
    let mut step = matrix.cholesky()?.solve(&system.gradient);
    let longest = step.amax();
    if !longest.is_finite() {
        return None;
    }
    if longest > LONGEST {
        step *= LONGEST / longest;
    }
    Some(pose.iter().zip(step.iter()).map(|(x, step)| x - step).collect())
}
