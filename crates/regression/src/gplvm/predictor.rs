use crate::gplvm::linearisation::{Linearisation, Terms, energy};
use crate::gplvm::model::{At, Gplvm};
use crate::{Examples, Parameters, Prediction, Predictor, Query};

/// Steps to the latent point of a first guess.
const FIRST_STEPS: usize = 5;
/// Rounds of pose and latent point, at most.
const ROUNDS: usize = 8;
/// A round that lowers the energy by less than this was the last; the energy is twice minus a log of a probability.
const LEAST_DECREASE: f64 = 0.02;

/// What the prior of a [`Gplvm`] depends on besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GplvmParameters {
    /// standard deviation of the pose about where the last two poses lead, feature units
    pub smooth_sigma: f64,
    /// standard deviation of every feature about what the model says, besides the model's own, feature units: poses are
    /// not on a surface of a few dimensions
    pub sigma: f64,
}

impl Default for GplvmParameters {
    fn default() -> Self {
        Self { smooth_sigma: 6.0, sigma: 3.0 }
    }
}

/// The prior of a [`Gplvm`] over the next pose, with a pose that keeps its velocity as a second opinion:
///
/// ```text
/// E(q, x) = Σ_k (y_k(q) − f_k(x))²/s_k²(x) + ln s_k²(x) + ‖x‖² + ‖q − 2 q_{t−1} + q_{t−2}‖²/τ²
/// ```
///
/// with `s_k²(x) = σ²(x)/w_k² + σ²`. Examples serve as a first guess only: the successor of the nearest.
#[derive(Debug, Clone)]
pub struct GplvmPredictor<'a> {
    model: &'a Gplvm,
    linearisation: Linearisation,
    at: At,
    trial: At,
    /// the best pose so far, shape `[dofs]`
    pose: Vec<f64>,
    known: Known,
    centred: Vec<f64>,
    best: f64,
    damping: f64,
    rounds: usize,
}

/// What a frame gives besides the model.
#[derive(Debug, Clone)]
struct Known {
    /// shape `[dofs]`
    before: Vec<f64>,
    has_before: bool,
    /// shape `[dofs]`
    onwards: Vec<f64>,
    has_onwards: bool,
    smoothness: f64,
    floor: f64,
}

impl Known {
    fn set(&mut self, query: &Query<'_>) {
        let dofs = self.before.len();
        let (newest, older) = (query.pose(1, dofs), query.pose(2, dofs));
        self.has_before = newest.is_some();
        self.has_onwards = older.is_some();
        if let Some(newest) = newest {
            self.before.copy_from_slice(newest);
        }
        if let Some(older) = older {
            for ((out, a), b) in self.onwards.iter_mut().zip(&self.before).zip(older) {
                *out = 2.0 * a - b;
            }
        }
    }

    fn terms(&self) -> Terms<'_> {
        Terms {
            before: self.has_before.then_some(&self.before[..]),
            onwards: self.has_onwards.then_some(&self.onwards[..]),
            smoothness: self.smoothness,
            floor: self.floor,
        }
    }
}

impl<'a> GplvmPredictor<'a> {
    /// A predictor of `model`, with its memory.
    pub fn new(model: &'a Gplvm, parameters: GplvmParameters) -> Self {
        let dofs = model.dofs();
        Self {
            linearisation: Linearisation::new(dofs, model.latent_dims()),
            at: model.at(),
            trial: model.at(),
            pose: vec![0.0; dofs],
            known: Known {
                before: vec![0.0; dofs],
                has_before: false,
                onwards: vec![0.0; dofs],
                has_onwards: false,
                smoothness: parameters.smooth_sigma.powi(-2),
                floor: parameters.sigma.powi(2),
            },
            centred: vec![0.0; 2 * dofs],
            best: f64::INFINITY,
            damping: 0.0,
            rounds: 0,
            model,
        }
    }

    /// The latent point of `self.pose`: from that of the nearest active pose downhill.
    fn find_latent(&mut self) {
        let dofs = self.model.dofs();
        let (poses, velocities) = self.centred.split_at_mut(dofs);
        let mean = &self.model.stored.mean;
        for q in 0..dofs {
            poses[q] = self.pose[q] - mean[q];
            let is_compared = self.known.has_before && self.model.stored.variances[dofs + q] > 0.0;
            let velocity = self.pose[q] - self.known.before[q] - mean[dofs + q];
            velocities[q] = if is_compared { velocity } else { 0.0 };
        }
        self.at.latent.copy_from_slice(self.model.nearest_latent(&self.centred));
        self.model.evaluate(&mut self.at);
        let terms = Terms { onwards: None, ..self.known.terms() };
        let mut now = energy(self.model, &self.at, &self.pose, &terms);
        let mut damping = 0.0;
        for _ in 0..FIRST_STEPS {
            self.linearisation.set(self.model, &self.at, &self.pose, &terms, damping);
            let step = self.linearisation.latent_given(&self.pose);
            for ((out, x), s) in self.trial.latent.iter_mut().zip(&self.at.latent).zip(step) {
                *out = x + s;
            }
            self.model.evaluate(&mut self.trial);
            let then = energy(self.model, &self.trial, &self.pose, &terms);
            if then < now {
                std::mem::swap(&mut self.at, &mut self.trial);
                if now - then < LEAST_DECREASE {
                    break;
                }
                (now, damping) = (then, damping / 10.0);
            } else {
                damping = stronger(damping);
            }
        }
    }

    fn linearise(&mut self, out: &mut Prediction) {
        let terms = self.known.terms();
        self.linearisation.set(self.model, &self.at, &self.pose, &terms, self.damping);
        self.linearisation.marginal(out);
    }
}

impl Predictor for GplvmPredictor<'_> {
    fn predict(
        &mut self,
        examples: &Examples<'_>,
        query: &Query<'_>,
        _parameters: &Parameters,
        out: &mut Prediction,
    ) {
        self.known.set(query);
        let guess = match examples.nearest() {
            Some(k) => examples.target(k),
            None if self.known.has_onwards => &self.known.onwards,
            None if self.known.has_before => &self.known.before,
            None => &self.model.stored.mean[..self.model.dofs()],
        };
        self.pose.copy_from_slice(guess);
        self.find_latent();
        self.best = f64::INFINITY;
        self.damping = 0.0;
        self.rounds = 0;
        self.linearise(out);
    }

    fn relinearise(&mut self, found: &[f64], likelihood: f64, out: &mut Prediction) -> bool {
        self.rounds += 1;
        let step = self.linearisation.latent_given(found);
        for ((out, x), s) in self.trial.latent.iter_mut().zip(&self.at.latent).zip(step) {
            *out = x + s;
        }
        self.model.evaluate(&mut self.trial);
        let energy = likelihood + energy(self.model, &self.trial, found, &self.known.terms());
        let decrease = self.best - energy;
        if decrease > 0.0 {
            self.best = energy;
            self.pose.copy_from_slice(found);
            std::mem::swap(&mut self.at, &mut self.trial);
            self.damping /= 10.0;
        } else {
            self.damping = stronger(self.damping);
        }
        // Also where it is not a number.
        let is_worth_it = decrease.abs() > LEAST_DECREASE;
        if !is_worth_it || self.rounds >= ROUNDS {
            return false;
        }
        self.linearise(out);
        true
    }
}

fn stronger(damping: f64) -> f64 {
    if damping < 0.1 { 1.0 } else { damping * 10.0 }
}
