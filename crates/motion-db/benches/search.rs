//! How long one search takes, exact and fast, by the number of poses: recorded motion where it is there (31 thousand poses),
//! drawn motion otherwise.

use divan::Bencher;
use kinematics::{PointSet, control_points};
use motion_db::{Clip, ControlTable, HeadingFrame, MotionDatabase, Query, Scratch, WindowIndex};
use nalgebra::Vector3;
use sample_motion::{Action, DrawOptions, Model};

fn main() {
    divan::main();
}

fn recorded() -> Option<Vec<Clip>> {
    let folder = testkit::shared::find("data/motion/five-actions", "search")?;
    let clip = |row: testkit::shared::IndexRow| Clip {
        name: row.get("trial").to_owned(),
        subject: row.get("subject").to_owned(),
        action: row.get("action").to_owned(),
        motion: testkit::shared::trial(&folder, row.get("trial")),
    };
    Some(testkit::shared::index(&folder).into_iter().map(clip).collect())
}

fn drawn(seed: u64) -> Option<Clip> {
    let options = DrawOptions { frames: 400, subject: seed % 9 };
    let action = Action::ALL[seed as usize % 4];
    let motion = Model::bundled().draw(action, seed, &options).ok()?;
    Some(Clip {
        name: seed.to_string(),
        subject: options.subject.to_string(),
        action: action.to_string(),
        motion,
    })
}

/// A database of about `poses` poses, without the clips of the motion that asks: the last one.
fn database(poses: usize) -> Option<MotionDatabase> {
    let mut clips = match recorded() {
        Some(clips) => clips,
        None => (0..80).map(drawn).collect::<Option<_>>()?,
    };
    let mut left = poses as f64;
    clips.retain(|c| {
        let frames = c.motion.num_frames() as f64 * 60.0 / c.motion.frame_rate();
        left -= frames;
        left >= 0.0
    });
    MotionDatabase::build(&clips).ok()
}

/// One frame after the other of a walk that the database does not hold, the last matches' successors as hints.
fn search(bencher: Bencher, poses: usize, with_controls: bool, fast: bool) {
    let Some(database) = database(poses) else { return };
    let Ok(index) = WindowIndex::new(&database, 2) else { return };
    let Some(asked) = drawn(1_000) else { return };
    let skeleton = asked.motion.skeleton();
    let kinematics = database.kinematics(skeleton);
    let names = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
    let Ok(points) = control_points(skeleton, &names) else { return };
    let points = PointSet::new(&kinematics, points);
    let table = ControlTable::new(&database, &index, skeleton, &kinematics, &points, &[], &[]);
    let mut weights = [1.0f32; 19];
    weights[18] = 4.0;
    let coordinates = motion_db::resample(&asked.motion, database.parametrisation());
    let frames: Vec<&[f64]> = coordinates.chunks_exact(62).collect();
    let mut state = kinematics.state();
    let mut positions = vec![Vector3::zeros(); 6];
    let (mut scratch, mut features) = (vec![0.0; index.width()], vec![0.0; index.width()]);
    let questions: Vec<(Vec<f32>, Vec<f32>)> = (2..frames.len())
        .map(|t| {
            index.query_features(&[frames[t - 1], frames[t - 2]], &mut scratch, &mut features);
            points.positions(&kinematics, frames[t], &mut state, &mut positions);
            let frame = HeadingFrame::from_coordinates(frames[t - 1]);
            let local = positions.iter().flat_map(|p| {
                let local: [f64; 3] = (frame.local_from_world(p) * 100.0).into();
                local.map(|v| v as f32)
            });
            (features.iter().map(|v| *v as f32).collect(), local.chain([0.0]).collect())
        })
        .collect();
    let (mut memory, mut found, mut hints) = (Scratch::default(), Vec::new(), Vec::new());
    let mut t = 0;
    bencher.bench_local(|| {
        t = (t + 1) % questions.len();
        let (features, controls) = &questions[t];
        let controls = with_controls.then_some((&table, &controls[..], &weights[..]));
        let query = Query { features, controls, exclude: &[], hints: &hints };
        if fast {
            index.nearest_fast(&query, 64, &mut memory, &mut found);
        } else {
            index.nearest(&query, 64, &mut memory, &mut found);
        }
        hints.clear();
        hints.extend(found.iter().map(|n| n.row + 1));
        hints.sort_unstable();
    });
}

#[divan::bench(args = [8_000, 31_000])]
fn nearest_64_windows(bencher: Bencher, poses: usize) {
    search(bencher, poses, false, false);
}

#[divan::bench(args = [8_000, 31_000])]
fn nearest_64_windows_and_control_points(bencher: Bencher, poses: usize) {
    search(bencher, poses, true, false);
}

#[divan::bench(args = [8_000, 31_000])]
fn nearly_all_of_the_nearest_64_windows(bencher: Bencher, poses: usize) {
    search(bencher, poses, false, true);
}

#[divan::bench(args = [8_000, 31_000])]
fn nearly_all_of_the_nearest_64_windows_and_control_points(bencher: Bencher, poses: usize) {
    search(bencher, poses, true, true);
}
