//! Shape, pose and derivatives of the shipped model; learning from as many bodies as it was learned from.

use body::{
    Aligned, BodyModel, LearnOptions, Posed, Scan, ShapeDrift, Subject, Template, TemplateParts, learn,
};
use divan::Bencher;
use nalgebra::Vector3;

fn main() {
    divan::main();
}

fn pose(model: &BodyModel) -> Vec<f64> {
    (0..model.rig().num_dofs()).map(|d| 0.3 * (d as f64).sin()).collect()
}

#[divan::bench]
fn shape_of_20_coefficients(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (alpha, mut shape) = (vec![0.5; 20], model.shape(&[]));
    bencher.bench_local(|| model.shape_into(&alpha, &mut shape));
}

#[divan::bench]
fn pose_of_6500_vertices(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (shape, pose, mut posed) = (model.shape(&[]), pose(&model), Posed::default());
    bencher.bench_local(|| shape.pose(&model, &pose, &mut posed));
}

#[divan::bench]
fn pose_of_650_vertices(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (shape, pose, mut posed) = (model.shape(&[]), pose(&model), Posed::default());
    let vertices: Vec<u32> = (0..6500).step_by(10).collect();
    bencher.bench_local(|| shape.pose_vertices(&model, &pose, &vertices, &mut posed));
}

#[divan::bench]
fn pose_of_the_joints(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (shape, pose, mut posed) = (model.shape(&[]), pose(&model), Posed::default());
    bencher.bench_local(|| shape.pose_joints(&model, &pose, &mut posed));
}

#[divan::bench]
fn derivatives_of_650_vertices(bencher: Bencher) {
    let model = BodyModel::shipped();
    let (shape, pose, mut posed) = (model.shape(&[]), pose(&model), Posed::default());
    shape.pose_joints(&model, &pose, &mut posed);
    let mut drift = ShapeDrift::default();
    let mut by_pose = vec![Vector3::zeros(); 22];
    let mut by_shape = vec![Vector3::zeros(); 20];
    bencher.bench_local(|| {
        drift.update(&model, &posed);
        for vertex in (0..6500).step_by(10) {
            posed.vertex_by_pose(&model, &shape, vertex, divan::black_box(&mut by_pose));
            posed.vertex_by_shape(&model, &drift, vertex, divan::black_box(&mut by_shape));
        }
    });
}

/// Bodies of the shipped model in as many slightly different poses.
fn bodies(count: usize) -> (Template, Vec<Vec<Vector3<f64>>>) {
    let model = BodyModel::shipped();
    let (faces, rest) = (model.faces(), model.mean());
    let parts = TemplateParts { faces, rest, rig: None, skin: None, known_joints: &[] };
    let template = Template::new(parts).expect("the shipped topology");
    let mut posed = Posed::default();
    let body = |person: usize| {
        let number = |i: usize| ((person * 31 + i) as f64 * 1.7).sin();
        let alpha: Vec<f64> = (0..20).map(|i| 1.4 * number(i)).collect();
        let pose: Vec<f64> = (0..22).map(|d| 0.04 * number(100 + d)).collect();
        model.shape(&alpha).pose(&model, &pose, &mut posed);
        posed.vertices.clone()
    };
    (template, (0..count).map(body).collect())
}

fn scans(bodies: &[Vec<Vector3<f64>>]) -> Vec<Scan<'_>> {
    let scan = |vertices| Scan { name: "body", vertices, faces: None, subject: Subject::default() };
    bodies.iter().map(|vertices| scan(vertices)).collect()
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn learn_from_114_scans(bencher: Bencher) {
    let (template, bodies) = bodies(114);
    bencher.bench_local(|| learn(&scans(&bodies), &template, &LearnOptions::default()));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn principal_components_of_114_shapes(bencher: Bencher) {
    let (template, bodies) = bodies(114);
    let aligned =
        Aligned::new(&scans(&bodies), &template, &LearnOptions::default()).expect("bodies of the model");
    bencher.bench_local(|| aligned.learn(&template, &[0], &LearnOptions::default()));
}
