//! Live tracking: near the offline reconstruction, resumable bit for bit, no memory a frame, no fear of numbers.

mod fixtures;

use fixtures::{Recorded, SIX, changed, drawn, session, walks_and_runs};
use model::Samples;
use nalgebra::Vector3;
use sample_motion::Action;
use sparse::{Live, MAX_LIVE_STATE_BYTES, Parameters, Reconstructor, Session};

/// Frames after which a start is decided.
const SETTLED: usize = 90;

fn walk(frames: usize) -> Session {
    session(&drawn(Action::Walk, 0, 300, frames).motion, &SIX)
}

fn push(live: &mut Live<'_>, session: &Session, frame: usize) -> Option<Vec<f64>> {
    live.push(session.trajectories.samples(frame)).map(|found| found.coordinates.to_vec())
}

/// Root mean square difference of the joint angles, degrees.
fn difference_deg(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).skip(6).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / (a.len() - 6) as f64).sqrt().to_degrees()
}

#[test]
fn once_it_has_settled_it_finds_what_is_found_offline() {
    let recorded = Recorded::new(&walks_and_runs());
    let parameters = Parameters::default();
    let dofs = recorded.database.num_dofs();
    for (action, seed) in [(Action::Walk, 301), (Action::Run, 302), (Action::Run, 303)] {
        let session = session(&drawn(action, seed % 2, seed, 200).motion, &SIX);
        let offline = recorded.reconstruct(&session, &parameters);
        let reconstructor = recorded.reconstructor(&session, &parameters);
        let mut live = Live::new(&reconstructor).unwrap();
        for frame in 0..session.num_frames() {
            let found = push(&mut live, &session, frame).expect("the first frame has all points");
            let difference = difference_deg(&found, &offline.coordinates[frame * dofs..][..dofs]);
            assert!(frame < SETTLED || difference < 0.5, "{action} {seed}, frame {frame}: {difference}°");
        }
    }
}

#[test]
fn a_stream_that_is_resumed_gives_the_same_bits() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = walk(120);
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    // Pose, channels, and how well they are known.
    let push = |live: &mut Live<'_>, frame: usize| {
        let found = live.push(session.trajectories.samples(frame)).unwrap();
        (found.coordinates.to_vec(), found.pose.to_vec(), found.quality, found.is_starting)
    };
    let mut whole = Live::new(&reconstructor).unwrap();
    let poses: Vec<_> = (0..120).map(|frame| push(&mut whole, frame)).collect();
    // In the first heat, in a later one, and when all is decided.
    for cut in [5, 40, 100] {
        let mut first = Live::new(&reconstructor).unwrap();
        for frame in 0..cut {
            push(&mut first, frame);
        }
        let state = first.state();
        assert!(state.len() < 16 << 10, "{} bytes", state.len());
        let mut second = Live::new(&reconstructor).unwrap();
        second.resume(&state).unwrap();
        assert!(second.state() == state);
        for (frame, expected) in poses.iter().enumerate().skip(cut) {
            assert_eq!(&push(&mut second, frame), expected, "cut at {cut}, frame {frame}");
        }
    }
}

#[test]
fn a_state_that_is_damaged_or_of_something_else_is_refused() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = walk(40);
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    for frame in 0..40 {
        push(&mut live, &session, frame);
    }
    let state = live.state();
    for at in (0..state.len()).step_by(7) {
        let mut damaged = state.clone();
        damaged[at] ^= 0x41;
        assert!(live.resume(&damaged).is_err(), "byte {at}");
        assert!(live.resume(&state[..at]).is_err(), "cut at {at}");
    }
    assert!(live.resume(&vec![0; MAX_LIVE_STATE_BYTES + 1]).is_err());

    // Well made, but of other points.
    let fewer = fixtures::session(&drawn(Action::Walk, 0, 300, 40).motion, &SIX[..4]);
    let others = recorded.reconstructor(&fewer, &parameters);
    let message = Live::new(&others).unwrap().resume(&state).unwrap_err().to_string();
    assert!(message.contains("another motion database, skeleton, choice of points"), "{message}");
    // Whatever was refused, the stream goes on.
    assert!(push(&mut live, &session, 39).is_some());
}

/// A state whose maker knows how checksums are made.
fn forged(state: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut content = state[..state.len() - 32].to_vec();
    change(&mut content);
    let sum = blake3::hash(&content);
    content.extend_from_slice(sum.as_bytes());
    content
}

#[test]
fn a_forged_state_is_refused_or_harmless() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = walk(60);
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    for frame in 0..30 {
        push(&mut live, &session, frame);
    }
    let state = live.state();
    let header = 12 + u32::from_le_bytes(state[8..12].try_into().unwrap()) as usize;
    for number in [f64::NAN, f64::INFINITY, -1e300, 1e7] {
        let bad = forged(&state, |c| c[header..header + 8].copy_from_slice(&number.to_le_bytes()));
        assert!(live.resume(&bad).is_err(), "{number}");
    }
    let text = String::from_utf8_lossy(&state[12..header]).into_owned();
    for (from, to) in [
        ("\"recent\":24", "\"recent\":18446744073709551615"),
        ("\"window\":2", "\"window\":9223372036854775807"),
        ("\"tried\":", "\"tried\":99"),
        ("\"left\":", "\"left\":123456"),
        ("\"matches\":[[", "\"matches\":[[4294967296,"),
        ("\"matches\":[[", "\"matches\":[[],[],[],[],[],[],[],["),
    ] {
        assert!(text.contains(from), "{text}");
        let text = text.replacen(from, to, 1);
        let bad = forged(&state, |c| {
            let mut new = c[..8].to_vec();
            new.extend_from_slice(&(text.len() as u32).to_le_bytes());
            new.extend_from_slice(text.as_bytes());
            new.extend_from_slice(&c[header..]);
            *c = new;
        });
        if live.resume(&bad).is_ok() {
            for frame in 30..60 {
                push(&mut live, &session, frame);
            }
        }
    }
    // Finite nonsense in every number: other poses, no panic.
    for at in (header..state.len() - 40).step_by(8 * 37) {
        let odd = forged(&state, |c| c[at..at + 8].copy_from_slice(&999_999.0_f64.to_le_bytes()));
        if live.resume(&odd).is_ok() {
            for frame in 30..36 {
                push(&mut live, &session, frame);
            }
        }
    }
}

#[test]
fn frames_take_no_memory_and_starts_take_none_either() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = walk(200);
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    let nowhere = [Vector3::repeat(f64::NAN); 6];
    for frame in 0..3 {
        live.push(session.trajectories.samples(frame));
    }
    let counted = allocation_counter::measure(|| {
        for frame in 3..200 {
            live.push(session.trajectories.samples(frame));
        }
        for _ in 0..10 {
            live.push(Samples::from(&nowhere[..]));
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn a_gap_of_all_points_is_survived_and_the_body_found_again() {
    let recorded = Recorded::new(&walks_and_runs());
    let truth = drawn(Action::Walk, 0, 300, 260).motion;
    let whole = session(&truth, &SIX);
    let gap = 120..150;
    let session = changed(&whole, |f, _, p| if gap.contains(&f) { Vector3::repeat(f64::NAN) } else { p });
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    for frame in 0..260 {
        let found = live.push(session.trajectories.samples(frame)).expect("a pose, gap or not");
        assert_eq!(found.quality.measured_points, if gap.contains(&frame) { 0 } else { 6 });
        if frame > 230 {
            assert!(found.quality.residual_m < 0.02, "frame {frame}: {} m", found.quality.residual_m);
        }
    }
}

#[test]
fn a_performer_who_is_suddenly_elsewhere_is_found_again() {
    let recorded = Recorded::new(&walks_and_runs());
    let whole = walk(260);
    let session =
        changed(&whole, |f, _, p| if f < 120 { p } else { Vector3::new(3.0 - p.z, p.y, p.x - 7.0) });
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    let mut was_lost = false;
    for frame in 0..260 {
        let found = live.push(session.trajectories.samples(frame)).unwrap();
        was_lost |= frame > 120 && found.is_starting;
        if frame > 200 {
            assert!(found.quality.residual_m < 0.01, "frame {frame}: {} m", found.quality.residual_m);
        }
    }
    assert!(was_lost);
}

#[test]
fn it_waits_for_two_points_and_then_starts() {
    let recorded = Recorded::new(&walks_and_runs());
    let whole = walk(60);
    let alone = |f: usize, p: usize| f < 20 && p > 0;
    let session = changed(&whole, |f, i, p| if alone(f, i) { Vector3::repeat(f64::NAN) } else { p });
    let parameters = Parameters::default();
    let reconstructor: Reconstructor<'_> = recorded.reconstructor(&session, &parameters);
    let mut live = Live::new(&reconstructor).unwrap();
    for frame in 0..60 {
        assert_eq!(push(&mut live, &session, frame).is_some(), frame >= 20, "frame {frame}");
    }
}

#[test]
fn absurd_numbers_never_panic() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = walk(60);
    let parameters = Parameters::default();
    let reconstructor = recorded.reconstructor(&session, &parameters);
    let absurd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -9e4, 9.9e4, 1e-310, f64::MAX];
    let mut live = Live::new(&reconstructor).unwrap();
    for frame in 0..400 {
        let mut positions = session.trajectories.frame(frame % 60).to_vec();
        let at = frame % 18;
        if frame % 3 > 0 {
            positions[at / 3][at % 3] = absurd[frame % absurd.len()];
        }
        let sigmas: Vec<f64> = (0..6).map(|p| absurd[(frame + p) % absurd.len()]).collect();
        let samples = Samples { positions: &positions, sigmas: if frame % 5 == 0 { &sigmas } else { &[] } };
        if let Some(found) = live.push(samples) {
            assert!(found.coordinates.iter().chain(found.pose).all(|v| v.is_finite()), "frame {frame}");
        }
        live.resume(&live.state()).unwrap();
    }
}
