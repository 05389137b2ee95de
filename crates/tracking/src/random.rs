use std::f64::consts::TAU;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Random numbers of one particle in one iteration of one frame: the same whatever thread asks.
pub struct RandomStream(ChaCha8Rng);

impl RandomStream {
    /// The stream of (seed, frame, iteration, particle).
    pub fn new(seed: u64, frame: usize, iteration: usize, particle: usize) -> Self {
        let mut key = [0; 32];
        let numbers = [seed, frame as u64, iteration as u64, particle as u64];
        for (bytes, number) in key.chunks_exact_mut(8).zip(numbers) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        Self(ChaCha8Rng::from_seed(key))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Of the standard normal distribution (Box and Muller 1958; docs/papers.md#other-sources).
    pub fn normal(&mut self) -> f64 {
        // 1 - u is never 0
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_in_each_of_their_four_numbers() {
        let first =
            |seed, frame, iteration, particle| RandomStream::new(seed, frame, iteration, particle).uniform();
        let all =
            [first(1, 2, 3, 4), first(2, 2, 3, 4), first(1, 3, 3, 4), first(1, 2, 4, 4), first(1, 2, 3, 5)];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b));
        }
        assert_eq!(first(1, 2, 3, 4), all[0]);
    }

    #[test]
    fn normal_numbers_have_mean_0_and_variance_1() {
        let mut random = RandomStream::new(5, 0, 0, 0);
        let numbers: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let mean = numbers.iter().sum::<f64>() / 20_000.0;
        let variance = numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04, "{mean} {variance}");
    }
}
