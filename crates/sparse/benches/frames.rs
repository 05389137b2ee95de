//! How long a frame takes on one thread: search, regression, MAP and deviations, with the start. Recorded motion (31
//! thousand poses) where it is there, drawn motion otherwise; sizes are numbers of control points.

use std::ops::ControlFlow;

use divan::{Bencher, counter::ItemsCount};
use evaluation::control_trajectories;
use model::Motion;
use motion_db::{Clip, MotionDatabase, WindowIndex};
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Method, Parameters, Reconstructor, Session, control_points};

fn main() {
    divan::main();
}

const SIX: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
const FRAMES: usize = 120;

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

fn recorded() -> Option<Vec<Clip>> {
    let folder = testkit::shared::find("data/motion/five-actions", "frames")?;
    let clip = |row: testkit::shared::IndexRow| Clip {
        name: row.get("trial").to_owned(),
        subject: row.get("subject").to_owned(),
        action: row.get("action").to_owned(),
        motion: testkit::shared::trial(&folder, row.get("trial")),
    };
    Some(testkit::shared::index(&folder).into_iter().map(clip).collect())
}

/// All clips but one, and that one at 60 frames a second.
fn trial() -> Option<(Vec<Clip>, Motion)> {
    let mut clips = match recorded() {
        Some(clips) => clips,
        None => (0..40).map(drawn).collect::<Option<_>>()?,
    };
    let asked = clips.iter().position(|c| c.name == "35_15" || c.name == "20")?;
    let motion = clips.remove(asked).motion;
    let step = (motion.frame_rate() / 60.0).round() as usize;
    let values = motion.poses().step_by(step).take(FRAMES + 30).flatten().copied().collect();
    let motion = Motion::new(motion.skeleton().clone(), 60.0, values).ok()?;
    Some((clips, motion))
}

fn frames(bencher: Bencher, points: usize, method: Method) {
    let parameters = Parameters { method, start_candidates: 1, ..Parameters::default() };
    let Some((clips, truth)) = trial() else { return };
    let Ok(database) = MotionDatabase::build(&clips) else { return };
    let Ok(index) = WindowIndex::new(&database, parameters.window) else { return };
    let names = &SIX[..points];
    let Ok(trajectories) = control_trajectories(&truth, names) else { return };
    let Ok(points) = control_points(truth.skeleton(), names) else { return };
    let Ok(session) = Session::new(truth.skeleton().clone(), points, &trajectories) else { return };
    let Ok(reconstructor) = Reconstructor::new(&database, &index, &session, &parameters) else { return };
    let count = session.num_frames().min(FRAMES);
    bencher
        .counter(ItemsCount::new(count))
        .bench_local(|| reconstructor.reconstruct(0..count, &mut |_| ControlFlow::Continue(())).is_ok());
}

#[divan::bench(args = [2, 4, 6], sample_count = 10)]
fn local_regression(bencher: Bencher, points: usize) {
    frames(bencher, points, Method::LocalRegression);
}

#[divan::bench(args = [6], sample_count = 10)]
fn nearest(bencher: Bencher, points: usize) {
    frames(bencher, points, Method::Nearest);
}

/// What is done once a session: where its points would be in every pose.
#[divan::bench(args = [6], sample_count = 10)]
fn prepare(bencher: Bencher, points: usize) {
    let parameters = Parameters::default();
    let Some((clips, truth)) = trial() else { return };
    let Ok(database) = MotionDatabase::build(&clips) else { return };
    let Ok(index) = WindowIndex::new(&database, parameters.window) else { return };
    let Ok(trajectories) = control_trajectories(&truth, &SIX[..points]) else { return };
    let Ok(points) = control_points(truth.skeleton(), &SIX[..points]) else { return };
    let Ok(session) = Session::new(truth.skeleton().clone(), points, &trajectories) else { return };
    bencher.bench_local(|| Reconstructor::new(&database, &index, &session, &parameters).is_ok());
}
