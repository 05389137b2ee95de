//! Calibration files: those of the shared captures, the dialects they don't show, and what must be refused.

use std::path::Path;

use formats::{
    PointsOptions,
    calibration::{self, Options, UpAxis},
    trc,
};
use model::Camera;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use serde_json::{Value, json};

const SYNTHETIC: &str = "data/multiview/synthetic-8cam";
const POSE2SIM: &str = "data/multiview/pose2sim-demo";

fn read(name: &str, text: &str) -> (Vec<Camera>, Vec<String>) {
    let read = calibration::read(name, text.as_bytes(), &Options::default()).unwrap();
    (read.value, read.warnings.iter().map(ToString::to_string).collect())
}

fn error(name: &str, text: &str) -> String {
    calibration::read(name, text.as_bytes(), &Options::default()).unwrap_err().to_string()
}

/// Largest difference of the projections of a few points, pixels.
fn difference(a: &Camera, b: &Camera) -> f64 {
    let points = [Vector3::new(0.1, 0.9, 0.2), Vector3::new(-0.4, 1.7, 0.1), Vector3::new(0.3, 0.0, -0.2)];
    let off = |point: &Vector3<f64>| (a.project(point).unwrap() - b.project(point).unwrap()).norm();
    points.iter().map(off).fold(0.0, f64::max)
}

/// Four cameras 1.5 m above the floor in a ring of 3 m, y up, that look at (0, 1, 0).
fn ring() -> Vec<Camera> {
    let camera = |index: usize| {
        let angle = index as f64 * 1.4 + 0.3;
        let position = Vector3::new(3.0 * angle.sin(), 1.5, 3.0 * angle.cos());
        let forward = (Vector3::y() - position).normalize();
        let right = forward.cross(&Vector3::y()).normalize();
        let rotation = Matrix3::from_columns(&[right, forward.cross(&right), forward]).transpose();
        let rotation = Rotation3::from_matrix_unchecked(rotation);
        Camera {
            name: format!("cam{index}"),
            size: [1280, 720],
            focal: Vector2::new(900.0 + index as f64, 905.0),
            principal: Vector2::new(640.0, 355.5),
            distortion: model::Distortion { k1: -0.1, k2: 0.02, k3: 0.001, p1: 0.0005, p2: -0.0003 },
            camera_from_world: nalgebra::Isometry3::from_parts(
                (-(rotation * position)).into(),
                rotation.into(),
            ),
        }
    };
    (0..4).map(camera).collect()
}

/// The plain JSON of the ring, without what it says about axes and unit.
fn ring_json() -> Value {
    let mut file: Value = serde_json::from_str(&calibration::write(&ring())).unwrap();
    for key in ["up", "unit", "convention"] {
        file.as_object_mut().unwrap().remove(key);
    }
    file
}

#[test]
fn json_and_yaml_of_the_synthetic_capture_are_the_same_cameras() {
    let test = "json_and_yaml_of_the_synthetic_capture_are_the_same_cameras";
    let Some(folder) = testdata::shared(SYNTHETIC, test) else { return };
    let of = |name: &str| read(name, &String::from_utf8(testdata::read(&folder, name)).unwrap());
    let (json, json_warnings) = of("calibration.json");
    let (yaml, yaml_warnings) = of("calibration.yml");
    assert_eq!((json_warnings, yaml_warnings), (vec![], vec![]));
    assert_eq!((json.len(), yaml.len()), (8, 8));
    let file: Value = serde_json::from_slice(&testdata::read(&folder, "calibration.json")).unwrap();
    for (index, (a, b)) in json.iter().zip(&yaml).enumerate() {
        assert_eq!((a.name.as_str(), a.size), (format!("cam{index}").as_str(), [1004, 1004]));
        assert_eq!((&a.name, a.size), (&b.name, b.size));
        assert!(difference(a, b) < 1e-6);
        let centre = |axis: usize| file["cameras"][index]["center"][axis].as_f64().unwrap();
        assert!((a.position() - Vector3::new(centre(0), centre(1), centre(2))).norm() < 1e-9);
        assert!((0.9..1.8).contains(&a.position().y));
    }
}

#[test]
fn joints_of_the_synthetic_capture_are_inside_its_silhouettes() {
    let test = "joints_of_the_synthetic_capture_are_inside_its_silhouettes";
    let Some(folder) = testdata::shared(SYNTHETIC, test) else { return };
    let (cameras, _) =
        read("calibration.json", &String::from_utf8(testdata::read(&folder, "calibration.json")).unwrap());
    let joints: Value = serde_json::from_slice(&testdata::read(&folder, "groundtruth/joints.json")).unwrap();
    let list = joints["frames"][0]["joints"].as_array().unwrap();
    let (mut inside, mut all) = (0, 0);
    for camera in &cameras {
        let mask = testdata::read(&folder, &format!("silhouettes/{}/0000.png", camera.name));
        let mask = formats::image_files::read_silhouette(&mask, &formats::image_files::Limits::default())
            .unwrap()
            .value;
        for joint in list {
            let position = Vector3::new(
                joint[0].as_f64().unwrap(),
                joint[1].as_f64().unwrap(),
                joint[2].as_f64().unwrap(),
            );
            let pixel = camera.project(&position).unwrap();
            all += 1;
            inside += usize::from(mask.contains(pixel.x.round() as isize, pixel.y.round() as isize));
        }
    }
    assert_eq!((inside, all), (all, 8 * 21));
}

#[test]
fn what_is_written_is_read_again() {
    let (cameras, warnings) = read("cameras.json", &calibration::write(&ring()));
    assert_eq!(warnings, Vec::<String>::new());
    for (a, b) in ring().iter().zip(&cameras) {
        assert_eq!((&a.name, a.size), (&b.name, b.size));
        assert!(difference(a, b) < 1e-9);
    }
}

/// The same cameras in a world where z is up, in the unit of `per_metre`, as TOML.
fn toml(per_metre: f64) -> String {
    let mut text = String::new();
    for camera in ring() {
        // y up to z up: (x, y, z) is (x, -z, y)
        let z_up =
            Rotation3::from_matrix_unchecked(Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0));
        let rotation = camera.camera_from_world.rotation.to_rotation_matrix() * z_up.inverse();
        let (r, t) = (rotation.scaled_axis(), camera.camera_from_world.translation.vector * per_metre);
        let d = camera.distortion;
        text += &format!(
            "[{}]\nname = \"{}\"\nsize = [ {}.0, {}.0,]\nmatrix = [ [ {}, 0.0, {},], [ 0.0, {}, {},], [ 0.0, 0.0, 1.0,],]\n\
             distortions = [ {}, {}, {}, {}, {},]\nrotation = [ {}, {}, {},]\ntranslation = [ {}, {}, {},]\nfisheye = false\n\n",
            camera.name,
            camera.name,
            camera.size[0],
            camera.size[1],
            camera.focal.x,
            camera.principal.x,
            camera.focal.y,
            camera.principal.y,
            d.k1,
            d.k2,
            d.p1,
            d.p2,
            d.k3,
            r.x,
            r.y,
            r.z,
            t.x,
            t.y,
            t.z
        );
    }
    text + "[metadata]\nadjusted = false\nerror = 0.0\n"
}

#[test]
fn toml_of_pose2sim_is_z_up_with_rotation_vectors() {
    let (cameras, warnings) = read("Calib_scene.toml", &toml(1.0));
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(cameras.len(), 4);
    for (a, b) in ring().iter().zip(&cameras) {
        assert_eq!((&a.name, a.size), (&b.name, b.size));
        assert!(difference(a, b) < 1e-6, "{}", difference(a, b));
    }
    // Caliscope keeps them in a table of their own
    let nested = toml(1.0).replace("[cam", "[cameras.cam");
    assert_eq!(read("camera_array.toml", &nested).0, cameras);
}

#[test]
fn millimetres_are_noticed_and_not_converted() {
    let message = error("calibration.toml", &toml(1000.0));
    assert!(message.contains("looks like millimetres, expected metres"), "{message}");
    let options = Options { metres_per_unit: Some(1e-3), ..Options::default() };
    let cameras = calibration::read("calibration.toml", toml(1000.0).as_bytes(), &options).unwrap().value;
    assert!(difference(&ring()[1], &cameras[1]) < 1e-6);
    let stated = format!("unit = \"mm\"\n{}", toml(1000.0));
    assert!(difference(&ring()[1], &read("calibration.toml", &stated).0[1]) < 1e-6);
    let message = error("calibration.toml", &toml(0.01));
    assert!(message.contains("stand 0.03"), "{message}");
}

#[test]
fn fisheye_lenses_are_refused() {
    let message = error("a.toml", &toml(1.0).replacen("fisheye = false", "fisheye = true", 1));
    assert_eq!(
        message,
        "file: found camera cam0: a fisheye lens, expected a lens with radial and tangential distortion"
    );
}

#[test]
fn a_world_whose_up_is_not_told_is_that_of_the_pictures_with_a_warning() {
    let text = toml(1.0);
    let (cameras, warnings) = read("calibration.yml", &ring_json().to_string());
    assert_eq!((cameras.len(), warnings), (4, vec![]));
    // the same file in a format that is usually y up
    let as_json: Value = toml_to_json(&text);
    let (cameras, warnings) = read("calibration.json", &as_json.to_string());
    assert!(
        warnings[0].contains("taken as z, where the pictures' upper edges are (usual in this format: y)")
    );
    assert!(difference(&ring()[2], &cameras[2]) < 1e-6);
    let options = Options { up: Some(UpAxis::Y), ..Options::default() };
    let forced =
        calibration::read("calibration.json", as_json.to_string().as_bytes(), &options).unwrap().value;
    assert!((forced[0].position().z.abs() - 1.5).abs() < 1e-6, "taken as it was asked for");
}

fn toml_to_json(text: &str) -> Value {
    // the TOML above is simple enough for the reader of lists
    let mut cameras = serde_json::Map::new();
    let mut name = String::new();
    for line in text.lines() {
        if let Some(table) = line.strip_prefix('[') {
            name = table.trim_end_matches(']').to_owned();
            cameras.insert(name.clone(), json!({}));
        } else if let Some((key, value)) = line.split_once(" = ") {
            let value = value.replace(",]", "]");
            cameras[&name][key] = serde_json::from_str(&value).unwrap();
        }
    }
    Value::Object(cameras)
}

#[test]
fn cameras_that_cannot_be_are_refused_by_name() {
    let change = |change: &dyn Fn(&mut Value)| {
        let mut file = ring_json();
        change(&mut file);
        file
    };
    let mirrored = change(&|file| {
        for row in 0..3 {
            let x = file["cameras"][1]["R"][row][0].as_f64().unwrap();
            file["cameras"][1]["R"][row][0] = json!(-x);
        }
    });
    assert!(error("c.json", &mirrored.to_string()).starts_with(
        "file: found camera cam1: a rotation that mirrors (determinant -1), expected a right-handed one"
    ));
    let skewed = change(&|file| file["cameras"][2]["R"][0][0] = json!(0.5));
    assert!(
        error("c.json", &skewed.to_string())
            .contains("camera cam2: a rotation whose rows are not orthonormal")
    );
    let twice = change(&|file| file["cameras"][3]["name"] = json!("cam0"));
    assert!(error("c.json", &twice.to_string()).contains("a second camera named \"cam0\""));
    let lens = change(&|file| file["cameras"][0]["dist"] = json!([0.1, 0, 0, 0, 0, 0.2, 0, 0]));
    assert!(
        error("c.json", &lens.to_string()).contains("8 coefficients of distortion, number 6 of them 0.2")
    );
    let focal = change(&|file| file["cameras"][0]["K"][0][0] = json!(-900));
    assert!(error("c.json", &focal.to_string()).contains("camera cam0: focal lengths are -900"));
    let missing = change(&|file| drop(file["cameras"][0].as_object_mut().unwrap().remove("t")));
    assert!(
        error("c.json", &missing.to_string())
            .contains("camera cam0: no translation, expected 3 numbers, named t, T")
    );
    assert!(error("c.json", "{}").contains("found no camera"));
    assert!(error("c.json", "{\"cameras\": [").starts_with("line 1: found no JSON"));
    assert!(error("c.toml", "[cam\nx = 1").starts_with("line 1: found no TOML"));
}

#[test]
fn poses_given_the_other_way_round_are_noticed() {
    let mut file = ring_json();
    for (camera, value) in ring().iter().zip(file["cameras"].as_array_mut().unwrap()) {
        let pose = camera.camera_from_world.inverse();
        let r = pose.rotation.to_rotation_matrix();
        let t = pose.translation.vector;
        value["R"] = json!((0..3).map(|i| (0..3).map(|j| r[(i, j)]).collect::<Vec<_>>()).collect::<Vec<_>>());
        value["t"] = json!([t.x, t.y, t.z]);
    }
    let message = error("c.json", &file.to_string());
    assert!(message.contains("the file seems to have the cameras' poses in the world"), "{message}");
}

#[test]
fn cameras_upside_down_in_a_file_that_says_up_are_refused() {
    let mut file: Value = serde_json::from_str(&calibration::write(&ring())).unwrap();
    file["up"] = json!("-y");
    assert!(error("c.json", &file.to_string()).contains("4 of 4 cameras upside down"));
    let options = Options { up: Some(UpAxis::MinusY), ..Options::default() };
    let read = calibration::read("c.json", file.to_string().as_bytes(), &options).unwrap();
    let warnings: Vec<_> = read.warnings.iter().map(ToString::to_string).collect();
    assert!(
        warnings.contains(&"camera cam0: it is upside down; is its picture turned?".to_owned()),
        "{warnings:?}"
    );
    assert!(warnings.iter().any(|w| w.contains("it stands 1.50 m below the floor")), "{warnings:?}");
}

#[test]
fn a_size_that_is_not_given_is_asked_for_or_assumed_with_a_warning() {
    let mut file = ring_json();
    for camera in file["cameras"].as_array_mut().unwrap() {
        camera.as_object_mut().unwrap().remove("image_width");
    }
    let (cameras, warnings) = read("c.json", &file.to_string());
    assert_eq!(cameras[0].size, [1281, 712]);
    assert!(warnings[0].contains("camera cam0: the size of its pictures is not given"), "{}", warnings[0]);
    let options = Options { image_size: Some([1280, 720]), ..Options::default() };
    let read = calibration::read("c.json", file.to_string().as_bytes(), &options).unwrap();
    assert_eq!((read.value[0].size, read.warnings.len()), ([1280, 720], 0));
}

#[test]
fn one_camera_in_a_file_of_opencv_has_the_files_name() {
    let text = "%YAML:1.0\n---\nimage_Width: 1280\nimage_Height: 720\nCamera_Matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   \
                dt: d\n   data: [ 9.0e+02, 0., 6.4e+02, 0., 9.0e+02,\n       3.6e+02, 0., 0., 1. ]\nDistortion_Coefficients: \
                !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -1.0e-01, 2.0e-02, 0., 0., 0. ]\n\
                rvec: [ 3.14159265, 0, 0 ]\ntvec: [ 0, 1, 3 ]\n";
    let (cameras, warnings) = read("session/left.yml", text);
    assert_eq!((cameras[0].name.as_str(), cameras[0].size, warnings), ("left", [1280, 720], vec![]));
    assert!((cameras[0].position() - Vector3::new(0.0, 1.0, 3.0)).norm() < 1e-6);
}

fn qualisys(folder: &Path) -> String {
    String::from_utf8(testdata::read(folder, "calibration/Calib.qca.txt")).unwrap()
}

#[test]
fn a_qualisys_calibration_is_in_64ths_of_pixels_and_millimetres_with_z_up() {
    let test = "a_qualisys_calibration_is_in_64ths_of_pixels_and_millimetres_with_z_up";
    let Some(folder) = testdata::shared(POSE2SIM, test) else { return };
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
    let trc = testdata::read(folder, "results/balancing_body25b.trc");
    let markers = trc::read(&trc, &PointsOptions::default()).unwrap().value;
    let of_camera = |camera: &Camera| {
        let mut distances = Vec::new();
        for frame in (0..markers.num_frames()).step_by(5) {
            let name = format!("pose/{0}_json/{0}.{frame:04}.json", camera.name);
            let detections: Value = serde_json::from_slice(&testdata::read(folder, &name)).unwrap();
            let of_person = |person: &Value| -> Vec<f64> {
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
                detections["people"].as_array().unwrap().iter().map(of_person).filter(|d| d.len() > 10);
            let best = people.min_by(|a, b| median(a.clone()).total_cmp(&median(b.clone())));
            distances.extend(best.into_iter().flatten());
        }
        median(distances)
    };
    cameras.iter().map(of_camera).collect()
}

#[test]
fn the_markers_of_the_qualisys_capture_are_where_its_cameras_saw_them() {
    let test = "the_markers_of_the_qualisys_capture_are_where_its_cameras_saw_them";
    let Some(folder) = testdata::shared(POSE2SIM, test) else { return };
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
    let Some(folder) = testdata::shared(POSE2SIM, test) else { return };
    let text = qualisys(&folder);
    let broken = text.replacen("r22=\"0.05946489349975602\"", "r22=\"nan\"", 1);
    assert_eq!(error("q.txt", &broken), "line 10: found transform r22=\"nan\", expected a number");
    let broken = text.replacen("</camera>", "", 1);
    assert!(error("q.txt", &broken).contains("found no XML"));
    let turned = text.replacen("viewrotation=\"0\"", "viewrotation=\"90\"", 1);
    assert!(read("q.txt", &turned).1[0].starts_with("line 5: camera cam01: shown turned by 90 degrees"));
    assert_eq!(
        error("q.txt", "<a/>"),
        "line 1: found \"a\", expected calibration, the root of a Qualisys calibration"
    );
}
