//! A whole body through frames of targets and silhouettes.

use std::sync::Arc;

use kinematics::HEADING;
use model::{Camera, Silhouette};
use nalgebra::Vector3;
use vision::DistanceField;

use crate::{Chain, Evidence, ImageView, Method, Outcome, Result, Solver, Support, SupportWidth};

/// A chain with what its frames are solved by.
#[derive(Debug, Clone)]
pub struct FigureChain {
    /// the chain; its first six coordinates are the root's translation, heading and tilt
    pub chain: Chain,
    /// where its coordinates like to be; those of the root don't count; shape `[dofs]`
    pub neutral: Vec<f64>,
    /// coordinates that turn limbs about themselves: elbows and knees are tried to both sides by them
    pub twists: Vec<usize>,
    /// slopes of the image support
    pub width: SupportWidth,
}

/// One frame, solved.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// coordinates of the chain, shape `[dofs]`
    pub x: Vec<f64>,
    /// the chain's points, metres, shape `[points]`
    pub positions: Vec<Vector3<f64>>,
    /// root mean square distance of the points from their targets, metres; `None` if nothing was measured
    pub residual_m: Option<f64>,
    /// mean support of the segments in the silhouettes, in [−1, 1]; `None` without silhouettes
    pub overlap: Option<f64>,
    /// steps taken, over all that was tried
    pub steps: usize,
}

/// Solves the frames of a chain in turn, each from the solution of the one before. The first, and those after a loss, start from the
/// neutral posture in eight headings.
#[derive(Debug, Clone)]
pub struct SequenceSolver {
    body: FigureChain,
    solver: Solver,
    method: Method,
    /// the last solution
    last: Option<Vec<f64>>,
}

/// Headings that a first frame is started from.
const HEADINGS: u32 = 8;
/// Steps of a first frame.
const FIRST_STEPS: usize = 80;
/// How far limbs are turned to either side, radians.
const TURN: f64 = 0.5;
/// How much more another solution must agree with the evidence.
const MARGIN: f64 = 0.005;
/// Weight of a metre that targets are missed by, beside the overlap.
const MISS: f64 = 10.0;
/// Root mean square distance from the targets beyond which the next frame starts anew, metres.
const LOST_M: f64 = 0.1;
/// Coordinates of the root: no posture is preferred there.
const ROOT: usize = 6;

impl SequenceSolver {
    /// Nothing is solved yet. `targeted`: the points that may have targets.
    ///
    /// # Errors
    /// If the method's options don't fit the chain.
    pub fn new(body: FigureChain, targeted: &[usize], method: Method, steps: usize) -> Result<Self> {
        let options = crate::Options { steps, ..method.options(targeted) };
        Ok(Self { solver: Solver::new(body.chain.clone(), options)?, body, method, last: None })
    }

    /// The chain.
    pub fn body(&self) -> &FigureChain {
        &self.body
    }

    /// The next frame: `targets` are in metres, `None` where not measured, shape `[points]`; `views` are what cameras saw at that
    /// moment, any number, in any order.
    ///
    /// # Errors
    /// As [`Solver::solve`].
    ///
    /// # Panics
    /// If a silhouette is wider or higher than 32,768 pixels.
    pub fn next(
        &mut self,
        targets: &[Option<Vector3<f64>>],
        views: &[(Camera, Silhouette)],
    ) -> Result<Solved> {
        let measured: Vec<_> = targets.iter().flatten().copied().collect();
        let centre = measured.iter().sum::<Vector3<f64>>() / measured.len().max(1) as f64;
        let seen = views.iter().filter(|(_, silhouette)| self.method.uses_images() && silhouette.area() > 0);
        let views: Vec<ImageView> = seen
            .map(|(camera, silhouette)| {
                let field = Arc::new(DistanceField::new(silhouette, 1));
                let support = Support::seen_at(field, camera, &centre, self.body.width);
                ImageView { camera: camera.clone(), support }
            })
            .collect();
        let mut best = match self.last.take() {
            // without a measurement there is nothing to go after
            Some(x) if measured.is_empty() && views.is_empty() => self.keep(x, targets)?,
            Some(x) => self.go_on(&x, targets, &views)?,
            None => self.begin(targets, &views)?,
        };
        if best.miss > LOST_M && !measured.is_empty() {
            let anew = self.begin(targets, &views)?;
            if anew.score > best.score {
                best = anew;
            }
        }
        let Try { x, outcome, positions, miss, steps, .. } = best;
        self.last = Some(x.clone());
        Ok(Solved {
            x,
            positions,
            residual_m: (!measured.is_empty()).then_some(miss),
            overlap: (!views.is_empty()).then_some(outcome.overlap),
            steps,
        })
    }

    /// From the neutral posture in all headings, with the middle of the measured points where it was measured.
    fn begin(&mut self, targets: &[Option<Vector3<f64>>], views: &[ImageView]) -> Result<Try> {
        let mut best: Option<Try> = None;
        for turn in 0..HEADINGS {
            let mut x = self.body.neutral.clone();
            x[HEADING] = f64::from(turn) * std::f64::consts::TAU / f64::from(HEADINGS);
            x[HEADING] -= if x[HEADING] > std::f64::consts::PI { std::f64::consts::TAU } else { 0.0 };
            let found = self.positions(&x)?;
            let (mut shift, mut count) = (Vector3::zeros(), 0.0);
            for (target, found) in targets.iter().zip(&found) {
                if let Some(target) = target {
                    shift += target - found;
                    count += 1.0;
                }
            }
            if count > 0.0 {
                x.iter_mut().zip(&(shift / count)).for_each(|(x, shift)| *x += shift);
            }
            let mut steps = 0;
            for _ in 0..FIRST_STEPS / 15 {
                let tried = self.try_from(&x, &self.body.neutral.clone(), targets, views)?;
                x.copy_from_slice(&tried.x);
                steps += tried.steps;
                let tried = Try { steps, ..tried };
                if best.as_ref().is_none_or(|best| tried.score > best.score) {
                    best = Some(tried);
                }
            }
        }
        let neutral = self.body.neutral.clone();
        match best {
            Some(best) => self.turn_limbs(best, &neutral, targets, views),
            None => self.keep(neutral, targets),
        }
    }

    /// From the last solution.
    fn go_on(&mut self, last: &[f64], targets: &[Option<Vector3<f64>>], views: &[ImageView]) -> Result<Try> {
        let posture = self.body.neutral.clone();
        let first = self.try_from(last, &posture, targets, views)?;
        if views.is_empty() { Ok(first) } else { self.turn_limbs(first, &posture, targets, views) }
    }

    /// Tries elbows and knees to both sides, limb by limb.
    fn turn_limbs(
        &mut self,
        mut best: Try,
        posture: &[f64],
        targets: &[Option<Vector3<f64>>],
        views: &[ImageView],
    ) -> Result<Try> {
        for twist in self.body.twists.clone() {
            for turn in [TURN, -TURN] {
                let mut x = best.x.clone();
                let [low, high] = self.body.chain.limits()[twist];
                x[twist] = (x[twist] + turn).clamp(low, high);
                let tried = self.try_from(&x, posture, targets, views)?;
                let steps = best.steps + tried.steps;
                if tried.score > best.score + MARGIN {
                    best = tried;
                }
                best.steps = steps;
            }
        }
        Ok(best)
    }

    fn try_from(
        &mut self,
        start: &[f64],
        posture: &[f64],
        targets: &[Option<Vector3<f64>>],
        views: &[ImageView],
    ) -> Result<Try> {
        let mut x = start.to_vec();
        let mut posture = posture.to_vec();
        posture[..ROOT].copy_from_slice(&start[..ROOT]);
        let evidence = Evidence { targets, views, posture: &posture };
        let outcome = self.solver.solve(&mut x, &evidence)?;
        let miss = miss(self.solver.positions(), targets);
        // the root has no posture of its own
        posture[..ROOT].copy_from_slice(&x[..ROOT]);
        let evidence = Evidence { targets, views, posture: &posture };
        let score = self.solver.criterion(&x, &evidence) - MISS * miss;
        let positions = self.solver.positions().to_vec();
        Ok(Try { x, positions, miss, score, steps: outcome.steps, outcome })
    }

    /// Coordinates as they are.
    fn keep(&mut self, x: Vec<f64>, targets: &[Option<Vector3<f64>>]) -> Result<Try> {
        let positions = self.positions(&x)?;
        let outcome = Outcome { steps: 0, residual_m: 0.0, overlap: 0.0, limited: 0 };
        Ok(Try { miss: miss(&positions, targets), x, positions, score: 0.0, steps: 0, outcome })
    }

    fn positions(&self, x: &[f64]) -> Result<Vec<Vector3<f64>>> {
        let (kinematics, points) = (self.body.chain.kinematics(), self.body.chain.points());
        let mut positions = vec![Vector3::zeros(); points.len()];
        points.positions(kinematics, x, &mut kinematics.state(), &mut positions);
        Ok(positions)
    }
}

/// A solution, and how well it agrees with the evidence.
struct Try {
    x: Vec<f64>,
    outcome: Outcome,
    positions: Vec<Vector3<f64>>,
    miss: f64,
    score: f64,
    steps: usize,
}

/// Root mean square distance of points from their targets, metres; 0 without targets.
fn miss(positions: &[Vector3<f64>], targets: &[Option<Vector3<f64>>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (position, target) in positions.iter().zip(targets) {
        if let Some(target) = target {
            sum += (target - position).norm_squared();
            count += 1.0;
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}
