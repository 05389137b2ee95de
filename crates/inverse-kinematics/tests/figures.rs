//! Whole bodies and skeletons followed through frames.

use std::sync::Arc;

use body::{BodyModel, Posed};
use inverse_kinematics::{Figure, Method};
use kinematics::{ControlPoint, Kinematics, Parametrisation, control_points};
use model::{Camera, Mesh, Silhouette};
use nalgebra::Vector3;
use vision::scene::{Ring, silhouettes};

const FRAMES: usize = 20;
const MEASURED: [&str; 6] = ["l_wrist", "r_wrist", "l_ankle", "r_ankle", "pelvis", "head"];
const INNER: [&str; 4] = ["l_elbow", "r_elbow", "l_knee", "r_knee"];

/// Someone who turns, steps and moves their arms.
fn pose(model: &BodyModel, frame: usize) -> Vec<f64> {
    let t = frame as f64 / 12.0;
    let mut pose = vec![0.0; model.rig().num_dofs()];
    pose[..6].copy_from_slice(&[0.3 * t, 0.0, 0.2, 0.05, 2.0 + 0.4 * t, 0.0]);
    for (value, dof) in pose.iter_mut().zip(model.rig().dofs()) {
        let Some([low, high]) = dof.limits else { continue };
        let swing = (3.0 * t + if dof.name.starts_with('l') { 0.0 } else { 2.0 }).sin();
        let middle = if dof.name.contains("elbow") || dof.name.contains("knee") { 0.9 } else { 0.1 };
        *value = (middle + 0.35 * swing).clamp(low, high);
    }
    pose
}

fn points(model: &BodyModel) -> Vec<ControlPoint> {
    let at = |name: &str| ControlPoint {
        name: name.to_owned(),
        joint: model.rig().joint_index(name).unwrap(),
        offset: Vector3::zeros(),
    };
    MEASURED.map(at).to_vec()
}

type Views = Vec<(Camera, Silhouette)>;

/// True joints and what two cameras see, frame by frame.
fn seen(model: &BodyModel) -> Vec<(Vec<Vector3<f64>>, Views)> {
    let ring = Ring { cameras: 4, size: 320, focal: 400.0, start: 0.3, ..Ring::default() };
    let cameras: Vec<_> = ring.cameras().into_iter().take(2).collect();
    let shape = model.shape(&[]);
    let mut posed = Posed::default();
    let frame = |frame| {
        shape.pose(model, &pose(model, frame), &mut posed);
        let mesh = Mesh { vertices: posed.vertices.clone(), faces: model.faces().to_vec() };
        let drawn = silhouettes(&mesh, &cameras);
        (posed.joints.clone(), cameras.iter().cloned().zip(drawn).collect())
    };
    (0..FRAMES).map(frame).collect()
}

/// Mean distance of elbows and knees from the true ones, millimetres, and of the measured points from where they were.
fn errors(model: &BodyModel, method: Method, frames: &[(Vec<Vector3<f64>>, Views)]) -> [f64; 2] {
    let figure = Figure::body(model, &model.shape(&[]), &points(model)).unwrap();
    let mut solver = figure.solver(method, 15).unwrap();
    let (mut inner, mut ends) = (0.0, 0.0);
    for (truth, views) in frames {
        let measured: Vec<_> = points(model).iter().map(|point| truth[point.joint]).collect();
        let solved = solver.next(&figure.targets(&measured), views).unwrap();
        let found = figure.joints(&solved);
        let off = |name: &&str| {
            let joint = model.rig().joint_index(name).unwrap();
            (found[joint] - truth[joint]).norm()
        };
        inner += 1000.0 * INNER.iter().map(off).sum::<f64>() / (INNER.len() * FRAMES) as f64;
        ends += 1000.0 * solved.residual_m.unwrap() / FRAMES as f64;
        assert_eq!(solved.overlap.is_some(), method.uses_images());
        let pose = figure.pose(&solved, None);
        let mut posed = Posed::default();
        model.shape(&[]).pose_joints(model, &pose, &mut posed);
        assert!((posed.joints[5] - found[5]).norm() < 1e-9, "the pose is that of the joints");
    }
    [inner, ends]
}

#[test]
fn silhouettes_find_the_elbows_and_knees_of_a_body_whose_ends_are_measured() {
    let model = BodyModel::shipped();
    let frames = seen(&model);
    let found = |method: Method| {
        let [inner, ends] = errors(&model, method, &frames);
        println!("{method:?}: elbows and knees {inner:.1} mm, ends {ends:.1} mm");
        [inner, ends]
    };
    let [plain, _] = found(Method::Plain);
    let [priority, _] = found(Method::Priority);
    let [image, ends] = found(Method::ImageConstrained);
    for method in [Method::Extended, Method::ImageFirst, Method::ReachThenImageThenPosture] {
        found(method);
    }
    assert!(
        image < 0.6 * plain.min(priority) && image < 30.0 && ends < 5.0,
        "{image} {ends} {plain} {priority}"
    );
}

#[test]
fn frames_without_measurements_keep_the_pose_and_lost_ones_are_found_again() {
    let model = BodyModel::shipped();
    let figure = Figure::body(&model, &model.shape(&[]), &points(&model)).unwrap();
    let mut solver = figure.solver(Method::Priority, 15).unwrap();
    let mut posed = Posed::default();
    let mut measured = |frame: usize, turned: f64| {
        let mut pose = pose(&model, frame);
        pose[4] += turned;
        model.shape(&[]).pose_joints(&model, &pose, &mut posed);
        points(&model).iter().map(|point| posed.joints[point.joint]).collect::<Vec<_>>()
    };
    let first = solver.next(&figure.targets(&measured(0, 0.0)), &[]).unwrap();
    let nothing = vec![Vector3::repeat(f64::NAN); MEASURED.len()];
    let kept = solver.next(&figure.targets(&nothing), &[]).unwrap();
    assert_eq!((kept.residual_m, kept.x), (None, first.x));
    // they stand with their back to where they looked
    let turned = solver.next(&figure.targets(&measured(3, 3.0)), &[]).unwrap();
    assert!(turned.residual_m.unwrap() < 0.03, "{:?}", turned.residual_m);
}

#[test]
fn a_skeleton_is_followed_by_its_hands_and_feet() {
    let model = BodyModel::shipped();
    let skeleton = Arc::new(model.skeleton(&model.shape(&[])).unwrap());
    let measured = control_points(&skeleton, &MEASURED).unwrap();
    let figure = Figure::skeleton(&skeleton, &measured).unwrap();
    let mut solver = figure.solver(Method::Priority, 15).unwrap();
    let truth = model.motion(&model.shape(&[]), &[pose(&model, 0), pose(&model, 1)], 30.0).unwrap();
    let kinematics = Kinematics::new(&skeleton, Parametrisation::channels(&skeleton));
    let mut state = kinematics.state();
    let mut before: Option<Vec<f64>> = None;
    for pose in truth.poses() {
        kinematics.update(pose, &mut state);
        let at: Vec<_> = measured.iter().map(|point| state.point(point.joint, &point.offset)).collect();
        let solved = solver.next(&figure.targets(&at), &[]).unwrap();
        assert!(solved.residual_m.unwrap() < 0.02, "{:?}", solved.residual_m);
        let found = figure.pose(&solved, before.as_deref());
        kinematics.update(&found, &mut state);
        let joints = figure.joints(&solved);
        let off = joints.iter().zip(&state.positions).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-9, "the pose is that of the joints: {off}");
        before = Some(found);
    }
}

#[test]
fn figures_that_nothing_is_measured_of_are_refused() {
    let model = BodyModel::shipped();
    let figure = Figure::body(&model, &model.shape(&[]), &[]).unwrap();
    let error = figure.solver(Method::Plain, 15).unwrap_err();
    assert_eq!(error.to_string(), "there is no measured point to reach, expected at least one");
    let figure = Figure::body(&model, &model.shape(&[]), &points(&model)).unwrap();
    assert_eq!(figure.solver(Method::Plain, 0).unwrap_err().to_string(), "steps is 0, expected 1 or more");
}
