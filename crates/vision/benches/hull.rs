//! How long it takes to carve the hull of 8 views of 1004 × 1004 pixels, distance fields included, by the side of its cells.
//! Without the shared data nothing is measured.

#[path = "../tests/capture/mod.rs"]
mod capture;

use divan::Bencher;
use vision::{HullOptions, HullView, carve_hull};

fn main() {
    divan::main();
}

#[divan::bench(args = [0.01, 0.005, 0.003], sample_count = 10)]
fn hull(bencher: Bencher, cell_m: f64) {
    let Some(capture) = capture::frame_0("hull") else { return };
    let views: Vec<_> = capture
        .cameras
        .iter()
        .zip(&capture.silhouettes)
        .map(|(camera, silhouette)| HullView { camera, silhouette })
        .collect();
    bencher.bench_local(|| carve_hull(&views, &HullOptions { cell_m, ..HullOptions::default() }));
}
