//! How long it takes to compare two bodies of 6,500 vertices. Without the shared data nothing is measured.

#[path = "../tests/captured/mod.rs"]
mod captured;

use divan::Bencher;
use evaluation::surface::compare_surfaces;

fn main() {
    divan::main();
}

#[divan::bench(sample_count = 10)]
fn surface_distance(bencher: Bencher) {
    let Some(mesh) = captured::mesh("surface distance") else { return };
    let mut moved = mesh.clone();
    moved.vertices.iter_mut().for_each(|vertex| vertex.x += 0.01);
    bencher.bench_local(|| compare_surfaces(&moved, &mesh, 10_000, 0));
}
