//! Frame 0 of the shared synthetic capture: cameras, silhouettes and the mesh that made them.

use formats::{calibration, image_files, ply};
use model::{Camera, Mesh, Silhouette};

#[allow(dead_code, reason = "not every test needs all of it")]
pub struct Capture {
    pub cameras: Vec<Camera>,
    pub silhouettes: Vec<Silhouette>,
    pub mesh: Mesh,
}

/// `None` where the data is not there.
pub fn frame_0(test: &str) -> Option<Capture> {
    let folder = testkit::shared::find("data/multiview/synthetic-8cam", test)?;
    let bytes = |name: &str| testkit::shared::read(&folder, name);
    let calibration =
        calibration::read("calibration.json", &bytes("calibration.json"), &calibration::Options::default());
    let cameras = calibration.expect("calibration.json").value;
    let silhouette = |camera: &Camera| {
        let file = bytes(&format!("silhouettes/{}/0000.png", camera.name));
        image_files::read_silhouette(&file, &image_files::Limits::default()).expect("a PNG").value
    };
    let silhouettes = cameras.iter().map(silhouette).collect();
    let mesh = ply::read(&bytes("groundtruth/mesh_0000.ply")).expect("mesh_0000.ply").value;
    Some(Capture { cameras, silhouettes, mesh })
}
