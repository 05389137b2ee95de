//! A session cut for many workers is what it is uncut, within a tolerance.

mod fixtures;

use evaluation::compare;
use fixtures::{Recorded, SIX, at_60, drawn, five_actions, session, uncut, walks_and_runs};
use model::Motion;
use sample_motion::Action;
use sparse::{Chunk, Error, Parameters, Reconstruction, Session, merge, plan_chunks};

/// Reconstructs the chunks in the order that `order` puts them in, then merges.
fn cut(
    recorded: &Recorded,
    session: &Session,
    parameters: &Parameters,
    order: impl Fn(&mut Vec<Chunk>),
) -> sparse::Merged {
    let mut chunks = plan_chunks(session.num_frames(), parameters);
    order(&mut chunks);
    let mut parts: Vec<(usize, Reconstruction)> = chunks
        .iter()
        .map(|chunk| {
            // Every worker has a reconstructor of its own.
            let reconstructor = recorded.reconstructor(session, parameters);
            (chunk.index, reconstructor.reconstruct(chunk.frames.clone(), &mut fixtures::on).unwrap())
        })
        .collect();
    parts.sort_by_key(|(index, _)| *index);
    let parts: Vec<Reconstruction> = parts.into_iter().map(|(_, part)| part).collect();
    merge(&recorded.database, session, parameters, &parts).unwrap()
}

/// Difference between the cut and the uncut run: joint angles, degrees RMS, and mean joint position, cm.
fn difference(
    recorded: &Recorded,
    truth: &Motion,
    names: &[&str],
    parameters: &Parameters,
    what: &str,
) -> (f64, f64) {
    let session = session(truth, names);
    let whole = recorded.motion(&session, &recorded.reconstruct(&session, &uncut(&session)));
    let merged = cut(recorded, &session, parameters, |_| {}).motion;
    let chunks = plan_chunks(session.num_frames(), parameters).len();
    let errors = compare(&whole, &merged);
    println!(
        "{what}, {} points, {} frames in {chunks} chunks, warm-up {}: {:.3} degrees RMS, {:.3} cm (truth {:.2}, {:.2})",
        names.len(),
        session.num_frames(),
        parameters.warm_up_frames,
        errors.rms_deg,
        errors.mpjpe_cm,
        compare(truth, &whole).rms_deg,
        compare(truth, &merged).rms_deg,
    );
    (errors.rms_deg, errors.mpjpe_cm)
}

#[test]
fn a_long_drawn_walk_is_the_same_cut_and_uncut() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = drawn(Action::Walk, 0, 400, 2_500).motion;
    for points in [6, 4] {
        let (degrees, cm) = difference(&recorded, &truth, &SIX[..points], &Parameters::default(), "walk");
        assert!(degrees < 0.01 && cm < 0.01, "{points} points: {degrees} degrees, {cm} cm");
    }
}

#[test]
fn a_recorded_boxing_match_is_the_same_cut_and_uncut() {
    let test = "a_recorded_boxing_match_is_the_same_cut_and_uncut";
    let Some(folder) = testkit::shared::find("data/motion/five-actions", test) else { return };
    let (boxer, others) = five_actions(&folder, "13_17", |_, action| action == "boxing" || action == "jump");
    let recorded = Recorded::new(&others);
    let truth = at_60(&boxer.motion);
    // Nobody else in the database boxes like this one: which of two likely ways a wrist is turned is settled at the
    // start of each chunk, and stays so for some seconds. Joints stay where they are all the same.
    for points in [6, 4] {
        let (degrees, cm) = difference(&recorded, &truth, &SIX[..points], &Parameters::default(), "boxing");
        assert!(degrees < 3.5 && cm < 1.2, "{points} points: {degrees} degrees, {cm} cm");
    }
}

#[test]
fn the_order_in_which_chunks_are_computed_does_not_matter() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = session(&drawn(Action::Walk, 1, 401, 400).motion, &SIX);
    let parameters = Parameters { chunk_frames: 90, warm_up_frames: 30, ..Parameters::default() };
    let forwards = cut(&recorded, &session, &parameters, |_| {});
    assert_eq!(forwards, cut(&recorded, &session, &parameters, |chunks| chunks.reverse()));
    assert_eq!(forwards, cut(&recorded, &session, &parameters, |chunks| chunks.swap(1, 3)));
    assert_eq!((forwards.motion.num_frames(), forwards.quality.len()), (400, 400));
}

#[test]
fn one_chunk_is_the_uncut_run() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = session(&drawn(Action::Run, 1, 402, 200).motion, &SIX);
    let found = recorded.reconstruct(&session, &Parameters::default());
    let merged = cut(&recorded, &session, &Parameters::default(), |_| {});
    assert_eq!(merged.motion, recorded.motion(&session, &found));
    assert_eq!(merged.quality, found.quality);
}

/// Where one chunk turns into the next nothing jumps.
#[test]
fn seams_are_as_smooth_as_the_rest() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = session(&drawn(Action::Walk, 0, 403, 600).motion, &SIX[..4]);
    let parameters = Parameters { chunk_frames: 100, warm_up_frames: 10, ..Parameters::default() };
    let merged = cut(&recorded, &session, &parameters, |_| {}).motion;
    let whole = recorded.motion(&session, &recorded.reconstruct(&session, &uncut(&session)));
    let fastest = |m: &Motion| {
        let poses: Vec<&[f64]> = m.poses().collect();
        let speed =
            |pair: &[&[f64]]| pair[0].iter().zip(pair[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        poses.windows(2).map(speed).fold(0.0, f64::max)
    };
    assert!(fastest(&merged) < 1.5 * fastest(&whole), "{} and {}", fastest(&merged), fastest(&whole));
}

#[test]
fn chunks_that_do_not_make_up_the_session_are_refused() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = session(&drawn(Action::Walk, 1, 404, 200).motion, &SIX);
    let parameters = Parameters { chunk_frames: 60, warm_up_frames: 20, ..Parameters::default() };
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let parts: Vec<Reconstruction> = plan_chunks(200, &parameters)
        .iter()
        .map(|c| reconstructor.reconstruct(c.frames.clone(), &mut fixtures::on).unwrap())
        .collect();
    let merged = |parts: &[Reconstruction]| merge(&recorded.database, &session, &parameters, parts);
    merged(&parts).unwrap();
    assert!(matches!(merged(&parts[1..]), Err(Error::Chunks { .. })));
    assert!(matches!(merged(&[]), Err(Error::Chunks { .. })));
    let mut swapped = parts.clone();
    swapped.swap(0, 1);
    assert!(matches!(merged(&swapped), Err(Error::Chunks { .. })));
    let mut short = parts.clone();
    short[1].quality.pop();
    assert!(matches!(merged(&short), Err(Error::Chunks { .. })));
    let mut twice = parts.clone();
    twice.push(parts[0].clone());
    assert!(matches!(merged(&twice), Err(Error::Chunks { .. })));
}
