//! A frame's preparation and local step, the energy of one particle, and the search of 25 × 10, for 8 cameras of 1004 × 1004.

#[path = "../tests/moving/mod.rs"]
mod moving;

use body::{BodyModel, Posed};
use divan::Bencher;
use model::{Camera, PointMatch};
use moving::{Views, mixed, seen};
use tracking::{Misalignment, ObservedFrame, Options, SilhouetteTerm, Tracker};
use vision::{DepthBuffer, Topology, View, scene::Ring};

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

/// The same with 300 points in every view that were found again, each where it is seen.
#[divan::bench]
fn local_frame_of_8_views_with_texture(bencher: Bencher) {
    let model = BodyModel::shipped();
    let ([before, now], [_, views]) = moment(&model, 8);
    let posed = [&before, &now].map(|pose| {
        let mut posed = Posed::default();
        model.shape(&[]).pose(&model, pose, &mut posed);
        posed.vertices
    });
    let topology = Topology::new(model.faces(), model.num_vertices());
    let matches_of = |camera: &Camera| -> Vec<PointMatch> {
        let view = View::new(camera);
        let mut depths = DepthBuffer::new();
        depths.draw(&view, &posed[0], &topology);
        let seen = (0..model.num_vertices()).filter(|&vertex| depths.sees(&view, &posed[0][vertex], 0.002));
        let pixel = |moment: usize, vertex: usize| view.project(&posed[moment][vertex]).unwrap().0;
        let point = |vertex| PointMatch { frames_back: 1, before: pixel(0, vertex), now: pixel(1, vertex) };
        seen.step_by(8).take(300).map(point).collect()
    };
    let matches: Vec<_> = views.iter().map(|(camera, _)| matches_of(camera)).collect();
    let options = Options { particles: None, ..Options::default() };
    let mut tracker = Tracker::new(&model, &[], &before, options).unwrap();
    bencher.bench_local(|| {
        tracker.restart_at(0, &before).unwrap();
        let frame = ObservedFrame::new(1, &views).unwrap();
        let with =
            |frame: ObservedFrame, (camera, matches): (usize, &Vec<_>)| frame.with_matches(camera, matches);
        tracker.track(&matches.iter().enumerate().fold(frame, with), &false.into()).unwrap()
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
