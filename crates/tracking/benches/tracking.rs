//! A frame's preparation and local step, the energy of one particle, and the search of 25 × 10, for 8 cameras of 1004 × 1004.

#[path = "../tests/moving/mod.rs"]
mod moving;

use body::BodyModel;
use divan::Bencher;
use moving::{Views, mixed, seen};
use tracking::{Misalignment, ObservedFrame, Options, SilhouetteTerm, Tracker};
use vision::{Topology, scene::Ring};

fn main() {
    divan::main();
}

/// Two frames of a motion.
fn moment(model: &BodyModel, cameras: usize) -> ([Vec<f64>; 2], [Views; 2]) {
    let motion = mixed(model, 6);
    let cameras = Ring { cameras, ..Ring::default() }.cameras();
    let poses = [motion[14].clone(), motion[15].clone()];
    let views = poses.each_ref().map(|pose| seen(model, &model.shape(&[]), pose, &cameras).0);
    (poses, views)
}

#[divan::bench]
fn prepare_8_views(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (_, [_, views]) = moment(&model, 8);
    bencher.bench_local(|| ObservedFrame::new(0, &views).unwrap());
}

/// What a frame takes that is tracked locally: preparation, local step, judging.
#[divan::bench]
fn local_frame_of_8_views(bencher: Bencher) {
    let model = BodyModel::shipped();
    let ([before, _], [_, views]) = moment(&model, 8);
    let options = Options { particles: None, ..Options::default() };
    let mut tracker = Tracker::new(&model, &[], &before, options).unwrap();
    bencher.bench_local(|| {
        tracker.restart(&before).unwrap();
        tracker.track(&ObservedFrame::new(0, &views).unwrap(), &false.into()).unwrap()
    });
}

#[divan::bench]
fn one_particle_in_one_view(bencher: Bencher) {
    let model = BodyModel::shipped();
    let ([before, _], [_, views]) = moment(&model, 1);
    let (topology, shape) = (Topology::new(model.faces(), model.num_vertices()), model.shape(&[]));
    let frame = ObservedFrame::new(0, &views).unwrap();
    let mut term = SilhouetteTerm::default();
    bencher.bench_local(|| term.energy_mm(&model, &topology, &shape, &frame, &before));
}

#[divan::bench]
fn search_of_25_x_10_over_the_whole_body_in_8_views(bencher: Bencher) {
    let model = BodyModel::shipped();
    let ([before, _], [_, views]) = moment(&model, 8);
    let frame = ObservedFrame::new(0, &views).unwrap();
    let mut tracker = Tracker::new(&model, &[], &before, Options::default()).unwrap();
    let all = Misalignment::from_errors([1.0; 10], 0.1);
    bencher.bench_local(|| tracker.search(&frame, &before, &before, &all, &|| true));
}
