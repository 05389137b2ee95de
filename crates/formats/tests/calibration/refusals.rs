use formats::calibration::{self, Options, UpAxis};
use serde_json::{Value, json};

use crate::ring::{difference, error, read, ring, ring_json, toml};

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
    assert!(error("c.json", "{\"cameras\": [").starts_with("line 1: found text that is not JSON"));
    assert!(error("c.toml", "[cam\nx = 1").starts_with("line 1: found text that is not TOML"));
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
