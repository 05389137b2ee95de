//! The protocols on drawn motion.

use std::sync::Mutex;

use evaluation::{
    ControlSet, Error, Protocol, SparseEvaluation, Sweep, compare, evaluate_sparse, summarise, tables::table,
};
use model::Motion;
use motion_db::Clip;
use sample_motion::{Action, DrawOptions, Model};
use sparse::{Method, Parameters};

fn drawn(action: Action, subject: u64, seed: u64, frames: usize) -> Clip {
    let motion = Model::bundled().draw(action, seed, &DrawOptions { frames, subject }).unwrap();
    let name = format!("{subject}_{seed}");
    Clip { name, subject: subject.to_string(), action: action.to_string(), motion }
}

fn clips() -> Vec<Clip> {
    (0..8).map(|i| drawn([Action::Walk, Action::Run][i as usize % 2], i / 3, i, 120)).collect()
}

fn evaluate(protocol: Protocol, points: &[usize], methods: &[Method]) -> Vec<evaluation::TrialResult> {
    let clips = clips();
    let evaluation = SparseEvaluation {
        train: &clips,
        test: &clips[..3],
        protocol,
        sweep: Sweep::new(methods, points, Parameters::default()),
        max_frames: 60,
        threads: 2,
    };
    let seen = Mutex::new(Vec::new());
    let progress = |done, all| seen.lock().unwrap().push((done, all));
    let results = evaluate_sparse(&evaluation, &|| 0.0, &progress).unwrap();
    let mut seen = seen.into_inner().unwrap();
    seen.sort_unstable();
    assert_eq!(seen, (1..=results.len()).map(|i| (i, results.len())).collect::<Vec<_>>());
    results
}

#[test]
fn every_trial_is_evaluated_under_every_method_and_number_of_points() {
    let both = [Method::LocalRegression, Method::Nearest];
    let results = evaluate(Protocol::TrialOut, &[4, 6], &both);
    assert_eq!(results.len(), 2 * 2 * 3);
    for points in [4, 6] {
        for method in both {
            let in_case: Vec<_> =
                results.iter().filter(|r| r.case.points == points && r.case.method == method).collect();
            let names: Vec<_> = in_case.iter().map(|r| r.trial.as_str()).collect();
            assert_eq!(names, ["0_0", "0_1", "0_2"]);
            for r in in_case {
                let errors = r.comparison.errors;
                assert_eq!(errors.frames, 60);
                // Nothing of the trial itself was used: no error would be a sign that it was.
                assert!(errors.rms_deg > 0.5 && errors.rms_deg < 40.0, "{errors:?}");
                assert!(errors.mae_deg <= errors.rms_deg && errors.mpjpe_cm < 10.0, "{errors:?}");
            }
        }
    }
    let rows = summarise(&results, Protocol::TrialOut);
    // walk, run and all, of each method and number of points.
    assert_eq!(rows.len(), 2 * 2 * 3);
    assert!(rows.iter().filter(|r| r.action == "all").all(|r| r.trials == 3 && r.frames == 180));
    assert_eq!(table(&rows).lines().count(), 1 + rows.len());
}

/// A copy of the trial under another name is found by the papers' protocol, and not when the whole subject is left out.
#[test]
fn without_the_subject_not_even_a_copy_is_found() {
    let mut clips = clips();
    let copy = Clip { name: "copy".to_owned(), ..clips[0].clone() };
    clips.push(copy);
    let error = |protocol| {
        let evaluation = SparseEvaluation {
            train: &clips,
            test: &clips[..1],
            protocol,
            sweep: Sweep::new(&[Method::LocalRegression], &[6], Parameters::default()),
            max_frames: 60,
            threads: 1,
        };
        evaluate_sparse(&evaluation, &|| 0.0, &|_, _| {}).unwrap()[0].comparison.errors.rms_deg
    };
    let (with_copy, without) = (error(Protocol::TrialOut), error(Protocol::SubjectOut));
    assert!(with_copy < 1.0 && without > 3.0, "{with_copy} and {without} degrees");
}

#[test]
fn sets_of_points_are_the_papers() {
    assert_eq!(ControlSet::names(2), Some(&["left_wrist", "right_ankle"][..]));
    assert_eq!(ControlSet::names(6).map(<[_]>::len), Some(6));
    assert_eq!((ControlSet::names(1), ControlSet::names(7)), (None, None));
    let clips = clips();
    let evaluation = SparseEvaluation {
        train: &clips,
        test: &clips[..1],
        protocol: Protocol::TrialOut,
        sweep: Sweep::new(&[Method::Nearest], &[7], Parameters::default()),
        max_frames: 60,
        threads: 1,
    };
    let error = evaluate_sparse(&evaluation, &|| 0.0, &|_, _| {}).unwrap_err();
    assert_eq!(error, Error::Points { found: 7 });
}

#[test]
fn a_motion_has_no_error_against_itself_and_whole_turns_are_none() {
    let motion = drawn(Action::Walk, 0, 1, 30).motion;
    let same = compare(&motion, &motion);
    assert!(same.rms_deg < 1e-12 && same.mpjpe_cm < 1e-12 && same.geodesic_deg < 1e-6, "{same:?}");
    let mut values = motion.values().to_vec();
    for (i, pose) in values.chunks_exact_mut(62).enumerate() {
        for (d, v) in pose.iter_mut().enumerate().skip(3) {
            *v += std::f64::consts::TAU * (((i + d) % 5) as f64 - 2.0);
        }
    }
    let turned = Motion::new(motion.skeleton().clone(), 60.0, values).unwrap();
    let errors = compare(&motion, &turned);
    assert!(errors.rms_deg < 1e-9 && errors.mpjpe_cm < 1e-9 && errors.geodesic_deg < 1e-5, "{errors:?}");
}
