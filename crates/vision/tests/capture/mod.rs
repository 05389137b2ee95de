//! Frame 0 of the shared synthetic capture: cameras, silhouettes and the mesh that made them.

use std::{fs, path::Path};

use model::{Camera, Distortion, Mesh, Silhouette};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};
use serde_json::Value;

#[allow(dead_code, reason = "not every test needs all of it")]
pub struct Capture {
    pub cameras: Vec<Camera>,
    pub silhouettes: Vec<Silhouette>,
    pub mesh: Mesh,
}

/// `None` where the data is not there.
pub fn frame_0(test: &str) -> Option<Capture> {
    let folder = testdata::shared("data/multiview/synthetic-8cam", test)?;
    let calibration = fs::read(folder.join("calibration.json")).expect("calibration.json");
    let calibration: Value = serde_json::from_slice(&calibration).expect("JSON");
    let cameras: Vec<_> = calibration["cameras"].as_array().expect("cameras").iter().map(camera).collect();
    let silhouette =
        |camera: &Camera| silhouette(&folder.join(format!("silhouettes/{}/0000.png", camera.name)));
    let silhouettes = cameras.iter().map(silhouette).collect();
    let mesh = mesh(&fs::read(folder.join("groundtruth/mesh_0000.ply")).expect("mesh_0000.ply"));
    Some(Capture { cameras, silhouettes, mesh })
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn camera(entry: &Value) -> Camera {
    let (k, r, t) = (&entry["K"], &entry["R"], &entry["t"]);
    let rotation = Matrix3::from_fn(|row, column| number(&r[row][column]));
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    let translation = Translation3::from(Vector3::from_fn(|axis, _| number(&t[axis])));
    Camera {
        name: entry["name"].as_str().expect("a name").into(),
        size: [1004, 1004],
        focal: Vector2::new(number(&k[0][0]), number(&k[1][1])),
        principal: Vector2::new(number(&k[0][2]), number(&k[1][2])),
        distortion: Distortion::default(),
        camera_from_world: Isometry3::from_parts(translation, rotation),
    }
}

fn silhouette(path: &Path) -> Silhouette {
    let image = image::open(path).expect("a PNG").into_luma8();
    let (width, height) = (image.width() as usize, image.height() as usize);
    Silhouette::from_pixels(width, height, image.as_raw(), |value| value > 127).expect("all pixels")
}

/// Binary PLY with x, y, z in single precision and triangles, as this capture has it.
fn mesh(bytes: &[u8]) -> Mesh {
    let end = b"end_header\n";
    let header = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    let text = String::from_utf8_lossy(&bytes[..header]);
    let count = |element: &str| -> usize {
        let line = text.lines().find_map(|line| line.strip_prefix(element));
        line.and_then(|line| line.trim().parse().ok()).expect("a count")
    };
    let (num_vertices, num_faces) = (count("element vertex"), count("element face"));
    let word = |at: usize| -> [u8; 4] { bytes[at..at + 4].try_into().expect("four bytes") };
    let vertex = |i: usize| {
        Vector3::from_fn(|axis, _| f64::from(f32::from_le_bytes(word(header + 12 * i + 4 * axis))))
    };
    let faces = header + 12 * num_vertices;
    let face = |i: usize| [0, 1, 2].map(|corner| u32::from_le_bytes(word(faces + 13 * i + 1 + 4 * corner)));
    Mesh::new((0..num_vertices).map(vertex).collect(), (0..num_faces).map(face).collect()).expect("a mesh")
}
