use model::{Camera, PointMatch, Silhouette};
use rayon::prelude::*;
use shape_fit::Observation;
use vision::{Observed, View, reduced};

use crate::{Error, Result};

/// Height of the person in the views that particles are drawn in, pixels.
const HEIGHT_PX: f64 = 160.0;

/// What all cameras saw at one moment, cleaned and made ready for every step.
#[derive(Debug, Clone)]
pub struct ObservedFrame {
    /// number of the frame in the session
    pub index: usize,
    /// of the cameras that see somebody
    pub(crate) views: Vec<ObservedView>,
    num_cameras: usize,
}

/// One camera that sees somebody.
#[derive(Debug, Clone)]
pub(crate) struct ObservedView {
    /// index of the camera among those of the frame
    pub camera: usize,
    /// contours, coarse and fine
    pub observation: Observation,
    /// the view that particles are drawn in
    pub reduced: View,
    /// what was seen, in that view
    pub observed: Observed,
    /// points that the camera saw in frames before, and sees now
    pub matches: Vec<PointMatch>,
}

impl ObservedFrame {
    /// Prepares the silhouettes of a frame, on all cores; cameras that see nobody are left out.
    ///
    /// # Errors
    /// [`Error::View`] for the first camera whose silhouette has another size or whose calibration is invalid.
    pub fn new(index: usize, views: &[(Camera, Silhouette)]) -> Result<Self> {
        let prepare = |(camera, (calibration, silhouette)): (usize, &(Camera, Silhouette))| {
            let Some(observation) = Observation::new(calibration, silhouette)? else { return Ok(None) };
            let height = observation.silhouette.bounds().map_or(1, |[_, top, _, bottom]| bottom - top);
            let scale = ((height as f64 / HEIGHT_PX).round() as usize).max(1);
            let reduced_view = View::reduced(calibration, scale);
            let observed = Observed::new(reduced(&observation.silhouette, scale));
            Ok(Some(ObservedView {
                camera,
                observation,
                reduced: reduced_view,
                observed,
                matches: Vec::new(),
            }))
        };
        let prepared: Vec<_> = views.par_iter().enumerate().map(prepare).collect();
        let mut found = Vec::with_capacity(views.len());
        for view in prepared {
            found.extend(view.map_err(|source| Error::View { frame: index, source })?);
        }
        Ok(Self { index, views: found, num_cameras: views.len() })
    }

    /// With points that a camera (index among those of the frame) found again, pixels of its image at this frame and frames
    /// before; they take the place of those it had. A camera that sees nobody has none.
    #[must_use]
    pub fn with_matches(mut self, camera: usize, matches: &[PointMatch]) -> Self {
        if let Some(view) = self.views.iter_mut().find(|view| view.camera == camera) {
            view.matches = matches.to_vec();
        }
        self
    }

    /// Number of cameras that see somebody.
    pub fn num_views(&self) -> usize {
        self.views.len()
    }

    /// Number of all cameras.
    pub fn num_cameras(&self) -> usize {
        self.num_cameras
    }
}
