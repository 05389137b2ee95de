//! Draws the README's picture: a synthetic walk, its six control points, and what is reconstructed from them.
//!
//! `cargo run --release -p evaluation --example picture -- docs/pictures/points-to-body.svg`

use std::{error::Error, ops::ControlFlow};

use evaluation::{ControlSet, Picture, compare, control_trajectories};
use motion_db::{Clip, MotionDatabase, WindowIndex};
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Parameters, Reconstructor, Session, control_points};

const FRAMES: usize = 160;

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

    let caption = format!(
        "six measured points (red), the motion found (blue) and the true one (grey), a synthetic walk that is not in the \
         database: {:.1}° RMS, {:.1} cm",
        errors.rms_deg, errors.mpjpe_cm
    );
    let svg = Picture { truth: &truth, found: &found, points: &points, caption: &caption }.svg();
    std::fs::write(&out, svg)?;
    println!("{out}: {:.2}° RMS, {:.2} cm", errors.rms_deg, errors.mpjpe_cm);
    Ok(())
}
