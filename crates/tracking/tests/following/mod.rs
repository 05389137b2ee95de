//! People followed from a pose that is known in the first frame.

use std::sync::atomic::AtomicBool;

use tracking::{Chunk, Error, Footage, Seen, Tracker, track_footage};

/// Tracks frames that begin with number `first`, in which the person stands at `start`; who is lost is not looked for again.
/// `each` is told how many frames are done.
pub fn follow(
    tracker: &mut Tracker<'_>,
    start: &[f64],
    first: usize,
    frames: &[Seen],
    each: impl FnMut(usize),
) -> Chunk {
    let mut start = Some(start.to_vec());
    let footage = Footage {
        frames: first..first + frames.len(),
        see: |frame: usize| Ok::<_, Error>(frames[frame - first].clone()),
        find: |_: &[_]| start.take(),
    };
    track_footage(tracker, footage, &AtomicBool::new(false), each).unwrap()
}
