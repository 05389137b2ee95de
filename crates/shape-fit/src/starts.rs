//! The search for poses to start from: drawn at low resolution, placed where the hull is, and compared with the
//! silhouettes by distance.

use std::f64::consts::TAU;

use body::{BodyModel, Posed, Shape};
use model::Silhouette;
use nalgebra::Vector3;
use rayon::prelude::*;
use vision::{Chamfer, Rasteriser, Topology};

use crate::{
    observation::Observation,
    place::centroid,
    start_poses::{ARMS, LEGS, WHOLE, limb_dofs, set_limb},
};

/// Headings tried.
const HEADINGS: usize = 16;
/// Headings for which limbs are tried one by one.
const KEPT: usize = 10;
/// Times that all limbs are tried.
const ROUNDS: usize = 2;
/// First coefficient of the shape, mostly stature, standard deviations.
const SIZES: [f64; 5] = [0.0, -2.0, -1.0, 1.0, 2.0];

/// Shapes to try where the shape is not known: coefficients, standard deviations, shape `[shapes][components]`.
pub fn sizes(model: &BodyModel) -> Vec<Vec<f64>> {
    let scaled = |&size: &f64| {
        let mut alpha = vec![0.0; model.num_components()];
        alpha.iter_mut().take(1).for_each(|first| *first = size);
        alpha
    };
    SIZES.iter().map(scaled).collect()
}

/// What starts are searched in.
pub struct Setting<'a> {
    pub model: &'a BodyModel,
    pub topology: &'a Topology,
    pub views: &'a [&'a Observation],
    /// centre of the hull's volume, metres
    pub centre: Vector3<f64>,
    /// shapes to try, shape `[shapes][components]`
    pub alphas: &'a [Vec<f64>],
}

/// A pose to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// shape `[dofs]`
    pub pose: Vec<f64>,
    /// one of the shapes tried, shape `[components]`
    pub alpha: Vec<f64>,
    /// mean distance between silhouettes, as a share of their height
    pub score: f64,
}

/// What a start is made of: indices into the tables.
#[derive(Debug, Clone, Copy)]
struct Choice {
    heading: usize,
    size: usize,
    /// left arm, right arm, left leg, right leg
    limbs: [usize; 4],
}

/// The best start of each of the best headings, the best first.
pub fn find_starts(setting: &Setting<'_>) -> Vec<Start> {
    let scorer = || Scorer::new(setting);
    let whole = |heading: usize| {
        WHOLE.map(|[arms, legs]| Choice { heading, size: 0, limbs: [arms, arms, legs, legs] })
    };
    let mut found: Vec<(f64, Choice)> = (0..HEADINGS)
        .into_par_iter()
        .map_init(scorer, |scorer, heading| best(scorer, &whole(heading)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(KEPT);
    let mut starts: Vec<Start> = found
        .into_par_iter()
        .map_init(scorer, |scorer, found| {
            let (score, choice) = by_limbs(scorer, found);
            Start { pose: scorer.place(choice), alpha: setting.alphas[choice.size].clone(), score }
        })
        .collect();
    starts.sort_by(|a, b| a.score.total_cmp(&b.score));
    starts
}

fn best(scorer: &mut Scorer<'_>, choices: &[Choice]) -> (f64, Choice) {
    choices.iter().fold((f64::INFINITY, choices[0]), |found, &choice| better(scorer, found, choice))
}

/// Tries every size and every pose of each limb with the others held, until nothing is better.
fn by_limbs(scorer: &mut Scorer<'_>, mut found: (f64, Choice)) -> (f64, Choice) {
    for _ in 0..ROUNDS {
        let before = found.0;
        for size in 0..scorer.shapes.len() {
            found = better(scorer, found, Choice { size, ..found.1 });
        }
        // legs carry more of the outline than arms do
        for limb in [2, 3, 0, 1] {
            for pose in 0..if limb < 2 { ARMS.len() } else { LEGS.len() } {
                let mut choice = found.1;
                choice.limbs[limb] = pose;
                found = better(scorer, found, choice);
            }
        }
        if found.0 == before {
            break;
        }
    }
    found
}

fn better(scorer: &mut Scorer<'_>, found: (f64, Choice), choice: Choice) -> (f64, Choice) {
    let score = scorer.score(choice);
    if score < found.0 { (score, choice) } else { found }
}

/// Draws starts; keeps its buffers.
struct Scorer<'a> {
    setting: &'a Setting<'a>,
    /// those of the setting
    shapes: Vec<Shape>,
    limbs: [[Option<usize>; 4]; 4],
    posed: Posed,
    rasteriser: Rasteriser,
    drawn: Vec<Silhouette>,
    chamfer: Chamfer,
}

impl<'a> Scorer<'a> {
    fn new(setting: &'a Setting<'a>) -> Self {
        let Setting { model, views, alphas, .. } = setting;
        let empty = |view: &&Observation| {
            let [width, height] = view.scoring.0.size;
            Silhouette::empty(width, height)
        };
        Self {
            setting,
            shapes: alphas.iter().map(|alpha| model.shape(alpha)).collect(),
            limbs: limb_dofs(model),
            posed: Posed::default(),
            rasteriser: Rasteriser::new(),
            drawn: views.iter().map(empty).collect(),
            chamfer: Chamfer::new(),
        }
    }

    /// The pose of a choice, its volume's centre where the hull's is; leaves the posed body.
    fn place(&mut self, choice: Choice) -> Vec<f64> {
        let Setting { model, centre, .. } = self.setting;
        let mut pose = vec![0.0; model.rig().num_dofs()];
        for (limb, &chosen) in choice.limbs.iter().enumerate() {
            let degrees = if limb < 2 { &ARMS[chosen] } else { &LEGS[chosen] };
            set_limb(&mut pose, &self.limbs[limb], degrees);
        }
        model.rig().clamp(&mut pose);
        let turn = TAU * choice.heading as f64 / HEADINGS as f64;
        pose[4] = if turn > TAU / 2.0 { turn - TAU } else { turn };
        self.shapes[choice.size].pose(model, &pose, &mut self.posed);
        let shift = centre - centroid(&self.posed.vertices, model.faces());
        pose[..3].copy_from_slice(shift.as_slice());
        self.posed.vertices.iter_mut().for_each(|vertex| *vertex += shift);
        pose
    }

    fn score(&mut self, choice: Choice) -> f64 {
        self.place(choice);
        let mut sum = 0.0;
        let Setting { topology, views, .. } = self.setting;
        for (view, drawn) in views.iter().zip(&mut self.drawn) {
            let (view, observed) = &view.scoring;
            let bounds = self.rasteriser.silhouette(view, &self.posed.vertices, topology, drawn);
            let height = observed.silhouette().bounds().map_or(1, |[_, top, _, bottom]| bottom - top);
            sum += self.chamfer.difference(drawn, bounds, observed).symmetric_px() / height as f64;
        }
        sum / views.len().max(1) as f64
    }
}
