use crate::{Error, Result};

/// How a person is tracked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// what silhouettes are worth beside the prior
    pub fit: shape_fit::Options,
    /// a limb whose error is above this is misaligned, metres ([`crate::LimbError::error_m`])
    pub misaligned_m: f64,
    /// the search of misaligned limbs; `None` for local optimisation alone
    pub particles: Option<ParticleOptions>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fit: shape_fit::Options::default(),
            misaligned_m: 0.008,
            particles: Some(ParticleOptions::default()),
        }
    }
}

/// How particles are moved from iteration to iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Annealing {
    /// interacting simulated annealing: good particles stay where they are, others are drawn anew, and noise has the
    /// covariance of the particles (Gall et al. 2007, 2008; docs/papers.md#particle-search)
    Interacting,
    /// the annealed particle filter: all are drawn anew, weights flatten until half of the particles survive, noise shrinks by a
    /// fixed factor (Deutscher, Blake and Reid 2000; docs/papers.md#particle-search)
    Filter,
}

/// Which DOFs particles search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// those of misaligned limbs
    Misaligned,
    /// all
    Whole,
}

/// How particles search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticleOptions {
    /// number of particles
    pub particles: usize,
    /// number of iterations
    pub iterations: usize,
    /// weighs E_P with the Parzen density of training poses; without it E_P is joint limits alone
    pub with_prior: bool,
    /// λ of E_R
    pub prediction_weight: f64,
    /// how particles move
    pub annealing: Annealing,
    /// which DOFs they search
    pub part: Part,
    /// standard deviation of the first particles about the pose that failed, radians
    pub spread: f64,
    /// seed of every random number: the same seed, the same result
    pub seed: u64,
}

impl Default for ParticleOptions {
    fn default() -> Self {
        Self {
            particles: 25,
            iterations: 10,
            with_prior: true,
            prediction_weight: 0.01,
            annealing: Annealing::Interacting,
            part: Part::Misaligned,
            spread: 0.5,
            seed: 0,
        }
    }
}

impl Options {
    /// Checks all numbers.
    ///
    /// # Errors
    /// [`Error::Option`] with the first that is invalid.
    pub fn check(&self) -> Result<()> {
        let fail = |what, found, expected| Err(Error::Option { what, found, expected });
        if !(self.misaligned_m > 0.0 && self.misaligned_m.is_finite()) {
            return fail("misaligned_m", self.misaligned_m, "a positive number of metres");
        }
        let Some(particles) = &self.particles else { return Ok(()) };
        if !(2..=100_000).contains(&particles.particles) {
            return fail("particles", particles.particles as f64, "2 to 100000");
        }
        if !(1..=1000).contains(&particles.iterations) {
            return fail("iterations", particles.iterations as f64, "1 to 1000");
        }
        if !(particles.spread > 0.0 && particles.spread <= 3.0) {
            return fail("spread", particles.spread, "more than 0 to 3 radians");
        }
        if !(particles.prediction_weight >= 0.0 && particles.prediction_weight.is_finite()) {
            return fail("prediction_weight", particles.prediction_weight, "0 or more");
        }
        Ok(())
    }
}
