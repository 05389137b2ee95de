//! Sessions and reconstructions as artefacts: what was written is read, what was damaged is refused.

mod fixtures;

use fixtures::{Recorded, SIX, changed, drawn, on, session, walks_and_runs};
use nalgebra::Vector3;
use sample_motion::Action;
use sparse::{Parameters, Reconstruction, Session};

fn short_session() -> Session {
    let whole = session(&drawn(Action::Walk, 0, 9, 40).motion, &SIX);
    changed(&whole, |f, p, v| if f == 3 && p == 1 { Vector3::repeat(f64::NAN) } else { v })
}

fn short_reconstruction() -> Reconstruction {
    let recorded = Recorded::new(&walks_and_runs());
    let parameters = Parameters::default();
    recorded.reconstructor(&short_session(), &parameters).reconstruct(4..10, &mut on).unwrap()
}

#[test]
fn a_session_comes_back_bit_for_bit() {
    let session = short_session();
    let bytes = session.to_bytes();
    let back = Session::from_bytes(&bytes).unwrap();
    assert_eq!((&back.skeleton, &back.points), (&session.skeleton, &session.points));
    assert_eq!(back.trajectories.position(3, 1), None);
    assert_eq!(back.trajectories.position(3, 2), session.trajectories.position(3, 2));
    assert_eq!(back.to_bytes(), bytes);
}

#[test]
fn a_session_keeps_how_sure_its_samples_are() {
    let mut session = short_session();
    let count = session.num_frames() * session.points.len();
    let sigmas = (0..count).map(|i| if i % 3 == 0 { f64::NAN } else { 0.001 * i as f64 }).collect();
    session.trajectories = session.trajectories.with_sigmas(sigmas).unwrap();
    let bytes = session.to_bytes();
    let back = Session::from_bytes(&bytes).unwrap();
    assert_eq!(back.to_bytes(), bytes);
    assert_eq!(back.trajectories.sigma(0, 0), None);
    assert_eq!(back.trajectories.sigma(1, 1), Some(0.007));
    let at = bytes.len() - 8;
    for bad in [0.0, -1.0, f64::INFINITY] {
        let mut changed = bytes.clone();
        changed[at..].copy_from_slice(&f64::to_le_bytes(bad));
        let error = Session::from_bytes(&changed).unwrap_err().to_string();
        assert!(error.contains("expected a positive number"), "{error}");
    }
    assert!(Session::from_bytes(&bytes[..at]).is_err());
}

#[test]
fn a_session_of_one_point_or_of_a_point_twice_is_refused() {
    let session = short_session();
    let mut alone = session.clone();
    alone.points.truncate(1);
    let message = Session::from_bytes(&alone.to_bytes()).unwrap_err().to_string();
    assert!(message.contains('1') && message.contains("16"), "{message}");
    let mut twice = session;
    twice.points[1].name = twice.points[0].name.clone();
    let message = Session::from_bytes(&twice.to_bytes()).unwrap_err().to_string();
    assert!(message.contains("left_wrist"), "{message}");
}

#[test]
fn a_reconstruction_comes_back_bit_for_bit() {
    let found = short_reconstruction();
    let back = Reconstruction::from_bytes(&found.to_bytes()).unwrap();
    assert_eq!(back, found);
    let empty = Reconstruction { first_frame: 7, coordinates: vec![], sigmas: vec![], quality: vec![] };
    assert_eq!(Reconstruction::from_bytes(&empty.to_bytes()).unwrap(), empty);
}

/// Cut at every byte, lengthened, and with every byte of the header changed.
fn refuses_damage<T>(bytes: &[u8], read: impl Fn(&[u8]) -> sparse::Result<T>) {
    for end in 0..bytes.len() {
        assert!(read(&bytes[..end]).is_err(), "cut at {end} of {}", bytes.len());
    }
    let mut longer = bytes.to_vec();
    longer.push(0);
    assert!(read(&longer).is_err());
    let header = 12 + u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
    for at in 0..header {
        for with in [b'9', b'-', b'"', 0, 0xff] {
            let mut changed = bytes.to_vec();
            changed[at] = with;
            let _ = read(&changed);
        }
    }
    for at in 0..8 {
        let mut changed = bytes.to_vec();
        changed[at] ^= 1;
        assert!(read(&changed).is_err());
    }
}

#[test]
fn a_damaged_session_is_refused() {
    refuses_damage(&short_session().to_bytes(), Session::from_bytes);
}

#[test]
fn a_damaged_reconstruction_is_refused() {
    refuses_damage(&short_reconstruction().to_bytes(), Reconstruction::from_bytes);
}

#[test]
fn headers_that_claim_too_much_take_no_memory() {
    let with_header = |magic: &str, header: &str| {
        let mut bytes = magic.as_bytes().to_vec();
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(header.as_bytes());
        bytes
    };
    for (frames, dofs) in [("18446744073709551615", "62"), ("4294967296", "4294967296"), ("1000000000", "62")]
    {
        let header = format!(r#"{{"first_frame":0,"frames":{frames},"dofs":{dofs}}}"#);
        let bytes = with_header("MAREYREC", &header);
        let counted = allocation_counter::measure(|| {
            assert!(Reconstruction::from_bytes(&bytes).is_err());
        });
        assert!(counted.bytes_max < 10_000, "{counted:?}");
    }
    let text = String::from_utf8_lossy(&short_session().to_bytes()).into_owned();
    let start = text.find('{').unwrap();
    let end = text.find("\"frames\":40,").unwrap();
    for frames in ["18446744073709551615", "768614336404564651", "1000000000"] {
        let bytes = with_header(
            "MAREYSE2",
            &format!("{}\"frames\":{frames},\"has_sigmas\":true}}", &text[start..end]),
        );
        let counted = allocation_counter::measure(|| {
            assert!(Session::from_bytes(&bytes).is_err());
        });
        assert!(counted.bytes_max < 20 * bytes.len() as u64, "{counted:?}");
    }
    let mut no_header = b"MAREYSE2".to_vec();
    no_header.extend_from_slice(&u32::MAX.to_le_bytes());
    assert!(Session::from_bytes(&no_header).is_err());
}
