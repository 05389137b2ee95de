//! The one form in which cameras are kept: the plain JSON that `read` reads.

use model::{Camera, Distortion};
use serde_json::{Value, json};

const CONVENTION: &str = "x_camera = R x_world + t, metres, y up; u = fx X/Z + cx, v = fy Y/Z + cy after distortion (k1, k2, p1, \
                          p2, k3); camera axes x right, y down, z forward; (0, 0) is the centre of the top-left pixel";

/// Cameras as plain JSON: for each its name, the size of its pictures, `K`, `dist`, `R` and `t`. All digits are kept, so that
/// reading gives the cameras again to rounding.
pub fn write(cameras: &[Camera]) -> String {
    let camera = |camera: &Camera| -> Value {
        let rotation = camera.camera_from_world.rotation.to_rotation_matrix();
        let row = |row: usize| -> Vec<f64> { rotation.matrix().row(row).iter().copied().collect() };
        let Distortion { k1, k2, k3, p1, p2 } = camera.distortion;
        let (focal, principal) = (camera.focal, camera.principal);
        let t = camera.camera_from_world.translation.vector;
        json!({
            "name": camera.name,
            "image_width": camera.size[0],
            "image_height": camera.size[1],
            "K": [[focal.x, 0.0, principal.x], [0.0, focal.y, principal.y], [0.0, 0.0, 1.0]],
            "dist": [k1, k2, p1, p2, k3],
            "R": [row(0), row(1), row(2)],
            "t": [t.x, t.y, t.z],
        })
    };
    let cameras: Vec<_> = cameras.iter().map(camera).collect();
    let file = json!({ "convention": CONVENTION, "unit": "m", "up": "y", "cameras": cameras });
    format!("{file:#}\n")
}
