//! Cameras made for the tests.

use formats::calibration::{self, Options};
use model::Camera;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use serde_json::Value;

pub fn read(name: &str, text: &str) -> (Vec<Camera>, Vec<String>) {
    let read = calibration::read(name, text.as_bytes(), &Options::default()).unwrap();
    (read.value, read.warnings.iter().map(ToString::to_string).collect())
}

pub fn error(name: &str, text: &str) -> String {
    calibration::read(name, text.as_bytes(), &Options::default()).unwrap_err().to_string()
}

/// Largest difference of the projections of a few points, pixels.
pub fn difference(a: &Camera, b: &Camera) -> f64 {
    let points = [Vector3::new(0.1, 0.9, 0.2), Vector3::new(-0.4, 1.7, 0.1), Vector3::new(0.3, 0.0, -0.2)];
    let off = |point: &Vector3<f64>| (a.project(point).unwrap() - b.project(point).unwrap()).norm();
    points.iter().map(off).fold(0.0, f64::max)
}

/// Four cameras 1.5 m above the floor in a ring of 3 m, y up, that look at (0, 1, 0).
pub fn ring() -> Vec<Camera> {
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
pub fn ring_json() -> Value {
    let mut file: Value = serde_json::from_str(&calibration::write(&ring())).unwrap();
    for key in ["up", "unit", "convention"] {
        file.as_object_mut().unwrap().remove(key);
    }
    file
}

/// The same cameras in a world where z is up, in the unit of `per_metre`, as TOML.
pub fn toml(per_metre: f64) -> String {
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
