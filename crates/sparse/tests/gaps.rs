//! Points that are hidden, wrong or absurd for a while.

mod fixtures;

use std::ops::Range;

use fixtures::{Recorded, SIX, changed, drawn, on, session, walks_and_runs};
use model::Motion;
use nalgebra::Vector3;
use sample_motion::Action;
use sparse::{Parameters, Session};

const NOT_MEASURED: Vector3<f64> = Vector3::new(f64::NAN, f64::NAN, f64::NAN);

/// Half a second.
const GAP: Range<usize> = 80..110;

fn trial(seed: u64) -> Motion {
    drawn([Action::Walk, Action::Run][seed as usize % 2], 0, 200 + seed, 200).motion
}

/// Reconstructs, checks that every number is finite and that the points are met again soon after the gap. Gives the
/// mean joint position errors in the gap and after it, cm.
fn survives(
    recorded: &Recorded,
    truth: &Motion,
    session: &Session,
    gap: Range<usize>,
    what: &str,
) -> (f64, f64) {
    let found = recorded.reconstruct(session, &Parameters::default());
    assert!(found.coordinates.iter().all(|v| v.is_finite()), "{what}");
    for (frame, q) in found.quality.iter().enumerate() {
        assert!(q.residual_m.is_finite() && q.sigma_rad.is_finite() && q.energy.is_finite(), "{what}: {q:?}");
        assert!(frame < gap.end + 30 || q.residual_m < 0.01, "{what}, frame {frame}: {q:?}");
    }
    let motion = recorded.motion(session, &found);
    let error = |frames: Range<usize>| {
        let part = |m: &Motion| {
            let values = m.values()[62 * frames.start..62 * frames.end].to_vec();
            Motion::new(m.skeleton().clone(), 60.0, values).unwrap()
        };
        evaluation::compare(&part(truth), &part(&motion)).mpjpe_cm
    };
    let errors = (error(gap.clone()), error((gap.end + 30).min(199)..200));
    println!("{what}: {:.2} cm in the gap, {:.2} cm after it", errors.0, errors.1);
    errors
}

#[test]
fn points_that_are_hidden_for_half_a_second_are_survived() {
    let recorded = Recorded::new(&walks_and_runs());
    for seed in 0..4 {
        let truth = trial(seed);
        let whole = session(&truth, &SIX);
        for (hidden, name) in SIX.into_iter().enumerate() {
            let one =
                changed(&whole, |f, p, v| if GAP.contains(&f) && p == hidden { NOT_MEASURED } else { v });
            let (within, after) = survives(&recorded, &truth, &one, GAP, name);
            assert!(within < 3.0 && after < 1.5, "{name} hidden: {within} cm, then {after} cm");
        }
        let four = session(&truth, &SIX[..4]);
        let one = changed(&four, |f, p, v| if GAP.contains(&f) && p == 2 { NOT_MEASURED } else { v });
        let (_, after) = survives(&recorded, &truth, &one, GAP, "one of four");
        assert!(after < 3.0, "one of four hidden: {after} cm after it");
        let none = changed(&whole, |f, _, v| if GAP.contains(&f) { NOT_MEASURED } else { v });
        let (_, after) = survives(&recorded, &truth, &none, GAP, "all");
        assert!(after < 1.5, "all hidden: {after} cm after it");
    }
}

#[test]
fn a_gap_at_either_end_is_survived() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = trial(0);
    let whole = session(&truth, &SIX);
    let begin = changed(&whole, |f, _, v| if f < 20 { NOT_MEASURED } else { v });
    let (within, after) = survives(&recorded, &truth, &begin, 0..20, "nothing at first");
    assert!(within < 15.0 && after < 1.5, "{within} cm, then {after} cm");
    let late = changed(&whole, |f, _, v| if f < 60 { NOT_MEASURED } else { v });
    let (within, after) = survives(&recorded, &truth, &late, 0..60, "nothing for a second");
    assert!(within < 50.0 && after < 1.5, "{within} cm, then {after} cm");
    // A chunk that ends before anything is measured has the same poses.
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&late, &parameters);
    let (chunk, all) =
        (reconstructor.reconstruct(0..40, &mut on), reconstructor.reconstruct(0..200, &mut on));
    let (chunk, all) = (chunk.unwrap(), all.unwrap());
    assert_eq!(chunk.coordinates, all.coordinates[..chunk.coordinates.len()]);
    let first = all.sigmas.len() / 200;
    assert!(
        all.sigmas[0] > 3.0 * all.sigmas[60 * first],
        "where the person was is less sure, a second before"
    );
    let end = changed(&whole, |f, _, v| if f >= 170 { NOT_MEASURED } else { v });
    let found = recorded.reconstruct(&end, &Parameters::default());
    assert!(found.coordinates.iter().all(|v| v.is_finite()));
    // A chunk of which nothing was measured, after all that was.
    let parameters = Parameters::default();
    let tail = recorded.reconstructor(&end, &parameters).reconstruct(175..200, &mut on).unwrap();
    assert!(tail.coordinates.iter().all(|v| v.is_finite()));
}

#[test]
fn absurd_points_are_survived() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = trial(1);
    let whole = session(&truth, &SIX);
    for distance in [3.0, 1e3, 1e6, 1e12, 1e18, 1e30, 1e154, 1e300, f64::MAX, f64::INFINITY] {
        let what = format!("{distance:e} m away");
        let one = changed(&whole, |f, p, v| {
            if GAP.contains(&f) && p == 1 { v + Vector3::new(distance, 0.0, -distance) } else { v }
        });
        survives(&recorded, &truth, &one, GAP, &what);
        // One frame of nonsense in all points.
        let all = changed(&whole, |f, _, v| if f == 90 { Vector3::repeat(-distance) } else { v });
        survives(&recorded, &truth, &all, 90..91, &what);
    }
}

#[test]
fn points_at_one_place_and_at_the_origin_are_survived() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = trial(1);
    let whole = session(&truth, &SIX);
    // As some systems write what they did not see.
    let origin = changed(&whole, |f, _, v| if GAP.contains(&f) { Vector3::zeros() } else { v });
    survives(&recorded, &truth, &origin, GAP, "all at the origin");
    let all_along = changed(&whole, |_, _, _| Vector3::zeros());
    let found = recorded.reconstruct(&all_along, &Parameters::default());
    assert!(found.coordinates.iter().all(|v| v.is_finite()));
}

#[test]
fn swapped_wrists_are_survived() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = trial(0);
    let whole = session(&truth, &SIX);
    let swapped =
        changed(
            &whole,
            |f, p, v| {
                if GAP.contains(&f) && p < 2 { whole.trajectories.frame(f)[1 - p] } else { v }
            },
        );
    survives(&recorded, &truth, &swapped, GAP, "swapped wrists");
}
