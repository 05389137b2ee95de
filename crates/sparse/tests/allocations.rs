//! A frame takes no memory but its own result.

mod fixtures;

use fixtures::{Recorded, SIX, drawn, on, session, walks_and_runs};
use sample_motion::Action;
use sparse::{Method, Parameters};

#[test]
fn a_frame_takes_no_memory() {
    let recorded = Recorded::new(&walks_and_runs());
    let session = session(&drawn(Action::Walk, 0, 300, 200).motion, &SIX);
    for method in [Method::LocalRegression, Method::Nearest] {
        let parameters = Parameters { method, ..Parameters::default() };
        let reconstructor = recorded.reconstructor(&session, &parameters);
        let count = |frames: usize| {
            allocation_counter::measure(|| {
                reconstructor.reconstruct(0..frames, &mut on).unwrap();
            })
            .count_total
        };
        count(10);
        // The same start, 100 frames more.
        let (short, long) = (count(50), count(150));
        assert_eq!(long - short, 0, "{method}: {} allocations a frame", (long - short) as f64 / 100.0);
    }
}
