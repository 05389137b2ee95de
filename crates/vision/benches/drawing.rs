//! How long it takes to draw a body of 6,500 vertices through a camera of 1004 × 1004 pixels, and to measure silhouettes.
//! Without the shared data nothing is measured.

#[path = "../tests/capture/mod.rs"]
mod capture;

use divan::Bencher;
use model::Silhouette;
use nalgebra::Vector3;
use vision::{
    Chamfer, ContourOptions, DepthBuffer, DistanceField, Observed, Rasteriser, Topology, View, contours,
    find_rim, reduced,
};

fn main() {
    divan::main();
}

#[divan::bench(args = [1, 2, 4])]
fn silhouette(bencher: Bencher, scale: usize) {
    let Some(capture) = capture::frame_0("silhouette") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let view = View::reduced(&capture.cameras[0], scale);
    let (mut rasteriser, mut drawn) = (Rasteriser::new(), Silhouette::empty(1, 1));
    bencher.bench_local(|| rasteriser.silhouette(&view, &capture.mesh.vertices, &topology, &mut drawn));
}

#[divan::bench(args = [1, 2, 4])]
fn depth_buffer(bencher: Bencher, scale: usize) {
    let Some(capture) = capture::frame_0("depth buffer") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let view = View::reduced(&capture.cameras[0], scale);
    let mut depths = DepthBuffer::new();
    bencher.bench_local(|| depths.draw(&view, &capture.mesh.vertices, &topology));
}

#[divan::bench]
fn rim(bencher: Bencher) {
    let Some(capture) = capture::frame_0("rim") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let view = View::new(&capture.cameras[0]);
    let mut rim = Vec::new();
    bencher.bench_local(|| {
        find_rim(&view, &capture.mesh.vertices, &topology, &capture.silhouettes[0], 1.5, &mut rim);
    });
}

#[divan::bench(args = [1, 2, 4])]
fn distance_field(bencher: Bencher, scale: usize) {
    let Some(capture) = capture::frame_0("distance field") else { return };
    bencher.bench_local(|| DistanceField::new(&capture.silhouettes[0], scale));
}

#[divan::bench]
fn outlines(bencher: Bencher) {
    let Some(capture) = capture::frame_0("outlines") else { return };
    bencher.bench_local(|| contours(&capture.silhouettes[0], &ContourOptions::default()));
}

/// A silhouette against that of the next frame of the mesh, two centimetres to the side.
#[divan::bench(args = [1, 2, 4])]
fn chamfer(bencher: Bencher, scale: usize) {
    let Some(capture) = capture::frame_0("chamfer") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let view = View::reduced(&capture.cameras[0], scale);
    let moved: Vec<_> = capture.mesh.vertices.iter().map(|v| v + Vector3::new(0.02, 0.0, 0.0)).collect();
    let mut drawn = Silhouette::empty(1, 1);
    let bounds = Rasteriser::new().silhouette(&view, &moved, &topology, &mut drawn);
    let observed = Observed::new(reduced(&capture.silhouettes[0], scale));
    let mut chamfer = Chamfer::new();
    bencher.bench_local(|| chamfer.difference(&drawn, bounds, &observed));
}
