use formats::calibration::{self, Options, UpAxis};
use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::ring::{difference, read, ring, ring_json, toml};

const SYNTHETIC: &str = "data/multiview/synthetic-8cam";

#[test]
fn json_and_yaml_of_the_synthetic_capture_are_the_same_cameras() {
    let test = "json_and_yaml_of_the_synthetic_capture_are_the_same_cameras";
    let Some(folder) = testkit::shared::find(SYNTHETIC, test) else { return };
    let parsed = |name: &str| read(name, &String::from_utf8(testkit::shared::read(&folder, name)).unwrap());
    let (json, json_warnings) = parsed("calibration.json");
    let (yaml, yaml_warnings) = parsed("calibration.yml");
    assert_eq!((json_warnings, yaml_warnings), (vec![], vec![]));
    assert_eq!((json.len(), yaml.len()), (8, 8));
    let file: Value = serde_json::from_slice(&testkit::shared::read(&folder, "calibration.json")).unwrap();
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
    let Some(folder) = testkit::shared::find(SYNTHETIC, test) else { return };
    let (cameras, _) = read(
        "calibration.json",
        &String::from_utf8(testkit::shared::read(&folder, "calibration.json")).unwrap(),
    );
    let joints: Value =
        serde_json::from_slice(&testkit::shared::read(&folder, "groundtruth/joints.json")).unwrap();
    let list = joints["frames"][0]["joints"].as_array().unwrap();
    let (mut inside, mut all) = (0, 0);
    for camera in &cameras {
        let mask = testkit::shared::read(&folder, &format!("silhouettes/{}/0000.png", camera.name));
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

#[test]
fn json_of_opencvs_file_storage_is_read() {
    let matrix = |rows: usize, data: &[f64]| json!({ "type_id": "opencv-matrix", "rows": rows, "cols": data.len() / rows, "dt": "d", "data": data });
    let mut file = serde_json::Map::new();
    file.insert("image_size".into(), json!([1280, 720]));
    for camera in ring() {
        let rotation = camera.camera_from_world.rotation.to_rotation_matrix();
        let (k, d) = (&camera, camera.distortion);
        let name = |part: &str| format!("{}_{part}", camera.name);
        let matrix_of = [k.focal.x, 0.0, k.principal.x, 0.0, k.focal.y, k.principal.y, 0.0, 0.0, 1.0];
        file.insert(name("camera_matrix"), matrix(3, &matrix_of));
        file.insert(name("distortion_coefficients"), matrix(1, &[d.k1, d.k2, d.p1, d.p2, d.k3]));
        file.insert(name("R"), matrix(3, rotation.matrix().transpose().as_slice()));
        file.insert(name("T"), matrix(3, camera.camera_from_world.translation.vector.as_slice()));
    }
    let (cameras, warnings) = read("stereo.json", &Value::Object(file).to_string());
    assert_eq!((cameras.len(), warnings), (4, vec![]));
    for (a, b) in ring().iter().zip(&cameras) {
        assert_eq!((&a.name, a.size), (&b.name, b.size));
        assert!(difference(a, b) < 1e-9);
    }
}
