//! Samples that say how sure they are.

mod fixtures;

use fixtures::{Recorded, SIX, changed, drawn, session, walks_and_runs};
use model::PointTrajectories;
use nalgebra::Vector3;
use sample_motion::Action;
use sparse::{Parameters, Session};

/// The left wrist shakes by this much, metres.
const SHAKE: f64 = 0.06;

/// A shake that is the same each time: the fraction of a product with the golden ratio, -1 to 1.
fn shake(frame: usize, axis: usize) -> f64 {
    2.0 * ((frame * 3 + axis) as f64 * 0.618_033_988_749_895).fract() - 1.0
}

fn with_sigmas(session: &Session, sigma: impl Fn(usize, usize) -> f64) -> Session {
    let t = &session.trajectories;
    let sigmas = (0..t.num_frames()).flat_map(|f| (0..t.num_points()).map(move |p| (f, p)));
    let sigmas = sigmas.map(|(f, p)| sigma(f, p)).collect();
    Session { trajectories: t.clone().with_sigmas(sigmas).unwrap(), ..session.clone() }
}

#[test]
fn a_shaking_point_that_says_so_does_less_harm() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = &drawn(Action::Walk, 1, 102, 180).motion;
    let shaken = changed(&session(truth, &SIX), |f, p, v| {
        if p == 0 { v + Vector3::from_fn(|axis, _| SHAKE * shake(f, axis)) } else { v }
    });
    let parameters = Parameters::default();
    let distance = |session: &Session| {
        let found = recorded.reconstruct(session, &parameters);
        evaluation::compare(truth, &recorded.motion(session, &found)).mpjpe_cm
    };
    let exact = distance(&session(truth, &SIX));
    let silent = distance(&shaken);
    let said = distance(&with_sigmas(&shaken, |_, p| if p == 0 { SHAKE / 3.0_f64.sqrt() } else { f64::NAN }));
    let without = distance(&changed(&shaken, |_, p, v| if p == 0 { Vector3::repeat(f64::NAN) } else { v }));
    println!("exact: {exact:.2}; shaking point: {silent:.2} cm; said so: {said:.2}; left out: {without:.2}");
    assert!(said < 0.7 * silent, "{said} cm, {silent} without a standard deviation");
    assert!(said < without, "{said} cm, {without} without the point");
}

#[test]
fn a_default_that_is_said_changes_nothing_and_an_endless_one_is_no_measurement() {
    let recorded = Recorded::new(&walks_and_runs());
    let whole = session(&drawn(Action::Walk, 1, 102, 180).motion, &SIX);
    let parameters = Parameters::default();
    let plain = recorded.reconstruct(&whole, &parameters);
    let said = recorded.reconstruct(&with_sigmas(&whole, |_, _| parameters.control_sigma_m), &parameters);
    assert_eq!(plain, said);
    let far =
        recorded.reconstruct(&with_sigmas(&whole, |_, p| [1e300, 1e-300][usize::from(p > 0)]), &parameters);
    assert!(far.coordinates.iter().all(|v| v.is_finite()));
}

#[test]
fn standard_deviations_follow_the_samples_to_another_rate() {
    let whole = session(&drawn(Action::Walk, 1, 102, 180).motion, &SIX);
    let at = |rate: f64, sigma: &dyn Fn(usize) -> f64| {
        let t = &whole.trajectories;
        let sigmas = (0..t.num_frames()).flat_map(|f| (0..6).map(move |_| sigma(f))).collect();
        let positions = (0..t.num_frames()).flat_map(|f| t.frame(f)).copied().collect();
        let t =
            PointTrajectories::new(t.names().to_vec(), rate, positions).unwrap().with_sigmas(sigmas).unwrap();
        Session::new(whole.skeleton.clone(), whole.points.clone(), &t).unwrap().trajectories
    };
    let picked = at(120.0, &|f| (f + 1) as f64 / 1000.0);
    assert_eq!((picked.sigma(0, 3), picked.sigma(4, 5)), (Some(0.001), Some(0.009)));
    let between = at(40.0, &|f| (f + 1) as f64 / 1000.0);
    assert!((between.sigma(1, 0).unwrap() - 0.001 * (1.0 + 2.0 / 3.0)).abs() < 1e-12);
    let half = at(40.0, &|f| if f % 2 == 0 { 0.01 } else { f64::NAN });
    assert_eq!(half.sigma(1, 0), Some(0.01));
}
