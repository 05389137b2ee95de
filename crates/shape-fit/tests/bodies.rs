//! Bodies that are known are found again.

#[path = "../../body/tests/scans/mod.rs"]
mod scans;

use std::{fs, path::Path};

use body::{Aligned, BodyModel, LearnOptions, Posed};
use evaluation::{Body, ShapeErrors, shape_errors};
use formats::{calibration, image_files};
use model::{Camera, Mesh, Silhouette};
use nalgebra::Vector3;
use shape_fit::{Fit, Options, fit, fit_frames, fit_pose};
use vision::scene::{Ring, SilhouetteNoise, silhouettes};

fn named(model: &BodyModel, joints: &[Vector3<f64>]) -> Vec<(String, Vector3<f64>)> {
    let names = model.rig().joints().iter().map(|joint| joint.name.clone());
    names.zip(joints.iter().copied()).collect()
}

fn errors(model: &BodyModel, fit: &Fit, truth: &Body) -> ShapeErrors {
    let found = Body { mesh: fit.mesh.clone(), joints: named(model, &fit.joints) };
    shape_errors(&found, truth).unwrap()
}

fn seen(mesh: &Mesh, cameras: &[Camera]) -> Vec<(Camera, Silhouette)> {
    cameras.iter().cloned().zip(silhouettes(mesh, cameras)).collect()
}

#[test]
fn a_person_the_model_was_learned_without_is_found_in_several_poses() {
    let test = "a_person_the_model_was_learned_without_is_found_in_several_poses";
    let Some(bodies) = testkit::shared::find("data/bodies", test) else { return };
    let data = scans::Scans::read(&bodies);
    let options = LearnOptions::default();
    let aligned = Aligned::new(&data.base(), &data.template, &options).unwrap();
    let left_out = 17;
    let model = aligned.learn(&data.template, &[left_out], &options).unwrap().model;
    let joints = formats::npy::read(&fs::read(bodies.join("scans/joints.npy")).unwrap()).unwrap();
    let joints = joints.points().unwrap();
    let rows = fs::read_to_string(bodies.join("scans/scans.csv")).unwrap();
    let subject = rows.lines().nth(left_out + 1).unwrap().split(',').nth(1).unwrap();
    let own = rows.lines().skip(1).filter(|row| row.split(',').nth(1) == Some(subject));
    let cameras = Ring { size: 502, focal: 663.0, ..Ring::default() }.cameras();
    let mut count = 0;
    for row in own.step_by(3).take(3) {
        let scan: usize = row.split(',').next().unwrap().parse().unwrap();
        let mesh = Mesh::new(data.scans[scan].clone(), data.template.faces.clone()).unwrap();
        let found = fit(&model, &seen(&mesh, &cameras), &Options::default()).unwrap();
        let truth = Body { mesh, joints: named(&model, &joints[scan * 21..(scan + 1) * 21]) };
        let errors = errors(&model, &found, &truth);
        assert!(errors.surface_mean_abs_mm < 5.0 && errors.joint_mean_mm < 15.0, "{row}: {errors:?}");
        assert!(found.confidence > 0.8, "{row}: {}", found.confidence);
        count += 1;
    }
    assert_eq!(count, 3);
}

/// The true body of frame 0 of the capture that judges, and its views.
fn capture(folder: &Path, wanted: &[usize], noise: Option<u64>) -> (Vec<(Camera, Silhouette)>, Mesh) {
    let file = fs::read(folder.join("calibration.json")).unwrap();
    let cameras = calibration::read("calibration.json", &file, &Default::default()).unwrap().value;
    let mut views = Vec::new();
    for &index in wanted {
        let camera = cameras[index].clone();
        let file = fs::read(folder.join("silhouettes").join(&camera.name).join("0000.png")).unwrap();
        let mut silhouette = image_files::read_silhouette(&file, &Default::default()).unwrap().value;
        if let Some(seed) = noise {
            SilhouetteNoise::default().add_to(&mut silhouette, seed, index as u64);
        }
        views.push((camera, silhouette));
    }
    let mesh = fs::read(folder.join("groundtruth/mesh_0000.ply")).unwrap();
    (views, formats::ply::read(&mesh).unwrap().value)
}

/// Limits: surface mean absolute and standard deviation, joints, mm.
fn judge(test: &str, wanted: &[usize], noise: Option<u64>, limits: [f64; 3]) {
    let Some(folder) = testkit::shared::find("data/multiview/synthetic-8cam", test) else { return };
    let (views, mesh) = capture(&folder, wanted, noise);
    let text = fs::read_to_string(folder.join("groundtruth/joints.json")).unwrap();
    let model = BodyModel::shipped();
    // the first frame is the first list of lists; names are in the rig's order
    let from = text.find("\"joints\": [[").unwrap() + "\"joints\": [[".len();
    let list = &text[from..from + text[from..].find("]]").unwrap()];
    let numbers: Vec<f64> = list
        .split(|c: char| c == ',' || c == '[' || c == ']' || c.is_whitespace())
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().unwrap())
        .collect();
    let joints: Vec<_> = numbers.as_chunks::<3>().0.iter().map(|&joint| Vector3::from(joint)).collect();
    assert_eq!(joints.len(), model.rig().num_joints());
    let found = fit(&model, &views, &Options::default()).unwrap();
    let errors = errors(&model, &found, &Body { mesh, joints: named(&model, &joints) });
    println!("{test}: {errors:?}");
    let found = [errors.surface_mean_abs_mm, errors.surface_std_mm, errors.joint_mean_mm];
    assert!(found.iter().zip(limits).all(|(found, limit)| *found <= limit), "{errors:?}");
}

#[test]
fn a_stranger_is_found_in_eight_views() {
    judge("a_stranger_is_found_in_eight_views", &[0, 1, 2, 3, 4, 5, 6, 7], None, [4.0, 5.0, 10.0]);
}

#[test]
fn a_stranger_is_found_in_four_views() {
    judge("a_stranger_is_found_in_four_views", &[0, 2, 4, 6], None, [4.0, 5.0, 10.0]);
}

#[test]
fn a_stranger_is_found_in_noise() {
    judge("a_stranger_is_found_in_noise", &[0, 2, 4, 6], Some(5), [5.0, 7.0, 12.0]);
}

fn posed(model: &BodyModel, alpha: &[f64], pose: &[f64]) -> Mesh {
    let mut posed = Posed::default();
    model.shape(alpha).pose(model, pose, &mut posed);
    Mesh::new(posed.vertices, model.faces().to_vec()).unwrap()
}

#[test]
fn several_frames_tell_more_about_the_shape_than_one() {
    let model = BodyModel::shipped();
    let alpha: Vec<f64> = (0..model.num_components()).map(|i| 1.2 * (1.0 + 2.3 * i as f64).sin()).collect();
    let cameras = Ring { cameras: 3, size: 402, focal: 530.0, ..Ring::default() }.cameras();
    let dof = |name: &str| model.rig().dof_index(name).unwrap();
    let mut frames = Vec::new();
    for (turn, arms, knee) in [(0.3, 0.2, 0.0), (1.4, 0.9, 0.4), (-0.5, 0.0, 0.2)] {
        let mut pose = vec![0.0; model.rig().num_dofs()];
        pose[4] = turn;
        for (name, angle) in
            [("l_shoulder_abd", arms), ("r_shoulder_abd", arms), ("l_knee", knee), ("l_hip_flex", knee)]
        {
            pose[dof(name)] = angle;
        }
        let mut views = seen(&posed(&model, &alpha, &pose), &cameras);
        for (index, (_, silhouette)) in views.iter_mut().enumerate() {
            SilhouetteNoise::default().add_to(silhouette, 3, index as u64);
        }
        frames.push(views);
    }
    let rest = vec![0.0; model.rig().num_dofs()];
    let truth =
        Body { mesh: posed(&model, &alpha, &rest), joints: named(&model, &model.shape(&alpha).joints) };
    // of bodies in the rest pose: only the shape counts
    let off = |fit: &Fit| {
        let joints = named(&model, &model.shape(&fit.alpha).joints);
        shape_errors(&Body { mesh: posed(&model, &fit.alpha, &rest), joints }, &truth)
            .unwrap()
            .surface_mean_abs_mm
    };
    let slices: Vec<&[_]> = frames.iter().map(Vec::as_slice).collect();
    let together = fit_frames(&model, &slices, &Options::default()).unwrap();
    assert!(together.iter().all(|fit| fit.alpha == together[0].alpha));
    let single = fit(&model, &frames[0], &Options::default()).unwrap();
    assert!(off(&together[0]) < off(&single), "{} mm together, {} mm alone", off(&together[0]), off(&single));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let model = BodyModel::shipped();
    let rest = vec![0.0; model.rig().num_dofs()];
    let cameras = Ring { cameras: 4, size: 302, focal: 400.0, ..Ring::default() }.cameras();
    let views = seen(&posed(&model, &[0.7, -1.0], &rest), &cameras);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| fit(&model, &views, &Options::default()).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn the_pose_of_a_known_body_is_found_and_the_shape_stays() {
    let model = BodyModel::shipped();
    let alpha = [1.2, -0.8, 0.5];
    let shape = model.shape(&alpha);
    let mut pose = vec![0.0; model.rig().num_dofs()];
    let dof = |name: &str| model.rig().dof_index(name).unwrap();
    (pose[0], pose[2], pose[4]) = (0.3, -0.2, 2.0);
    (pose[dof("l_shoulder_abd")], pose[dof("r_elbow")]) = (0.9, 1.2);
    let mut posed = Posed::default();
    shape.pose(&model, &pose, &mut posed);
    let mesh = Mesh::new(posed.vertices.clone(), model.faces().to_vec()).unwrap();
    let cameras = Ring { cameras: 4, size: 502, focal: 663.0, ..Ring::default() }.cameras();
    let views = seen(&mesh, &cameras);
    let found = fit_pose(&model, &alpha, &views, &Options::default()).unwrap();
    assert_eq!(found.alpha[..3], alpha);
    assert!(found.alpha[3..].iter().all(|x| *x == 0.0));
    let worst = found.joints.iter().zip(&posed.joints).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst} m");
    let none = fit_pose(&model, &[f64::NAN], &views, &Options::default()).unwrap_err();
    assert!(none.to_string().contains("coefficients"), "{none}");
}
