//! The search for misaligned limbs: interacting simulated annealing, and the annealed particle filter beside it.
//!
//! In iteration k every particle has the weight `exp(−β_k E)`, β grows, weights sum to 1. Interacting: a particle stays with the
//! probability of its weight divided by the largest, others become copies of particles drawn by weight; all move by noise with
//! the covariance of the particles, made smaller. Every random number belongs to (seed, frame, iteration, particle).

use body::{BodyModel, ROOT_DOFS, Shape};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use vision::Topology;

use crate::{
    Annealing, ObservedFrame, ParticleOptions, Parzen, PoseSpace, SilhouetteTerm, joint_limit_energy,
    random::RandomStream,
};

/// Growth of β: (k + 1)^this, beside 1 / (mean − least energy of the first particles).
const GROWTH: f64 = 0.7;
/// Covariance of the noise as a share of the particles' own (Gall et al.: 0.4).
const NOISE: f64 = 0.4;
/// Least standard deviation of the noise, radians (and, of the root's translation, metres).
const LEAST_NOISE: f64 = 0.005;
/// Share of the particles that survive in the annealed particle filter, and what its noise shrinks by in each iteration.
const SURVIVORS: f64 = 0.5;
const SHRINK: f64 = 0.7;
/// Spread of the root's rotation (radians) and translation (metres) beside that of angles.
const ROOT_SPREAD: [f64; 2] = [0.4, 0.15];
/// Every n-th of the first particles takes the searched angles from a training pose, if the prior is used.
const FROM_TRAINING: usize = 4;

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// the mean of the last particles, or the best of all if it is better, shape `[dofs]`
    pub pose: Vec<f64>,
    /// its energy E_S + λ E_R + E_P
    pub energy: f64,
    /// 1 / Σ w² of the last iteration, in [1, particles]
    pub effective_sample_size: f64,
}

/// What is searched, and the terms of the energy.
#[derive(Clone, Copy)]
pub struct Space<'a> {
    pub model: &'a BodyModel,
    pub topology: &'a Topology,
    pub shape: &'a Shape,
    pub frame: &'a ObservedFrame,
    /// where it begins, shape `[dofs]`
    pub start: &'a [f64],
    /// of this frame, shape `[dofs]`
    pub predicted: &'a [f64],
    /// indices of the DOFs searched
    pub dofs: &'a [usize],
    pub parzen: &'a Parzen,
    pub pose_space: &'a PoseSpace,
    /// shape `[poses][dofs]`
    pub training_poses: &'a [Vec<f64>],
    pub options: &'a ParticleOptions,
}

impl Space<'_> {
    /// E = E_S + λ E_R + E_P. Takes no memory once the term has seen the frame.
    fn energy(&self, term: &mut SilhouetteTerm, pose: &[f64]) -> f64 {
        let silhouettes = term.energy_mm(self.model, self.topology, self.shape, self.frame, pose);
        let mut energy = silhouettes + joint_limit_energy(self.model, pose);
        energy += self.options.prediction_weight * self.pose_space.energy(pose, self.predicted);
        if self.options.with_prior {
            energy += self.parzen.energy(pose);
        }
        energy
    }

    fn spread(&self, dof: usize) -> f64 {
        let share = match dof {
            0..3 => ROOT_SPREAD[1],
            3..ROOT_DOFS => ROOT_SPREAD[0],
            _ => 1.0,
        };
        self.options.spread * share
    }

    /// The first particles: the pose that failed, the prediction, and poses between them with noise.
    fn place(&self, particle: usize, pose: &mut [f64]) {
        pose.copy_from_slice(self.start);
        if particle == 0 {
            return;
        }
        let mut random = RandomStream::new(self.options.seed, self.frame.index, 0, particle);
        let share = if particle == 1 { 1.0 } else { random.uniform() };
        let from = random.uniform() * self.training_poses.len() as f64;
        let is_trained = self.options.with_prior && particle % FROM_TRAINING == 2;
        for &d in self.dofs {
            pose[d] += share * (self.predicted[d] - self.start[d]);
            if particle == 1 {
                continue;
            }
            let noise = self.spread(d) * random.normal();
            match self.training_poses.get(from as usize) {
                Some(training) if is_trained && d >= ROOT_DOFS => pose[d] = training[d],
                _ => pose[d] += noise,
            }
        }
        self.model.rig().clamp(pose);
    }
}

/// Particles and the buffers of those who draw them.
#[derive(Debug, Default)]
pub struct Particles {
    terms: Vec<SilhouetteTerm>,
    /// shape `[particles, dofs]`
    poses: Vec<f64>,
    chosen: Vec<f64>,
    energies: Vec<f64>,
    weights: Vec<f64>,
}

impl Particles {
    /// Searches; `None` if `goes_on` said no, which is asked before every iteration.
    pub fn search(&mut self, space: &Space<'_>, goes_on: &dyn Fn() -> bool) -> Option<Search> {
        let (count, dofs) = (space.options.particles, space.start.len());
        self.poses.resize(count * dofs, 0.0);
        self.energies.resize(count, 0.0);
        for (particle, pose) in self.poses.chunks_exact_mut(dofs).enumerate() {
            space.place(particle, pose);
        }
        let mut best = (space.start.to_vec(), f64::INFINITY);
        let mut scale = 1.0;
        for iteration in 0..space.options.iterations {
            if !goes_on() {
                return None;
            }
            if iteration > 0 {
                self.renew(space, iteration);
            }
            self.measure(space);
            for (pose, &energy) in self.poses.chunks_exact(dofs).zip(&self.energies) {
                if energy < best.1 {
                    best.0.copy_from_slice(pose);
                    best.1 = energy;
                }
            }
            if iteration == 0 {
                let mean = self.energies.iter().sum::<f64>() / count as f64;
                scale = (mean - best.1).max(1e-6);
            }
            self.weigh(match space.options.annealing {
                Annealing::Interacting => Some(((iteration + 1) as f64).powf(GROWTH) / scale),
                Annealing::Filter => None,
            });
        }
        let effective_sample_size = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        let mut mean = vec![0.0; dofs];
        for (pose, weight) in self.poses.chunks_exact(dofs).zip(&self.weights) {
            mean.iter_mut().zip(pose).for_each(|(mean, x)| *mean += weight * x);
        }
        if self.terms.is_empty() {
            self.terms.push(SilhouetteTerm::default());
        }
        let energy = space.energy(&mut self.terms[0], &mean);
        let (pose, energy) = if energy < best.1 { (mean, energy) } else { best };
        Some(Search { pose, energy, effective_sample_size })
    }

    /// Energies of all particles, on all cores: each has its own part of the particles and its own buffers.
    fn measure(&mut self, space: &Space<'_>) {
        let dofs = space.start.len();
        let workers = rayon::current_num_threads().clamp(1, self.energies.len());
        let share = self.energies.len().div_ceil(workers);
        self.terms.resize_with(workers.max(self.terms.len()), SilhouetteTerm::default);
        self.poses
            .par_chunks(share * dofs)
            .zip(self.energies.par_chunks_mut(share))
            .zip(&mut self.terms)
            .for_each(|((poses, energies), term)| {
                for (pose, energy) in poses.chunks_exact(dofs).zip(energies) {
                    *energy = space.energy(term, pose);
                }
            });
    }

    /// Weights that sum to 1, for a β given or for one that lets half of the particles survive.
    fn weigh(&mut self, beta: Option<f64>) {
        let least = self.energies.iter().copied().fold(f64::INFINITY, f64::min);
        let Self { energies, weights, .. } = self;
        let mut fill = |beta: f64| {
            weights.clear();
            weights.extend(energies.iter().map(|energy| (-beta * (energy - least)).exp()));
            let sum: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight /= sum);
            1.0 / weights.iter().map(|w| w * w).sum::<f64>()
        };
        let wanted = SURVIVORS * energies.len() as f64;
        match beta {
            Some(beta) => {
                fill(beta);
            }
            None => {
                let (mut low, mut high) = (1e-6f64, 1e6f64);
                for _ in 0..40 {
                    let middle = (low * high).sqrt();
                    if fill(middle) > wanted { low = middle } else { high = middle }
                }
            }
        }
    }

    /// Draws the particles of an iteration from those before it.
    fn renew(&mut self, space: &Space<'_>, iteration: usize) {
        let (dofs, options) = (space.start.len(), space.options);
        let noise = match options.annealing {
            Annealing::Interacting => self.covariance_factor(space.dofs, dofs),
            Annealing::Filter => {
                let shrunk = SHRINK.powi(iteration as i32);
                let spreads = space.dofs.iter().map(|&d| (space.spread(d) * shrunk).max(LEAST_NOISE));
                DMatrix::from_diagonal(&DVector::from_iterator(space.dofs.len(), spreads))
            }
        };
        let largest = self.weights.iter().copied().fold(0.0, f64::max);
        let mut normals = DVector::zeros(space.dofs.len());
        let mut step = DVector::zeros(space.dofs.len());
        self.chosen.resize(self.poses.len(), 0.0);
        for (particle, pose) in self.chosen.chunks_exact_mut(dofs).enumerate() {
            let mut random = RandomStream::new(options.seed, space.frame.index, iteration, particle);
            let stays = options.annealing == Annealing::Interacting
                && random.uniform() * largest < self.weights[particle];
            let from = if stays { particle } else { drawn(&self.weights, random.uniform()) };
            pose.copy_from_slice(&self.poses[from * dofs..(from + 1) * dofs]);
            normals.iter_mut().for_each(|x| *x = random.normal());
            noise.mul_to(&normals, &mut step);
            space.dofs.iter().zip(step.iter()).for_each(|(&d, step)| pose[d] += step);
        }
        std::mem::swap(&mut self.poses, &mut self.chosen);
    }

    /// Lower triangle L of the noise's covariance L Lᵀ: a share of that of the particles, by their weights.
    fn covariance_factor(&self, searched: &[usize], dofs: usize) -> DMatrix<f64> {
        let count = searched.len();
        let at = |pose: &[f64]| DVector::from_iterator(count, searched.iter().map(|&d| pose[d]));
        let poses = || self.poses.chunks_exact(dofs).zip(&self.weights);
        let mut mean = DVector::zeros(count);
        poses().for_each(|(pose, &weight)| mean.axpy(weight, &at(pose), 1.0));
        let mut covariance = DMatrix::identity(count, count) * LEAST_NOISE.powi(2);
        for (pose, &weight) in poses() {
            let off = at(pose) - &mean;
            covariance.ger(NOISE * weight, &off, &off, 1.0);
        }
        covariance.cholesky().map_or_else(|| DMatrix::identity(count, count) * LEAST_NOISE, |found| found.l())
    }
}

/// Index of the particle at a share of the sum of weights.
fn drawn(weights: &[f64], share: f64) -> usize {
    let mut left = share;
    for (particle, weight) in weights.iter().enumerate() {
        left -= weight;
        if left < 0.0 {
            return particle;
        }
    }
    weights.len() - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_1_and_half_survive_in_the_filter() {
        let energies: Vec<f64> = (0..100).map(|i| 3.0 + (f64::from(i) * 0.7).sin() * 5.0).collect();
        let mut particles = Particles { energies, ..Particles::default() };
        particles.weigh(Some(0.8));
        assert!((particles.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        particles.weigh(None);
        let effective = 1.0 / particles.weights.iter().map(|w| w * w).sum::<f64>();
        assert!((effective - 50.0).abs() < 0.1, "{effective}");
    }

    #[test]
    fn particles_are_drawn_as_often_as_they_weigh() {
        let weights = [0.1, 0.6, 0.0, 0.3];
        let mut counts = [0; 4];
        (0..1000).for_each(|i| counts[drawn(&weights, (f64::from(i) + 0.5) / 1000.0)] += 1);
        assert_eq!(counts, [100, 600, 0, 300]);
        assert_eq!(drawn(&weights, 1.0), 3);
    }
}
