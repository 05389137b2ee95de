//! The body of the shared synthetic capture in its first frame.

use model::Mesh;

/// `None` where the data is not there.
pub fn mesh(test: &str) -> Option<Mesh> {
    let folder = testkit::shared::find("data/multiview/synthetic-8cam", test)?;
    let file = testkit::shared::read(&folder, "groundtruth/mesh_0000.ply");
    Some(formats::ply::read(&file).expect("mesh_0000.ply").value)
}
