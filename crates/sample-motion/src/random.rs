use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream of random numbers is for; streams of different purposes are independent.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Purpose {
    /// bone lengths of a subject
    Body = 1,
    /// how a subject does an action
    PersonalStyle = 2,
    /// how one trial differs from the subject's others
    Trial = 3,
}

/// A reproducible stream of random numbers (ChaCha with 8 rounds).
pub(crate) struct RandomStream(ChaCha8Rng);

impl RandomStream {
    pub fn new(purpose: Purpose, numbers: [u64; 3]) -> Self {
        let mut seed = [0; 32];
        seed[..8].copy_from_slice(&(purpose as u64).to_le_bytes());
        for (chunk, number) in seed[8..].chunks_exact_mut(8).zip(numbers) {
            chunk.copy_from_slice(&number.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(seed))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and deviation 1 (Marsaglia's polar method: Marsaglia and Bray 1964;
    /// docs/papers.md#other-sources).
    pub fn normal(&mut self) -> f64 {
        loop {
            let (u, v) = (2.0 * self.uniform() - 1.0, 2.0 * self.uniform() - 1.0);
            let s = u * u + v * v;
            if s > 0.0 && s < 1.0 {
                return u * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }

    /// Normal with mean 0 and deviation 1, redrawn until it lies within `most` deviations.
    pub fn normal_within(&mut self, most: f64) -> f64 {
        loop {
            let z = self.normal();
            if z.abs() <= most {
                return z;
            }
        }
    }
}
