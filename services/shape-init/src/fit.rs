//! Pose and shape from silhouettes, and what is drawn of them.

use body::BodyModel;
use model::{Camera, Silhouette};
use multi_view::Parameters;
use shape_fit::{Fit, Options};

use crate::InputError;

/// What the cameras saw at one moment.
pub(crate) struct Moment {
    /// counted from the first of the session
    pub frame: usize,
    /// every camera with its silhouette
    pub views: Vec<(Camera, Silhouette)>,
}

/// Bodies of one shape in some moments.
pub(crate) struct Found {
    /// those in which somebody was found
    pub moments: Vec<Moment>,
    /// a fit for each of them
    pub fits: Vec<Fit>,
    /// why nobody was found in others
    pub left_out: Vec<String>,
}

/// Finds the shape of the person and a pose for every moment. Where several are given, those in which nobody can be found by
/// themselves are left out.
///
/// # Errors
/// What the person who recorded can do something about, if nobody is found in any.
pub(crate) fn fit(
    model: &BodyModel,
    moments: Vec<Moment>,
    parameters: &Parameters,
) -> Result<Found, InputError> {
    let options = Options {
        least_iou: parameters.least_overlap,
        leave_out_bad_view: parameters.leave_out_bad_view,
        ..Options::default()
    };
    let together = |moments: &[Moment]| {
        let frames: Vec<&[(Camera, Silhouette)]> =
            moments.iter().map(|moment| moment.views.as_slice()).collect();
        shape_fit::fit_frames(model, &frames, &options)
    };
    match together(&moments) {
        Ok(fits) => Ok(Found { moments, fits, left_out: Vec::new() }),
        Err(error) if moments.len() < 2 => Err(error.into()),
        Err(error) => {
            let (mut kept, mut left_out) = (Vec::new(), Vec::new());
            for moment in moments {
                match shape_fit::fit(model, &moment.views, &options) {
                    Ok(_) => kept.push(moment),
                    Err(error) => {
                        left_out.push(format!("frame {} is not used for the shape: {error}", moment.frame));
                    }
                }
            }
            if kept.is_empty() {
                return Err(error.into());
            }
            Ok(Found { fits: together(&kept)?, moments: kept, left_out })
        }
    }
}
