//! What pictures of a textured body tell beyond its silhouettes.

mod following;
mod moving;
#[path = "../../body/tests/scans/mod.rs"]
mod scans;
mod textured;

use body::{BodyModel, Posed, Shape};
use features::FrameMatcher;
use following::follow;
use model::{Camera, PointMatch};
use moving::{Views, cameras, distances, mixed, pose, seen};
use nalgebra::{Vector2, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use tracking::{Chunk, Options, Seen, Stage, Tracker};
use vision::Topology;

/// Everything that is seen of a motion.
struct Film {
    /// of every frame
    views: Vec<Views>,
    /// true joints, metres, shape `[frames][joints]`
    joints: Vec<Vec<Vector3<f64>>>,
    /// shape `[cameras][frames]`
    matches: Vec<Vec<Vec<PointMatch>>>,
}

fn film(model: &BodyModel, shape: &Shape, motion: &[Vec<f64>], cameras: &[Camera]) -> Film {
    let topology = Topology::new(model.faces(), model.num_vertices());
    let (views, joints): (Vec<_>, Vec<_>) =
        motion.iter().map(|pose| seen(model, shape, pose, cameras)).unzip();
    let from_camera = |index: usize| {
        let mut matcher = FrameMatcher::new(features::Options::default());
        let mut from_frame = |(frame, pose): (usize, &Vec<f64>)| {
            let mut posed = Posed::default();
            shape.pose(model, pose, &mut posed);
            let image = textured::picture(model, shape, &posed, &topology, &cameras[index]);
            let views: &Views = &views[frame];
            matcher.push(&image, &views[index].1)
        };
        motion.iter().enumerate().map(&mut from_frame).collect()
    };
    let matches = (0..cameras.len()).into_par_iter().map(from_camera).collect();
    Film { views, joints, matches }
}

impl Film {
    /// Follows it with a share of the matches spoiled; without pictures for `None`.
    fn follow(&self, model: &BodyModel, alpha: &[f64], start: &[f64], spoiled: Option<f64>) -> Chunk {
        let mut tracker = Tracker::new(model, alpha, start, Options::default()).unwrap();
        follow(&mut tracker, start, 0, &self.seen(spoiled), |_| ())
    }

    fn seen(&self, spoiled: Option<f64>) -> Vec<Seen> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut spoil = |mut matches: Vec<PointMatch>, share: f64| {
            for found in &mut matches {
                if random.random::<f64>() < share {
                    let mut far = || 120.0 * random.random::<f64>() - 60.0;
                    found.now += Vector2::new(far(), far());
                }
            }
            matches
        };
        let frame = |(index, views): (usize, &Views)| {
            let of_camera = |matches: &Vec<Vec<PointMatch>>| Some(spoil(matches[index].clone(), spoiled?));
            Seen { views: views.clone(), matches: self.matches.iter().filter_map(of_camera).collect() }
        };
        self.views.iter().enumerate().map(frame).collect()
    }

    /// Mean and largest joint error, metres.
    fn errors(&self, chunk: &Chunk) -> [f64; 2] {
        let (mut sum, mut worst) = (0.0, 0.0f64);
        for (tracked, truth) in chunk.frames.iter().zip(&self.joints) {
            sum += distances(&tracked.joints, truth).sum::<f64>() / (truth.len() * self.joints.len()) as f64;
            worst = worst.max(distances(&tracked.joints, truth).fold(0.0, f64::max));
        }
        [sum, worst]
    }
}

/// Root mean square angle between found and true rotations of some joints against their parents, degrees. Angles of DOFs don't
/// serve: where an arm is stretched to the side, flexing turns it as twisting does.
fn off(model: &BodyModel, chunk: &Chunk, motion: &[Vec<f64>], joints: &[usize]) -> f64 {
    let shape = model.shape(&[]);
    let rotations = |pose: &[f64]| {
        let mut posed = Posed::default();
        shape.pose_joints(model, pose, &mut posed);
        joints.iter().map(|&joint| posed.parent_from_joint(model, joint)).collect::<Vec<_>>()
    };
    let squares = chunk.frames.iter().zip(motion).flat_map(|(tracked, truth)| {
        let pairs = rotations(&tracked.pose).into_iter().zip(rotations(truth));
        pairs.map(|(a, b)| a.angle_to(&b).to_degrees().powi(2)).collect::<Vec<_>>()
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// Arms folded before the belly, where they swing inside the silhouette.
fn folded(model: &BodyModel, frames: usize) -> Vec<Vec<f64>> {
    let dof = |name: &str| model.rig().dof_index(name).unwrap();
    let at = |frame: usize| {
        let mut pose = pose(model, 0.4, [0, 0, 0, 0]);
        let turn = 0.5 - 0.5 * (std::f64::consts::TAU * frame as f64 / frames as f64).cos();
        for (side, most) in [("l", 0.6), ("r", 0.5)] {
            pose[dof(&format!("{side}_shoulder_abd"))] = -0.35;
            pose[dof(&format!("{side}_shoulder_flex"))] = 0.2;
            pose[dof(&format!("{side}_elbow"))] = 1.1 + 0.3 * turn;
            pose[dof(&format!("{side}_shoulder_twist"))] = -0.5 - most * turn;
        }
        pose
    };
    (0..frames).map(at).collect()
}

#[test]
fn forearms_that_swing_before_the_belly_are_seen_in_the_texture_alone() {
    let model = BodyModel::shipped();
    let alpha = [0.5, -0.4, 0.3];
    let joints = ["l_shoulder", "r_shoulder"]
        .map(|name| model.rig().joints().iter().position(|joint| joint.name == name).unwrap());
    let motion = folded(&model, 20);
    // both from the front
    let film = film(&model, &model.shape(&alpha), &motion, &cameras(8)[..2]);
    let figures = [None, Some(0.0), Some(0.3)].map(|share| {
        let chunk = film.follow(&model, &alpha, &motion[0], share);
        let degrees = off(&model, &chunk, &motion, &joints);
        let [mean, worst] = film.errors(&chunk).map(|error| 1000.0 * error);
        println!(
            "spoiled {share:?}: shoulders {degrees:.1} degrees off, joints {mean:.1} mm, worst {worst:.1} mm"
        );
        [degrees, worst]
    });
    let [without, with, spoiled] = figures;
    assert!(with[0] < 4.0 && with[0] < 0.5 * without[0] && with[1] < 0.5 * without[1], "{figures:?}");
    assert!(
        spoiled[0] < 5.0 && spoiled[0] < 0.5 * without[0] && spoiled[1] < 0.5 * without[1],
        "{figures:?}"
    );
}

#[test]
fn texture_follows_a_scanned_person_no_worse_than_silhouettes() {
    let test = "texture_follows_a_scanned_person_no_worse_than_silhouettes";
    let Some(bodies) = testkit::shared::find("data/bodies", test) else { return };
    let data = scans::Scans::read(&bodies);
    let model = BodyModel::shipped();
    let subject = 60;
    let shape = scans::shape_of(&model, &data.scans[subject]);
    let motion = mixed(&model, 5);
    let film = film(&model, &shape, &motion, &cameras(4));
    let fit = shape_fit::fit(&model, &film.views[0], &shape_fit::Options::default()).unwrap();
    let figures = [None, Some(0.0), Some(0.3)].map(|share| {
        let chunk = film.follow(&model, &fit.alpha, &fit.pose, share);
        let local = chunk.frames.iter().filter(|tracked| tracked.stage == Stage::Local).count();
        let [mean, worst] = film.errors(&chunk);
        println!(
            "subject {subject}, spoiled {share:?}: {:.1} mm, worst {:.1} mm, {local} locally",
            1e3 * mean,
            1e3 * worst
        );
        mean
    });
    assert!(figures[1] < 1.1 * figures[0] && figures[2] < 1.15 * figures[0], "{figures:?}");
}
