//! Pose and shape from silhouettes, and what is drawn of them.

use body::BodyModel;
use model::{Camera, Image, Mesh, Silhouette};
use multi_view::Parameters;
use shape_fit::{Fit, Options};
use vision::{Rasteriser, Topology, View};

use crate::InputError;

/// What the cameras saw at one moment.
pub(crate) struct Moment {
    /// counted from the first of the session
    pub frame: usize,
    /// every camera with its silhouette
    pub views: Vec<(Camera, Silhouette)>,
}

/// Finds the shape of the person and a pose for every moment.
///
/// # Errors
/// What the person who recorded can do something about.
pub(crate) fn fit(
    model: &BodyModel,
    moments: &[Moment],
    parameters: &Parameters,
) -> Result<Vec<Fit>, InputError> {
    let options = Options {
        least_iou: parameters.least_overlap,
        leave_out_bad_view: parameters.leave_out_bad_view,
        ..Options::default()
    };
    let frames: Vec<&[(Camera, Silhouette)]> = moments.iter().map(|moment| moment.views.as_slice()).collect();
    Ok(shape_fit::fit_frames(model, &frames, &options)?)
}

/// Draws the outline of a mesh, as a camera sees it, over what the camera saw.
pub(crate) fn draw_over(picture: &mut Image, camera: &Camera, mesh: &Mesh, colour: [u8; 3]) {
    let (width, height) = (picture.width(), picture.height());
    let topology = Topology::new(&mesh.faces, mesh.vertices.len());
    let mut silhouette = Silhouette::empty(width, height);
    Rasteriser::new().silhouette(&View::new(camera), &mesh.vertices, &topology, &mut silhouette);
    shape_fit::draw_outline(picture, &silhouette, colour);
}
