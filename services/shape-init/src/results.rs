//! The files that people get of a body that was found.

use body::{BodyModel, Poses, Shape};
use model::Image;
use shape_fit::Fit;

use crate::InputError;

/// A result: its name, its media type and its content.
pub(crate) struct ResultFile {
    pub name: String,
    pub media_type: &'static str,
    pub content: Vec<u8>,
}

/// The body with its skeleton, skin and motion.
pub(crate) const BODY: &str = "body.glb";
/// The skeleton in its poses.
pub(crate) const POSE: &str = "pose.bvh";
const BINARY: &str = "application/octet-stream";

/// Mesh, skinned body and skeleton.
///
/// # Errors
/// If a pose can't be written, which a fit's always can.
pub(crate) fn body_files(
    model: &BodyModel,
    shape: &Shape,
    fits: &[Fit],
    frame_rate: f64,
) -> Result<Vec<ResultFile>, InputError> {
    let poses: Vec<Vec<f64>> = fits.iter().map(|fit| fit.pose.clone()).collect();
    let motion = model.motion(shape, &poses, frame_rate)?;
    let glb = body::glb(model, shape, Some(Poses { poses: &poses, frame_rate }))?;
    let file = |name: &str, media_type, content| ResultFile { name: name.to_owned(), media_type, content };
    let mut files = vec![
        file(BODY, "model/gltf-binary", glb),
        file(POSE, "text/plain; charset=utf-8", formats::bvh::write(&motion).into_bytes()),
    ];
    if let Some(first) = fits.first() {
        files.push(file("mesh.ply", BINARY, formats::ply::write(&first.mesh)));
    }
    Ok(files)
}

/// A picture as a result.
pub(crate) fn picture(name: String, image: &Image) -> ResultFile {
    ResultFile { name, media_type: "image/png", content: formats::image_files::write_image(image) }
}

/// A mesh as a result.
pub(crate) fn mesh(name: &str, mesh: &model::Mesh) -> ResultFile {
    ResultFile { name: name.to_owned(), media_type: BINARY, content: formats::ply::write(mesh) }
}
