//! From what a run or a call asks for to the tracker's options.

use multi_view::Parameters;
use tracking::{Options, ParticleOptions};

/// How a person is found in a key frame.
pub(crate) fn fit(parameters: &Parameters) -> shape_fit::Options {
    shape_fit::Options {
        least_iou: parameters.least_overlap,
        leave_out_bad_view: parameters.leave_out_bad_view,
        ..shape_fit::Options::default()
    }
}

/// How a person is followed in a run.
pub(crate) fn run(parameters: &Parameters) -> Options {
    let particles = ParticleOptions {
        particles: parameters.particles,
        iterations: parameters.iterations,
        with_prior: parameters.prior,
        seed: parameters.seed,
        ..ParticleOptions::default()
    };
    Options {
        fit: fit(parameters),
        particles: (parameters.particles > 0).then_some(particles),
        ..Options::default()
    }
}
