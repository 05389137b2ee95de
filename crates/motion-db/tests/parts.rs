//! Databases put together from parts are those built in one piece.

mod fixtures;

use motion_db::{Error, MotionDatabase};
use sample_motion::Action;

#[test]
fn parts_of_one_build_put_together_are_the_whole() {
    let clips = fixtures::drawn_clips(60);
    let whole = MotionDatabase::build(&clips).unwrap();
    let mut parts = Vec::new();
    for clips in clips.chunks(5) {
        let mut part = whole.emptied();
        for clip in clips {
            assert_eq!(part.append(clip).unwrap(), 60);
        }
        parts.push(MotionDatabase::from_bytes(&part.to_bytes()).unwrap());
    }
    let mut merged = whole.emptied();
    for part in &parts {
        for (i, clip) in part.clips().iter().enumerate() {
            merged.append_from(part, i, &clip.name).unwrap();
        }
    }
    merged.learn_zero_poses();
    assert_eq!(merged, whole);
    assert_eq!(merged.to_bytes(), whole.to_bytes());
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let clips = fixtures::drawn_clips(60);
    let whole = MotionDatabase::build(&clips).unwrap();
    let other = MotionDatabase::build(&clips[..3]).unwrap();
    assert!(!whole.has_same_coordinates_as(&other));
    assert_eq!(whole.emptied().append_from(&other, 0, "a"), Err(Error::OtherCoordinates));
    let mut odd = fixtures::drawn(Action::Walk, 1, 99, 60);
    odd.motion = fixtures::with_skeleton(&odd.motion, |joints| joints[1].name = "tail".to_owned());
    let error = whole.emptied().append(&odd).unwrap_err().to_string();
    assert!(error.contains("tail"), "{error}");
    let short = fixtures::drawn(Action::Walk, 1, 98, 5);
    assert_eq!(whole.emptied().append(&short), Ok(0), "too short to be of use");
}
