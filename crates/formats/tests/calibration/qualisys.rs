//! The Qualisys calibration of a real capture, and the traps in it.

use std::path::Path;

use formats::{PointsOptions, calibration, trc};
use model::Camera;
use nalgebra::{Vector2, Vector3};
use serde_json::Value;

use crate::ring::{error, read};

const POSE2SIM: &str = "data/multiview/pose2sim-demo";

fn qualisys(folder: &Path) -> String {
    String::from_utf8(testkit::shared::read(folder, "calibration/Calib.qca.txt")).unwrap()
}

#[test]
fn a_qualisys_calibration_is_in_64ths_of_pixels_and_millimetres_with_z_up() {
    let test = "a_qualisys_calibration_is_in_64ths_of_pixels_and_millimetres_with_z_up";
    let Some(folder) = testkit::shared::find(POSE2SIM, test) else { return };
    let (cameras, warnings) = read("Calib.qca.txt", &qualisys(&folder));
    assert_eq!(warnings, Vec::<String>::new());
    let names: Vec<_> = cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(names, ["cam01", "cam02", "cam03", "cam04"]);
    let first = &cameras[0];
    assert_eq!(first.size, [1088, 1920]);
    assert!((first.focal - Vector2::new(107_599.671_875, 107_588.828_125) / 64.0).norm() < 1e-9);
    assert!((first.principal - Vector2::new(34_110.316_406, 60_680.792_969) / 64.0).norm() < 1e-9);
    assert_eq!((first.distortion.k1, first.distortion.p2), (-0.046183, 0.00069));
    // z up to y up: (x, y, z) is (x, z, -y)
    assert!((first.position() - Vector3::new(1.460_232, 1.896_506, 1.909_159)).norm() < 1e-5);
    for camera in &cameras {
        assert!((3.0..4.5).contains(&camera.position().norm()), "{}", camera.name);
        // portrait: the world's up is up in the picture (the cameras stand askew, by up to 18 degrees), and the origin on the floor is seen
        let origin = camera.project(&Vector3::zeros()).unwrap();
        let above = camera.project(&Vector3::y()).unwrap();
        assert!(
            above.y < origin.y - 200.0 && (above.x - origin.x).abs() < 0.5 * (origin.y - above.y),
            "{origin} {above}"
        );
        assert!((0.0..1088.0).contains(&origin.x) && (0.0..1920.0).contains(&origin.y), "{origin}");
    }
}

/// BODY_25B's index of a marker of the TRC.
fn keypoint(name: &str) -> Option<usize> {
    const NAMES: [&str; 25] = [
        "Nose",
        "LEye",
        "REye",
        "LEar",
        "REar",
        "LShoulder",
        "RShoulder",
        "LElbow",
        "RElbow",
        "LWrist",
        "RWrist",
        "LHip",
        "RHip",
        "LKnee",
        "RKnee",
        "LAnkle",
        "RAnkle",
        "Neck",
        "Head",
        "LBigToe",
        "LSmallToe",
        "LHeel",
        "RBigToe",
        "RSmallToe",
        "RHeel",
    ];
    NAMES.iter().position(|known| *known == name)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Distances of the projected markers from the detections of the person who fits best, for each camera, pixels.
fn reprojection(folder: &Path, cameras: &[Camera]) -> Vec<f64> {
    let trc = testkit::shared::read(folder, "results/balancing_body25b.trc");
    let markers = trc::read(&trc, &PointsOptions::default()).unwrap().value;
    let from_camera = |camera: &Camera| {
        let mut distances = Vec::new();
        for frame in (0..markers.num_frames()).step_by(5) {
            let name = format!("pose/{0}_json/{0}.{frame:04}.json", camera.name);
            let detections: Value = serde_json::from_slice(&testkit::shared::read(folder, &name)).unwrap();
            let from_person = |person: &Value| -> Vec<f64> {
                let number = |index: usize| person["pose_keypoints_2d"][index].as_f64().unwrap_or_default();
                let mut distances = Vec::new();
                for (point, name) in markers.names().iter().enumerate() {
                    let (Some(index), Some(p)) = (keypoint(name), markers.position(frame, point)) else {
                        continue;
                    };
                    // the TRC's (x, y, z) is the calibration's (y, z, x), which is Marey's (x, z, -y)
                    let pixel = camera.project(&Vector3::new(p.z, p.y, -p.x));
                    if number(3 * index + 2) > 0.3 {
                        let seen = Vector2::new(number(3 * index), number(3 * index + 1));
                        distances.push(pixel.map_or(f64::INFINITY, |pixel| (seen - pixel).norm()));
                    }
                }
                distances
            };
            let people =
                detections["people"].as_array().unwrap().iter().map(from_person).filter(|d| d.len() > 10);
            let best = people.min_by(|a, b| median(a.clone()).total_cmp(&median(b.clone())));
            distances.extend(best.into_iter().flatten());
        }
        median(distances)
    };
    cameras.iter().map(from_camera).collect()
}

#[test]
fn the_markers_of_the_qualisys_capture_are_where_its_cameras_saw_them() {
    let test = "the_markers_of_the_qualisys_capture_are_where_its_cameras_saw_them";
    let Some(folder) = testkit::shared::find(POSE2SIM, test) else { return };
    let (cameras, _) = read("Calib.qca.txt", &qualisys(&folder));
    let medians = reprojection(&folder, &cameras);
    println!("median distance of each camera, pixels: {medians:.1?}");
    // what triangulating the detections leaves in each camera (the data's README), to a pixel
    for (median, bound) in medians.iter().zip([17.0, 10.0, 19.0, 11.0]) {
        assert!(*median < bound, "{medians:.1?}");
    }
    // trap: the detections are in the calibration's frame, not in that of the narrower videos
    let fitted: Vec<_> =
        cameras.iter().map(|camera| calibration::fit_to_image(camera, [1080, 1920]).unwrap().value).collect();
    let as_videos = reprojection(&folder, &fitted);
    println!("as if they were in the videos' frame: {as_videos:.1?}");
    assert!(medians.iter().sum::<f64>() < as_videos.iter().sum::<f64>());
    // trap: the rows are the camera's axes, not the columns
    let text = qualisys(&folder);
    let columns = ["r12", "r13", "r21", "r23", "r31", "r32"]
        .iter()
        .fold(text, |text, name| text.replace(&format!(" {name}="), &format!(" x{name}=")));
    let columns = [
        ("xr12", "r21"),
        ("xr13", "r31"),
        ("xr21", "r12"),
        ("xr23", "r32"),
        ("xr31", "r13"),
        ("xr32", "r23"),
    ]
    .iter()
    .fold(columns, |text, (from, to)| text.replace(from, to));
    let (cameras, warnings) = read("Calib.qca.txt", &columns);
    assert!(warnings.len() > 2 && warnings[0].contains("is its picture turned?"), "{warnings:?}");
    assert!(reprojection(&folder, &cameras).iter().all(|median| *median > 100.0));
}

#[test]
fn what_is_wrong_in_a_qualisys_file_is_told_with_its_line() {
    let test = "what_is_wrong_in_a_qualisys_file_is_told_with_its_line";
    let Some(folder) = testkit::shared::find(POSE2SIM, test) else { return };
    let text = qualisys(&folder);
    let broken = text.replacen("r22=\"0.05946489349975602\"", "r22=\"nan\"", 1);
    assert_eq!(error("q.txt", &broken), "line 10: found transform r22=\"nan\", expected a number");
    let broken = text.replacen("</camera>", "", 1);
    assert!(error("q.txt", &broken).contains("found text that is not XML"));
    let turned = text.replacen("viewrotation=\"0\"", "viewrotation=\"90\"", 1);
    assert!(read("q.txt", &turned).1[0].starts_with("line 5: camera cam01: shown turned by 90 degrees"));
    assert_eq!(
        error("q.txt", "<a/>"),
        "line 1: found \"a\", expected calibration, the root of a Qualisys calibration"
    );
}
