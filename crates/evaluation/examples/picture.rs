//! Draws the README's picture: a synthetic walk, its six control points, and what is reconstructed from them.
//!
//! `cargo run --release -p evaluation --example picture -- docs/picture.svg`

use std::{error::Error, fmt::Write, ops::ControlFlow};

use evaluation::{ControlSet, compare, control_trajectories};
use kinematics::{Kinematics, Parametrisation};
use model::Motion;
use motion_db::{Clip, MotionDatabase, WindowIndex};
use nalgebra::Vector3;
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Parameters, Reconstructor, Session, control_points};

const FRAMES: usize = 160;
const PIXELS_PER_METRE: f64 = 150.0;
/// distance between the drawn figures beyond what was walked, metres
const SPREAD: f64 = 0.35;

fn main() -> Result<(), Box<dyn Error>> {
    let out = std::env::args().nth(1).ok_or("usage: picture OUT.svg")?;
    let model = Model::bundled();
    let draw = |seed, subject| model.draw(Action::Walk, seed, &DrawOptions { frames: FRAMES, subject });
    let mut clips = Vec::new();
    for seed in 1..=12 {
        let (name, subject) = (format!("synthetic{}_{seed:02}", seed % 4), (seed % 4).to_string());
        clips.push(Clip { name, subject, action: "walk".to_owned(), motion: draw(seed, seed % 4)? });
    }
    let truth = draw(99, 1)?;
    let database = MotionDatabase::build(&clips)?;
    let parameters = Parameters::default();
    let index = WindowIndex::new(&database, parameters.window)?;
    let names = ControlSet::names(6).ok_or("no set of six points")?;
    let points = control_trajectories(&truth, names)?;
    let skeleton = truth.skeleton().clone();
    let session = Session::new(skeleton.clone(), control_points(&skeleton, names)?, &points)?;
    let reconstructor = Reconstructor::new(&database, &index, &session, &parameters)?;
    let whole = reconstructor.reconstruct(0..FRAMES, &mut |_| ControlFlow::Continue(()))?;
    let found = sparse::merge(&database, &session, &parameters, &[whole])?.motion;
    let errors = compare(&truth, &found);

    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1000\" height=\"360\" font-family=\"sans-serif\">\n\
         <rect width=\"1000\" height=\"360\" fill=\"#fff\"/>\n<path d=\"M20 320H980\" stroke=\"#ccc\"/>\n",
    );
    // Seen from the side: along the direction walked.
    let (first, last) = (position(&truth, 0), position(&truth, FRAMES - 1));
    let way = Vector3::new(last.x - first.x, 0.0, last.z - first.z);
    let along = way.normalize();
    let frames: Vec<usize> = (0..7).map(|i| i * (FRAMES - 1) / 6).collect();
    let length = way.norm() + SPREAD * 6.0;
    let left = 500.0 - length * PIXELS_PER_METRE / 2.0;
    for (i, &frame) in frames.iter().enumerate() {
        let project = |p: Vector3<f64>| {
            let x = (p - first).dot(&along) + SPREAD * i as f64;
            (left + x * PIXELS_PER_METRE, 320.0 - p.y * PIXELS_PER_METRE)
        };
        figure(&mut svg, &truth, frame, "#bbb", 9.0, &project)?;
        figure(&mut svg, &found, frame, "#1c6dd0", 3.0, &project)?;
        for p in points.frame(frame) {
            let (x, y) = project(*p);
            writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#e8442e\"/>")?;
        }
    }
    writeln!(
        svg,
        "<text x=\"20\" y=\"346\" font-size=\"14\" fill=\"#444\">six measured points (red), the motion found \
         (blue) and the true one (grey), a synthetic walk that is not in the database: {:.1}° RMS, {:.1} cm</text>\n</svg>",
        errors.rms_deg, errors.mpjpe_cm
    )?;
    std::fs::write(&out, svg)?;
    println!("{out}: {:.2}° RMS, {:.2} cm", errors.rms_deg, errors.mpjpe_cm);
    Ok(())
}

fn position(motion: &Motion, frame: usize) -> Vector3<f64> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    kinematics.update(motion.pose(frame), &mut state);
    state.positions[0]
}

/// Draws the bones of one pose.
fn figure(
    svg: &mut String,
    motion: &Motion,
    frame: usize,
    colour: &str,
    width: f64,
    project: &dyn Fn(Vector3<f64>) -> (f64, f64),
) -> Result<(), std::fmt::Error> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    kinematics.update(motion.pose(frame), &mut state);
    for (j, joint) in skeleton.joints().iter().enumerate() {
        let ((x1, y1), (x2, y2)) = (project(state.positions[j]), project(state.point(j, &joint.tip)));
        writeln!(
            svg,
            "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"
        )?;
    }
    Ok(())
}
