//! Drawn motion beside the recorded motion that the model was learned from: as far from it as recorded trials are from
//! each other, neither copied nor out of this world.

use std::path::Path;

use kinematics::{Parametrisation, References};
use model::Motion;
use sample_motion::{Action, DrawOptions, LabelledMotion, Model};

fn recorded(folder: &Path, wanted: impl Fn(&str) -> bool) -> Vec<LabelledMotion> {
    let rows = testkit::shared::index(folder).into_iter().filter(|row| wanted(row.get("action")));
    rows.map(|row| LabelledMotion {
        name: row.get("trial").to_owned(),
        subject: row.get("subject").to_owned(),
        action: row.get("action").parse().unwrap(),
        motion: testkit::shared::trial(folder, row.get("trial")),
    })
    .collect()
}

/// Joint coordinates (radians, fingers and thumbs left out) of every n-th frame: 12 a second.
fn postures(motion: &Motion) -> Vec<Vec<f64>> {
    let skeleton = motion.skeleton();
    let smooth = Parametrisation::smooth(skeleton, &References::rest(skeleton)).unwrap();
    let ignored = ["fingers", "thumb", "hand", "wrist"];
    let kept: Vec<usize> = (1..skeleton.num_joints())
        .filter(|&j| !ignored.iter().any(|i| skeleton.joints()[j].name.ends_with(i)))
        .flat_map(|j| skeleton.dofs(j))
        .collect();
    let mut x = vec![0.0; skeleton.num_dofs()];
    let every = (motion.frame_rate() / 12.0).round() as usize;
    (0..motion.num_frames())
        .step_by(every)
        .map(|frame| {
            smooth.coordinates_from_pose(skeleton, motion.pose(frame), 0.0, &mut x);
            kept.iter().map(|&dof| x[dof]).collect()
        })
        .collect()
}

/// How far the postures of one motion are from the nearest of another, RMS over joints, mean over frames, degrees.
fn distance(from: &[Vec<f64>], to: &[Vec<f64>]) -> f64 {
    let nearest = |p: &Vec<f64>| {
        let squares =
            to.iter().map(|q| p.iter().zip(q).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / p.len() as f64);
        squares.fold(f64::INFINITY, f64::min).sqrt()
    };
    (from.iter().map(nearest).sum::<f64>() / from.len() as f64).to_degrees()
}

fn nearest(from: &[Vec<f64>], others: &[&Vec<Vec<f64>>]) -> f64 {
    others.iter().map(|to| distance(from, to)).fold(f64::INFINITY, f64::min)
}

#[test]
fn drawn_trials_are_as_far_from_recorded_ones_as_those_from_each_other() {
    let test = "drawn_trials_are_as_far_from_recorded_ones_as_those_from_each_other";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    for action in Action::ALL {
        let trials = recorded(&folder, |a| a == action.name());
        let mut postures_of: Vec<(&str, Vec<Vec<f64>>)> = Vec::new();
        for trial in &trials {
            let all = postures(&trial.motion);
            // Boxing is two long trials: their blocks of eight seconds stand for trials.
            let block = if action == Action::Boxing { 96 } else { all.len() };
            postures_of.extend(all.chunks(block).map(|c| (trial.subject.as_str(), c.to_vec())));
        }
        let (mut to_any, mut to_stranger) = (Vec::new(), Vec::new());
        for (i, (subject, from)) in postures_of.iter().enumerate() {
            let others: Vec<_> =
                postures_of.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, o)| o).collect();
            let strangers: Vec<_> = others.iter().filter(|o| o.0 != *subject).map(|o| &o.1).collect();
            to_any.push(nearest(from, &others.iter().map(|o| &o.1).collect::<Vec<_>>()));
            to_stranger.push(nearest(from, &strangers));
        }
        let real: Vec<_> = postures_of.iter().map(|p| &p.1).collect();
        let drawn: Vec<_> = (0..16)
            .map(|seed| {
                postures(
                    &Model::bundled()
                        .draw(action, seed, &DrawOptions { frames: 240, subject: seed % 8 })
                        .unwrap(),
                )
            })
            .collect();
        let mut to_real: Vec<f64> = drawn.iter().map(|d| nearest(d, &real)).collect();
        let mut to_drawn: Vec<f64> = (0..drawn.len())
            .map(|i| {
                let others: Vec<_> =
                    drawn.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, d)| d).collect();
                nearest(&drawn[i], &others)
            })
            .collect();
        let show = |what: &str, values: &mut Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let (least, most) = (values[0], values[values.len() - 1]);
            println!("{action}: {what}: {least:.1} … {:.1} … {most:.1}°", values[values.len() / 2]);
        };
        show("recorded to nearest recorded", &mut to_any);
        show("recorded to nearest of another subject", &mut to_stranger);
        show("drawn to nearest recorded", &mut to_real);
        show("drawn to nearest drawn", &mut to_drawn);
        let median = |values: &[f64]| values[values.len() / 2];
        assert!(
            to_real[0] >= to_any[0],
            "{action}: a drawn trial is nearer to a recorded one than recorded ones are"
        );
        assert!(
            median(&to_real) <= 1.5 * median(&to_stranger),
            "{action}: drawn trials are too far from recorded ones"
        );
        assert!(median(&to_drawn) >= to_any[0], "{action}: drawn trials hardly differ");
    }
}

#[test]
fn learning_from_the_recorded_trials_gives_the_bundled_model() {
    let test = "learning_from_the_recorded_trials_gives_the_bundled_model";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let mut motions = recorded(&folder, |action| action.parse::<Action>().is_ok());
    motions.sort_by(|a, b| a.name.cmp(&b.name));
    let learned = Model::learn(&motions).unwrap();
    assert_eq!(learned.summary(), Model::bundled().summary());
    let options = DrawOptions { frames: 60, subject: 0 };
    for action in Action::ALL {
        let (a, b) =
            (learned.draw(action, 0, &options).unwrap(), Model::bundled().draw(action, 0, &options).unwrap());
        let farthest = a.values().iter().zip(b.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(farthest < 1e-3, "{action}: differs by {farthest}");
    }
}

#[test]
fn a_model_needs_enough_motion() {
    let test = "a_model_needs_enough_motion";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let boxing = recorded(&folder, |action| action == "boxing");
    let mut short = boxing[0].clone();
    let skeleton = short.motion.skeleton().clone();
    short.motion = Motion::new(skeleton, 120.0, short.motion.values()[..62 * 240].to_vec()).unwrap();
    let error = Model::learn(&[short]).unwrap_err();
    assert!(error.to_string().contains("punch in 1 motions"), "{error}");
    assert_eq!(Model::learn(&[]).unwrap_err(), sample_motion::Error::NoMotions);
}

#[test]
fn a_skeleton_that_is_not_of_cmu_is_refused_by_name() {
    let root = model::Joint::root("hips", vec![model::Channel::translation(model::Axis::Y)]);
    let skeleton = model::Skeleton::new("stick", vec![root]).unwrap();
    let motion = Motion::new(skeleton.into(), 60.0, vec![0.0; 100]).unwrap();
    let stick =
        LabelledMotion { name: "stick_01".into(), subject: "stick".into(), action: Action::Walk, motion };
    let error = Model::learn(std::slice::from_ref(&stick)).unwrap_err().to_string();
    assert_eq!(error, "motion stick_01: skeleton has 1 DOFs, expected 62");
    let walk = Model::bundled().draw(Action::Walk, 0, &DrawOptions::default()).unwrap();
    let drawn =
        LabelledMotion { name: "drawn".into(), subject: "s".into(), action: Action::Walk, motion: walk };
    let error = Model::learn(&[drawn, stick]).unwrap_err().to_string();
    assert!(error.starts_with("motion stick_01: skeleton has not the joints"), "{error}");
}

#[test]
fn a_model_can_be_learned_from_drawn_motion() {
    let draw = |seed| {
        let motion = Model::bundled().draw(Action::Walk, seed, &DrawOptions { frames: 360, subject: seed });
        let (name, subject) = (format!("drawn {seed}"), format!("{seed}"));
        LabelledMotion { name, subject, action: Action::Walk, motion: motion.unwrap() }
    };
    let model = Model::learn(&(0..6).map(draw).collect::<Vec<_>>()).unwrap();
    let again = model.draw(Action::Walk, 1, &DrawOptions::default()).unwrap();
    let from = postures(&Model::bundled().draw(Action::Walk, 1, &DrawOptions::default()).unwrap());
    assert!(distance(&postures(&again), &from) < 8.0);
    assert!(model.draw(Action::Run, 1, &DrawOptions::default()).is_err());
}
