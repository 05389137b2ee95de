//! Sessions of a few measured points, with silhouettes of one or more cameras and without, by inverse kinematics.

use anyhow::{Context, Result, ensure};
use body::{BodyModel, Posed, Wanted};
use formats::{calibration, image_files, points_csv};
use model::{Camera, Mesh, PointTrajectories};
use nalgebra::Vector3;
use serde_json::{Value, json};
use tests::{Api, System};
use vision::scene::{Ring, silhouettes};

use crate::cameras::tar;

const FRAMES: usize = 16;
const VIDEO_RATE: f64 = 30.0;
/// Points are measured four times as often.
const POINTS_RATE: f64 = 120.0;
const STATURE_M: f64 = 1.82;
const MEASURED: [(&str, &str); 6] = [
    ("left_wrist", "l_wrist"),
    ("right_wrist", "r_wrist"),
    ("left_ankle", "l_ankle"),
    ("right_ankle", "r_ankle"),
    ("root", "pelvis"),
    ("neck", "neck"),
];
const INNER: [&str; 4] = ["l_elbow", "r_elbow", "l_knee", "r_knee"];

/// A capture that we have drawn ourselves.
pub(crate) struct Capture {
    pub(crate) calibration: Vec<u8>,
    pub(crate) masks: Vec<u8>,
    pub(crate) points: Vec<u8>,
    /// true elbows and knees, shape `[frames][4]`
    inner: Vec<[Vector3<f64>; 4]>,
}

/// Someone who turns, bends arms and knees.
fn pose(model: &BodyModel, seconds: f64) -> Vec<f64> {
    let mut pose = vec![0.0; model.rig().num_dofs()];
    pose[..6].copy_from_slice(&[0.2 * seconds, 0.0, 0.1, 0.0, 1.0 + 0.8 * seconds, 0.0]);
    for (value, dof) in pose.iter_mut().zip(model.rig().dofs()) {
        let Some([low, high]) = dof.limits else { continue };
        let swing = (6.0 * seconds + if dof.name.starts_with('l') { 0.0 } else { 2.0 }).sin();
        let middle = if dof.name.contains("elbow") || dof.name.contains("knee") { 0.9 } else { 0.1 };
        *value = (middle + 0.35 * swing).clamp(low, high);
    }
    pose
}

pub(crate) fn capture(num_cameras: usize) -> Result<Capture> {
    let model = BodyModel::shipped();
    let wanted = Wanted { stature_m: Some(STATURE_M), ..Wanted::default() };
    let shape = model.shape(&model.alpha_for(&wanted)?);
    let joint = |name: &str| model.rig().joint_index(name).context("no such joint");
    let ring = Ring { cameras: 4, size: 320, focal: 400.0, start: 0.3, ..Ring::default() };
    let cameras: Vec<Camera> = ring.cameras().into_iter().take(num_cameras).collect();
    let mut posed = Posed::default();
    let (mut archive, mut inner) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        shape.pose(&model, &pose(&model, frame as f64 / VIDEO_RATE), &mut posed);
        let mesh = Mesh { vertices: posed.vertices.clone(), faces: model.faces().to_vec() };
        for (camera, silhouette) in cameras.iter().zip(silhouettes(&mesh, &cameras)) {
            let name = format!("{}/{frame:04}.png", camera.name);
            archive.push((name, image_files::write_silhouette(&silhouette)));
        }
        let mut places = [Vector3::zeros(); 4];
        for (place, name) in places.iter_mut().zip(INNER) {
            *place = posed.joints[joint(name)?];
        }
        inner.push(places);
    }
    let samples = (FRAMES - 1) * (POINTS_RATE / VIDEO_RATE) as usize + 1;
    let mut positions = Vec::new();
    for sample in 0..samples {
        shape.pose_joints(&model, &pose(&model, sample as f64 / POINTS_RATE), &mut posed);
        for (_, name) in MEASURED {
            positions.push(posed.joints[joint(name)?]);
        }
        // a marker that is no point of the body
        positions.push(Vector3::zeros());
    }
    let names = MEASURED.iter().map(|(name, _)| (*name).to_owned()).chain(["wand".to_owned()]);
    let points = PointTrajectories::new(names.collect(), POINTS_RATE, positions)?;
    let files: Vec<(&str, &[u8])> =
        archive.iter().map(|(name, png)| (name.as_str(), png.as_slice())).collect();
    Ok(Capture {
        calibration: calibration::write(&cameras).into(),
        masks: tar(&files)?,
        points: points_csv::write(&points).into(),
        inner,
    })
}

fn result(api: &Api, run: &str, name: &str) -> Result<String> {
    let answer = api.get(&format!("{run}/results/{name}"))?;
    ensure!(answer.status == 200, "{name}: {}", String::from_utf8_lossy(&answer.body));
    Ok(String::from_utf8(answer.body)?)
}

/// Mean distance of elbows and knees from the true ones, millimetres.
fn inner_error(joints_csv: &str, inner: &[[Vector3<f64>; 4]]) -> Result<f64> {
    let mut lines = joints_csv.lines();
    let header: Vec<&str> = lines.next().context("no header")?.split(',').collect();
    let (mut sum, mut count) = (0.0, 0);
    for (line, truth) in lines.zip(inner) {
        let cells: Vec<f64> = line.split(',').map(str::parse).collect::<Result<_, _>>()?;
        for (name, truth) in INNER.iter().zip(truth) {
            let at = |axis: &str| {
                let column = header.iter().position(|cell| *cell == format!("{name}_{axis}"));
                column.map(|column| cells[column]).context("no such column")
            };
            sum += (Vector3::new(at("x")?, at("y")?, at("z")?) - truth).norm();
            count += 1;
        }
    }
    ensure!(count == 4 * inner.len(), "found {count} joints");
    Ok(1000.0 * sum / f64::from(u32::try_from(count)?))
}

#[test]
fn silhouettes_of_two_cameras_find_elbows_and_knees_that_measured_points_do_not() -> Result<()> {
    let mut system = System::with_shape_init(2)?;
    system.start_reconstruction(1)?;
    let api = system.project("p")?;
    let capture = capture(2)?;
    let session = api.session(
        "take",
        &[
            ("calibration.json", &capture.calibration),
            ("silhouettes.tar", &capture.masks),
            ("points.csv", &capture.points),
        ],
    )?;
    let run = |solver: &str| -> Result<(f64, Value, String)> {
        let how = json!({ "solver": solver, "stature_m": STATURE_M, "frame_rate": VIDEO_RATE });
        let run =
            api.start_run(&session, &json!({ "kind": "inverse-kinematics", "inverse_kinematics": how }))?;
        let end = api.wait(&run)?;
        ensure!(end["state"] == "succeeded", "{end}");
        let report: Value = serde_json::from_str(&result(&api, &run, "run.json")?)?;
        let error = inner_error(&result(&api, &run, "joints.csv")?, &capture.inner)?;
        println!("{solver}: elbows and knees {error:.1} mm, {}", report["quality"]);
        Ok((error, report, run))
    };
    let (plain, report, _) = run("plain")?;
    assert_eq!((&report["cameras"], &report["quality"]["mean_overlap"]), (&json!([]), &Value::Null));
    let (image, report, run) = run("image-constrained")?;
    assert!(image < 0.6 * plain && image < 30.0, "{image} mm, without images {plain} mm");
    assert!(report["quality"]["mean_residual_m"].as_f64().is_some_and(|m| m < 0.005), "{report}");
    assert!(report["quality"]["mean_overlap"].as_f64().is_some_and(|overlap| overlap > 0.3), "{report}");
    assert!(report["warnings"].to_string().contains("wand"), "{}", report["warnings"]);
    assert_eq!(report["cameras"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["session"]["frames"], FRAMES);
    let motion = formats::bvh::read(result(&api, &run, "motion.bvh")?.as_bytes(), &Default::default())?.value;
    assert_eq!(motion.num_frames(), FRAMES);
    assert!((motion.frame_rate() - VIDEO_RATE).abs() < 0.01, "{}", motion.frame_rate());
    assert_eq!(result(&api, &run, "quality.csv")?.lines().count(), FRAMES + 1);
    let shown = api.get(&run)?.json();
    assert_eq!((&shown["kind"], &shown["state"]), (&json!("inverse-kinematics"), &json!("succeeded")));
    Ok(())
}

#[test]
fn one_camera_is_enough_and_none_too() -> Result<()> {
    let mut system = System::with_shape_init(1)?;
    system.start_reconstruction(1)?;
    let api = system.project("p")?;
    let capture = capture(1)?;
    let points = ("points.csv", capture.points.as_slice());
    let with_camera =
        [("calibration.json", capture.calibration.as_slice()), ("silhouettes.tar", &capture.masks), points];
    for (files, solver) in [(&with_camera[..], "image-constrained"), (&[points][..], "priority")] {
        let session = api.session("take", files)?;
        let run = api.start_run(&session, &json!({ "inverse_kinematics": { "stature_m": STATURE_M } }))?;
        let end = api.wait(&run)?;
        ensure!(end["state"] == "succeeded", "{end}");
        let report: Value = serde_json::from_str(&result(&api, &run, "run.json")?)?;
        assert_eq!(report["parameters"]["solver"], solver);
        let shown = api.get(&run)?.json();
        assert_eq!(shown["parameters"]["inverse_kinematics"]["solver"], solver, "with cameras and without");
        assert!(report["quality"]["mean_residual_m"].as_f64().is_some_and(|m| m < 0.01), "{report}");
    }
    let session = api.session("take", &[points])?;
    let refused = |request: Value, word: &str| -> Result<()> {
        let answer = api.post(&format!("{session}/runs"), &request)?;
        let detail = answer.json()["detail"].as_str().unwrap_or_default().to_owned();
        ensure!(answer.status == 422 && detail.contains(word), "{} {detail}", answer.status);
        Ok(())
    };
    refused(json!({ "inverse_kinematics": { "solver": "extended" } }), "needs silhouettes")?;
    refused(json!({ "inverse_kinematics": { "solver": "magic" } }), "solver is \"magic\"")?;
    refused(json!({ "inverse_kinematics": { "steps": 0 } }), "steps is 0, expected 1 to 200")?;
    refused(json!({ "kind": "sparse", "inverse_kinematics": {} }), "but of inverse-kinematics runs")?;
    refused(json!({ "inverse_kinematics": {}, "motion_database": "walks" }), "but of sparse runs")?;
    refused(
        json!({ "inverse_kinematics": {}, "cameras": ["cam1"] }),
        "cameras is for runs that use cameras",
    )?;
    // none of the names that could be meant can be used
    refused(
        json!({ "inverse_kinematics": {}, "parameters": { "x": 1 } }),
        "parameters is for runs that use cameras",
    )?;
    // what only the model knows ends the run, with words
    let run =
        api.start_run(&session, &json!({ "inverse_kinematics": { "stature_m": 1.0, "mass_kg": 250 } }))?;
    let end = api.wait(&run)?;
    ensure!(
        end["state"] == "failed" && end["error"].to_string().contains("those measurements are too unusual"),
        "{end}"
    );
    Ok(())
}
