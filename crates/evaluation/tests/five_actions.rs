//! Guards the accuracy on recorded motion: bounds stand a little above what was measured.

use std::path::Path;

use evaluation::{Protocol, SparseEvaluation, Sweep, TrialResult, evaluate_sparse};
use motion_db::Clip;
use sparse::{Method, Parameters};

fn load(folder: &Path) -> Vec<Clip> {
    let clip = |row: testkit::shared::IndexRow| Clip {
        name: row.get("trial").to_owned(),
        subject: row.get("subject").to_owned(),
        action: row.get("action").to_owned(),
        motion: testkit::shared::trial(folder, row.get("trial")),
    };
    testkit::shared::index(folder).into_iter().map(clip).collect()
}

struct Means {
    rms_deg: f64,
    mae_deg: f64,
    mpjpe_cm: f64,
}

/// Means over the trials of one method and number of points, and their table.
fn means(results: &[TrialResult], method: Method, points: usize) -> Means {
    let in_case: Vec<_> =
        results.iter().filter(|r| r.case.method == method && r.case.points == points).collect();
    let mean = |value: &dyn Fn(&TrialResult) -> f64| {
        in_case.iter().map(|r| value(r)).sum::<f64>() / in_case.len() as f64
    };
    let found = Means {
        rms_deg: mean(&|r| r.comparison.errors.rms_deg),
        mae_deg: mean(&|r| r.comparison.errors.mae_deg),
        mpjpe_cm: mean(&|r| r.comparison.errors.mpjpe_cm),
    };
    let Means { rms_deg, mae_deg, mpjpe_cm } = found;
    println!("{method}, {points} points: RMS {rms_deg:.3}, MAE {mae_deg:.3} degrees, {mpjpe_cm:.3} cm");
    found
}

fn evaluate(clips: &[Clip], protocol: Protocol, points: &[usize], methods: &[Method]) -> Vec<TrialResult> {
    let mut all: Vec<&Clip> =
        clips.iter().filter(|c| ["walk", "run", "jump"].contains(&c.action.as_str())).collect();
    all.sort_by(|a, b| a.name.cmp(&b.name));
    // Every third trial, from the first on, is for tuning: these are others.
    let test: Vec<Clip> = all.into_iter().skip(4).step_by(6).cloned().collect();
    assert_eq!(test.len(), 23);
    let evaluation = SparseEvaluation {
        train: clips,
        test: &test,
        protocol,
        sweep: Sweep::new(methods, points, Parameters::default()),
        max_frames: 120,
        threads: 2,
    };
    evaluate_sparse(&evaluation, &|| 0.0, &|_, _| {}).unwrap()
}

#[test]
fn recorded_trials_are_reconstructed_as_well_as_before() {
    let test = "recorded_trials_are_reconstructed_as_well_as_before";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let clips = load(&folder);
    let (local, nearest) = (Method::LocalRegression, Method::Nearest);
    let results = evaluate(&clips, Protocol::TrialOut, &[4, 6], &[local, nearest]);
    for (points, rms, mae, cm) in [(6, 3.4, 2.0, 0.72), (4, 3.8, 2.3, 1.85)] {
        let found = means(&results, local, points);
        assert!(found.rms_deg < rms, "{points} points: {} degrees RMS", found.rms_deg);
        assert!(found.mae_deg < mae, "{points} points: {} degrees mean", found.mae_deg);
        assert!(found.mpjpe_cm < cm, "{points} points: {} cm", found.mpjpe_cm);
        let plain = means(&results, nearest, points);
        assert!(found.rms_deg < plain.rms_deg && found.mae_deg < plain.mae_deg, "{points} points");
    }
    let results = evaluate(&clips, Protocol::SubjectOut, &[6], &[local]);
    let found = means(&results, local, 6);
    assert!(found.rms_deg < 8.8, "subject out: {} degrees RMS", found.rms_deg);
    assert!(found.mpjpe_cm < 1.45, "subject out: {} cm", found.mpjpe_cm);
}
