//! The files that people get of a body that was found.

use std::sync::Arc;

use body::{BodyModel, Shape};
use formats::media_type::{BINARY, PNG};
use model::{Image, Mesh, Motion};
use queue::JobError;
use results::{Body, Kind, ResultFile};
use shape_fit::Fit;

use crate::InputError;

/// A person in the frames that their shape was found from.
pub(crate) struct Finished {
    model: Arc<BodyModel>,
    shape: Shape,
    /// shape `[frames][dof]`
    poses: Vec<Vec<f64>>,
    motion: Motion,
}

impl Finished {
    /// The poses of all fits.
    ///
    /// # Errors
    /// If a pose can't be written, which a fit's always can.
    pub fn new(
        model: Arc<BodyModel>,
        shape: Shape,
        fits: &[Fit],
        frame_rate: f64,
    ) -> Result<Self, InputError> {
        let poses: Vec<Vec<f64>> = fits.iter().map(|fit| fit.pose.clone()).collect();
        let motion = model.motion(&shape, &poses, frame_rate)?;
        Ok(Self { model, shape, poses, motion })
    }
}

impl results::Finished for Finished {
    const KIND: Kind = Kind::SHAPE;
    const BODY: Option<fn(&Self) -> Body<'_>> = Some(|finished| Body {
        model: &finished.model,
        shape: &finished.shape,
        poses: finished.poses.as_slice().into(),
    });

    fn motion(&self) -> &Motion {
        &self.motion
    }
}

/// A picture as a result.
pub(crate) fn picture(name: String, image: Image) -> ResultFile {
    ResultFile::new(name, PNG, move || Ok::<_, JobError>(formats::image_files::write_image(&image)))
}

/// A mesh as a result.
pub(crate) fn mesh(name: &str, mesh: Mesh) -> ResultFile {
    ResultFile::new(name, BINARY, move || Ok::<_, JobError>(formats::ply::write(&mesh)))
}
