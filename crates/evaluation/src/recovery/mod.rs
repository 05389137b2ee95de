//! How often a disturbed pose is found again: the protocol behind the paper's claim that 25 particles × 10 iterations with the
//! prior do what 100 × 15 do without it (docs/papers.md#particle-search).
//!
//! A start is a body of its own shape in a true pose, seen by cameras, and that pose with limbs turned in every
//! angle. All methods get the same starts. Local optimisation and searches are judged alone, as in the paper: one
//! search over the DOFs of the turned limbs, nothing tried twice. [`Strategy::Marey`] is all that [`Tracker`] does in a
//! frame.

mod start;

use std::sync::atomic::AtomicBool;

use body::BodyModel;
use model::Camera;
use nalgebra::Vector3;
use rayon::prelude::*;
use tracking::{Annealing, Options, ParticleOptions, Result, Tracker};

use start::Start;

/// A joint that is farther off than this was not found, metres.
pub const FOUND_M: f64 = 0.05;

/// Limbs that are turned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Limbs {
    /// the left arm
    Arm,
    /// both arms
    Arms,
    /// the left leg
    Leg,
    /// arms and legs
    All,
}

impl Limbs {
    /// Indices among those of [`shape_fit::limb_dofs`].
    fn indices(self) -> &'static [usize] {
        match self {
            Self::Arm => &[0],
            Self::Arms => &[0, 1],
            Self::Leg => &[2],
            Self::All => &[0, 1, 2, 3],
        }
    }

    /// Indices of the DOFs of these limbs.
    pub fn dofs(self, model: &BodyModel) -> Vec<usize> {
        let limbs = shape_fit::limb_dofs(model);
        self.indices().iter().flat_map(|&limb| limbs[limb].into_iter().flatten()).collect()
    }
}

/// What is found again.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// the body
    pub model: &'a BodyModel,
    /// who sees it
    pub cameras: &'a [Camera],
    /// silhouettes have the noise of `vision::scene::SilhouetteNoise`
    pub is_noisy: bool,
    /// one true pose a start, shape `[starts][dofs]`; bodies are put over the origin
    pub poses: &'a [Vec<f64>],
    /// which limbs are turned
    pub limbs: Limbs,
    /// by how much, in each angle, radians; less where a joint's limits are nearer in both directions
    pub turned_rad: f64,
    /// other shapes, directions, noise and particles
    pub seed: u64,
}

/// What is done to a start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Strategy {
    /// local optimisation
    Local,
    /// one search over the DOFs of the turned limbs, and local optimisation after it
    Search(ParticleOptions),
    /// a frame of [`Tracker::track`]: local optimisation, a search of what is misaligned then, limb by limb if that failed
    Marey(ParticleOptions),
}

/// A way to find poses again.
#[derive(Debug, Clone, PartialEq)]
pub struct Method<'a> {
    /// what it is called in tables
    pub name: &'static str,
    /// what it does
    pub strategy: Strategy,
    /// of the prior, shape `[poses][dofs]`
    pub training_poses: &'a [Vec<f64>],
}

/// The search that the paper's claim is about, with its prior.
pub const WITH_PRIOR: &str = "25 x 10, prior";
/// What it is said to be as good as.
pub const LARGE_WITHOUT: &str = "100 x 15, no prior";

impl<'a> Method<'a> {
    /// What the paper compares and what stands beside it. `built_in` are other training poses, to see what recorded
    /// ones are worth.
    pub fn all(training_poses: &'a [Vec<f64>], built_in: Option<&'a [Vec<f64>]>) -> Vec<Self> {
        let options = |particles, iterations, with_prior| ParticleOptions {
            particles,
            iterations,
            with_prior,
            ..ParticleOptions::default()
        };
        let search = |name, options| Self { name, strategy: Strategy::Search(options), training_poses };
        let with = options(25, 10, true);
        let mut methods = vec![
            Self { name: "local only", strategy: Strategy::Local, training_poses },
            search(WITH_PRIOR, with),
            search("25 x 10, no prior", options(25, 10, false)),
            search(LARGE_WITHOUT, options(100, 15, false)),
            search("20 x 15, no prior (Gall)", options(20, 15, false)),
            search("25 x 10 filter, prior", ParticleOptions { annealing: Annealing::Filter, ..with }),
        ];
        if let Some(poses) = built_in {
            let strategy = Strategy::Search(with);
            methods.push(Self { name: "25 x 10, built-in poses", strategy, training_poses: poses });
        }
        methods.push(Self { name: "all of Marey", strategy: Strategy::Marey(with), training_poses });
        methods
    }

    /// Energies that one search evaluates; 0 without a search.
    pub fn evaluations(&self) -> usize {
        match self.strategy {
            Strategy::Local => 0,
            Strategy::Search(options) | Strategy::Marey(options) => options.particles * options.iterations,
        }
    }
}

/// How far a method came from one start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovered {
    /// largest distance of a joint after the search, metres; of the start, where nothing is searched
    pub searched_m: f64,
    /// the same at the end
    pub final_m: f64,
}

impl Recovered {
    /// Whether the search alone found all joints.
    pub fn is_found_by_search(&self) -> bool {
        self.searched_m <= FOUND_M
    }

    /// Whether all joints are found at the end.
    pub fn is_found(&self) -> bool {
        self.final_m <= FOUND_M
    }
}

/// Runs every method from every start, starts on all cores: shape `[methods][starts]`. `each` is called when a start is done. The
/// result doesn't depend on the number of threads.
///
/// # Errors
/// If a pose, training poses or options are invalid.
pub fn recover(
    setting: &Setting<'_>,
    methods: &[Method<'_>],
    each: &(dyn Fn() + Sync),
) -> Result<Vec<Vec<Recovered>>> {
    let one = |index: usize| -> Result<Vec<Recovered>> {
        let start = Start::new(setting, index)?;
        let found = methods.iter().map(|method| run(setting, &start, method)).collect();
        each();
        found
    };
    let by_start = (0..setting.poses.len()).into_par_iter().map(one).collect::<Result<Vec<_>>>()?;
    Ok((0..methods.len()).map(|method| by_start.iter().map(|found| found[method]).collect()).collect())
}

fn run(setting: &Setting<'_>, start: &Start, method: &Method<'_>) -> Result<Recovered> {
    let particles = match method.strategy {
        Strategy::Local => None,
        Strategy::Search(options) | Strategy::Marey(options) => {
            Some(ParticleOptions { seed: setting.seed, ..options })
        }
    };
    let options = Options { particles, ..Options::default() };
    let training_poses = method.training_poses.to_vec();
    let mut tracker =
        Tracker::with_training_poses(setting.model, &start.alpha, &start.disturbed, options, training_poses)?;
    let frame = &start.frame;
    if matches!(method.strategy, Strategy::Marey(_)) {
        let tracked = tracker.track(frame, &AtomicBool::new(false))?;
        let final_m = farthest(&tracked.joints, &start.joints);
        return Ok(Recovered { searched_m: final_m, final_m });
    }
    let goes_on = || true;
    let dofs = setting.limbs.dofs(setting.model);
    let search = tracker.search_dofs(frame, &start.disturbed, &start.disturbed, &dofs, &goes_on).flatten();
    let searched = search.map_or_else(|| start.disturbed.clone(), |search| search.pose);
    let optimised = tracker.optimise(frame, &start.disturbed, &[&searched], &goes_on);
    let error_m = |pose: &[f64]| farthest(&start.joints_at(setting.model, pose), &start.joints);
    let searched_m = error_m(&searched);
    Ok(Recovered { searched_m, final_m: optimised.map_or(searched_m, |pose| error_m(&pose)) })
}

fn farthest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}
