//! Sessions with cameras, end to end.

use std::{fs, path::Path};

use anyhow::{Context, Result, ensure};
use nalgebra::Vector3;
use serde_json::{Value, json};
use tests::{Api, System};

const SYNTHETIC: &str = "data/multiview/synthetic-8cam";
const REAL: &str = "data/multiview/pose2sim-demo";

/// An archive.
pub(crate) fn tar(files: &[(&str, &[u8])]) -> Result<Vec<u8>> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, bytes) in files {
        let mut header = tar::Header::new_gnu();
        header.set_size(bytes.len() as u64);
        header.set_mode(0o644);
        builder.append_data(&mut header, name, *bytes)?;
    }
    Ok(builder.into_inner()?)
}

/// Masks of the first frames of some cameras, a folder each, as an archive.
fn masks(data: &Path, cameras: std::ops::Range<usize>, frames: usize) -> Result<Vec<u8>> {
    let mut files = Vec::new();
    for camera in cameras {
        for frame in 0..frames {
            let name = format!("cam{camera}/{frame:04}.png");
            files.push((name.clone(), fs::read(data.join("silhouettes").join(&name))?));
        }
    }
    tar(&files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect::<Vec<_>>())
}

/// The end of a run of a session of these files.
fn run(api: &Api, files: &[(&str, &[u8])], request: &Value) -> Result<(String, Value)> {
    let session = api.session("take", files)?;
    let run = api.start_run(&session, request)?;
    let end = api.wait(&run)?;
    Ok((run, end))
}

fn result(api: &Api, run: &str, name: &str) -> Result<Vec<u8>> {
    let answer = api.get(&format!("{run}/results/{name}"))?;
    ensure!(answer.status == 200, "{name}: {}", String::from_utf8_lossy(&answer.body));
    Ok(answer.body)
}

/// Writes a picture where people look for it and says where.
fn keep(name: &str, bytes: &[u8]) -> Result<()> {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, bytes)?;
    println!("picture: {}", path.display());
    Ok(())
}

#[test]
fn a_body_is_found_in_the_masks_of_eight_cameras() -> Result<()> {
    let name = "a_body_is_found_in_the_masks_of_eight_cameras";
    let Some(data) = testkit::shared::find(SYNTHETIC, name) else { return Ok(()) };
    let system = System::with_shape_init(2)?;
    let api = system.project("p")?;
    let calibration = fs::read(data.join("calibration.json"))?;
    let masks = masks(&data, 0..8, 2)?;
    let (run, end) = run(
        &api,
        &[("calibration.json", &calibration), ("silhouettes.tar", &masks)],
        &json!({"parameters": {"track": false}}),
    )?;
    ensure!(end["state"] == "succeeded", "{end}");

    let shape: Value = serde_json::from_slice(&result(&api, &run, "shape.json")?)?;
    let subject: Value = serde_json::from_slice(&fs::read(data.join("groundtruth/subject.json"))?)?;
    let stature = |value: &Value| value["stature_m"].as_f64().context("no stature");
    let off = (stature(&shape["measurements"])? - stature(&subject)?).abs();
    assert!(off < 0.015, "stature is off by {off} m");
    let found = formats::ply::read(&result(&api, &run, "mesh.ply")?)?.value;
    let truth = formats::ply::read(&fs::read(data.join("groundtruth/mesh_0000.ply"))?)?.value;
    let distances = evaluation::surface::compare_surfaces(&found, &truth, 20_000, 1)?.both;
    println!("surface: mean {:.1} mm, std {:.1} mm", 1e3 * distances.mean_abs_m, 1e3 * distances.std_m);
    assert!(distances.mean_abs_m <= 0.008 && distances.std_m <= 0.010, "{distances:?}");
    let joints = joint_error(&shape, &data)?;
    println!("joints: mean {:.1} mm", 1e3 * joints);
    assert!(joints <= 0.020, "joints are off by {joints} m");

    for name in ["body.glb", "hull.ply", "pose.bvh", "silhouette_cam0.png", "run.json"] {
        assert!(!result(&api, &run, name)?.is_empty(), "{name}");
    }
    let motion = formats::bvh::read(&result(&api, &run, "pose.bvh")?, &formats::BvhOptions::default())?.value;
    assert_eq!(motion.num_frames(), 1);
    keep("overlay_synthetic_cam0.png", &result(&api, &run, "overlay_cam0.png")?)?;
    let report: Value = serde_json::from_slice(&result(&api, &run, "run.json")?)?;
    assert_eq!(report["kind"], "multi-view");
    assert_eq!(report["cameras"].as_array().map(Vec::len), Some(8));
    let shown = api.get(&run)?.json();
    assert_eq!(shown["parameters"]["parameters"]["shape_frames"], 1);
    assert_eq!(shown["parameters"]["body_model"]["name"], "shipped");
    Ok(())
}

/// Mean distance of the joints of the first frame from the true ones, metres.
fn joint_error(shape: &Value, data: &Path) -> Result<f64> {
    let truth: Value = serde_json::from_slice(&fs::read(data.join("groundtruth/joints.json"))?)?;
    let point = |value: &Value| -> Option<Vector3<f64>> {
        Some(Vector3::new(value[0].as_f64()?, value[1].as_f64()?, value[2].as_f64()?))
    };
    let names = truth["joint_names"].as_array().context("no names")?;
    let places = truth["frames"][0]["joints"].as_array().context("no joints")?;
    let mut sum = 0.0;
    for (name, place) in names.iter().zip(places) {
        let name = name.as_str().context("no name")?;
        let found = point(&shape["frames"][0]["joints_m"][name]).with_context(|| name.to_owned())?;
        sum += (found - point(place).context("no place")?).norm();
    }
    Ok(sum / names.len() as f64)
}

#[test]
fn a_real_capture_ends_in_a_body_or_in_words_that_help() -> Result<()> {
    let name = "a_real_capture_ends_in_a_body_or_in_words_that_help";
    let Some(data) = testkit::shared::find(REAL, name) else { return Ok(()) };
    let system = System::with_shape_init(2)?;
    let api = system.project("p")?;
    let mut files = vec![("Calib.qca.txt".to_owned(), fs::read(data.join("calibration/Calib.qca.txt"))?)];
    for camera in ["cam01", "cam02", "cam03", "cam04"] {
        files.push((format!("{camera}.mp4"), fs::read(data.join(format!("videos/{camera}.mp4")))?));
        let plate = fs::read(data.join(format!("calibration/extrinsics/{camera}_ext.png")))?;
        files.push((format!("{camera}.plate.png"), plate));
    }
    let files: Vec<(&str, &[u8])> =
        files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    let (run, end) = run(&api, &files, &json!({"parameters": {"num_frames": 12, "track": false}}))?;
    println!("{end}");
    for camera in ["cam01", "cam02", "cam03", "cam04"] {
        keep(&format!("silhouette_{camera}.png"), &result(&api, &run, &format!("silhouette_{camera}.png"))?)?;
    }
    let said = if end["state"] == "succeeded" {
        keep("overlay_cam04.png", &result(&api, &run, "overlay_cam04.png")?)?;
        String::from_utf8(result(&api, &run, "run.json")?)?
    } else {
        assert_eq!(end["state"], "failed");
        end["error"].as_str().unwrap_or_default().to_owned()
    };
    assert!(
        said.contains("cam02") && said.contains("plate"),
        "the quality warns of camera 2's plate: {said}"
    );
    Ok(())
}

#[test]
fn what_cameras_cannot_have_seen_is_refused_with_the_file() -> Result<()> {
    let Some(data) =
        testkit::shared::find(SYNTHETIC, "what_cameras_cannot_have_seen_is_refused_with_the_file")
    else {
        return Ok(());
    };
    let system = System::with_shape_init(2)?;
    let api = system.project("p")?;
    let calibration = fs::read(data.join("calibration.json"))?;
    let png = fs::read(data.join("silhouettes/cam0/0000.png"))?;
    let wide = formats::image_files::write_silhouette(&model::Silhouette::empty(640, 200));
    let failed = |archive: Vec<u8>, request: &Value| -> Result<String> {
        let files = [("calibration.json", calibration.as_slice()), ("masks.tar", &archive)];
        let (_, end) = run(&api, &files, request)?;
        ensure!(end["state"] == "failed", "{end}");
        Ok(end["error"].as_str().unwrap_or_default().to_owned())
    };
    let error = failed(tar(&[("cam0/0.png", &png), ("cam1/0.png", b"no picture at all")])?, &json!({}))?;
    assert!(error.contains("masks.tar") && error.contains("cam1/0.png"), "{error}");
    let error = failed(tar(&[("cam0/0.png", &png), ("cam1/0.png", &wide)])?, &json!({}))?;
    assert!(error.contains("640 x 200") && error.contains("1004 x 1004"), "{error}");
    let two = tar(&[("cam0/0.png", &png), ("cam1/0.png", &png)])?;
    let error = failed(two.clone(), &json!({"cameras": ["cam0", "cam5"]}))?;
    assert!(error.contains("camera cam5"), "{error}");
    let error = failed(tar(&[("cam0/0.png", &png), ("phone/0.png", &png)])?, &json!({}))?;
    assert!(error.contains("masks.tar/phone") && error.contains("cam0, cam1"), "{error}");
    let error = failed(two, &json!({"parameters": {"first_frame": 7}}))?;
    assert!(error.contains("first_frame"), "{error}");
    Ok(())
}

#[test]
fn a_video_that_is_cut_short_is_named() -> Result<()> {
    let Some(data) = testkit::shared::find(REAL, "a_video_that_is_cut_short_is_named") else { return Ok(()) };
    let system = System::with_shape_init(2)?;
    let api = system.project("p")?;
    let calibration = fs::read(data.join("calibration/Calib.qca.txt"))?;
    let whole = fs::read(data.join("videos/cam01.mp4"))?;
    let files = [
        ("Calib.qca.txt", calibration.as_slice()),
        ("cam01.mp4", &whole[..whole.len() / 2]),
        ("cam02.mp4", &whole[..whole.len() / 2]),
    ];
    let (_, end) = run(&api, &files, &json!({}))?;
    assert_eq!(end["state"], "failed");
    let error = end["error"].as_str().unwrap_or_default();
    assert!(error.contains("cam0") && error.contains(".mp4") && !error.contains("/tmp"), "{error}");
    Ok(())
}

#[test]
fn a_request_for_the_wrong_kind_of_session_is_refused() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let refused = |files: &[(&str, &[u8])], request: Value, word: &str| -> Result<()> {
        let session = api.session("take", files)?;
        let answer = api.post(&format!("{session}/runs"), &request)?;
        let detail = answer.json()["detail"].as_str().unwrap_or_default().to_owned();
        ensure!(answer.status == 422 && detail.contains(word), "{} {detail}", answer.status);
        Ok(())
    };
    refused(&[], json!({}), "neither control points nor cameras")?;
    refused(&[("calib.toml", b"x")], json!({}), "no video, images or masks")?;
    refused(
        &[("calib.toml", b"x"), ("cam1.mp4", b"x")],
        json!({"points": ["head"]}),
        "points is not a field of multi-view runs",
    )?;
    refused(&[("calib.toml", b"x"), ("cam1.mp4", b"x")], json!({"background": "green"}), "green")?;
    refused(
        &[("calib.toml", b"x"), ("cam1.mp4", b"x")],
        json!({"parameters": {"shape_frames": 0}}),
        "shape_frames",
    )?;
    refused(&[("calib.toml", b"x"), ("points.csv", b"x")], json!({}), "kind is required")?;
    refused(
        &[("points.csv", b"x")],
        json!({"body_model": "shipped"}),
        "body_model is not a field of sparse runs",
    )?;
    refused(&[("points.csv", b"x")], json!({"kind": "holographic"}), "holographic")
}
