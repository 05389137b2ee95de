//! Looking for the person whose shape is wanted.

use std::sync::Arc;

use body::BodyModel;
use camera_jobs::Silhouettes;
use jobs::multi_view::{CameraClips, CameraReport};
use multi_view::Parameters;
use queue::{JobContext, JobError};
use service::{Resources, compute};

use crate::{
    InputError,
    fit::{self, Found, Moment},
};

/// Frames, spread over the session, in which a person is looked for who was not in the first.
const LATER_TRIES: usize = 7;

/// Where a person is looked for.
pub(crate) struct Search<'a> {
    pub resources: &'a Resources,
    pub context: &'a JobContext,
    pub model: &'a Arc<BodyModel>,
    pub parameters: &'a Parameters,
    pub cameras: &'a [CameraReport],
    /// their silhouettes, in the same order
    pub clips: &'a [CameraClips],
    /// one past the last frame that all cameras have
    pub end_frame: usize,
}

impl Search<'_> {
    /// Pose and shape in the frames that were asked for. Where the person is to be followed and is not in these yet, they are
    /// looked for in others.
    ///
    /// # Errors
    /// If nobody is found, with what is known of the cameras.
    pub async fn find(&self) -> Result<Found, JobError> {
        self.find_anywhere().await.map_err(|error| explained(error, self.cameras))
    }

    async fn find_anywhere(&self) -> Result<Found, FindError> {
        let Self { context, parameters, end_frame, .. } = *self;
        let wanted = parameters.shape_fit_frames(end_frame);
        let first = match self.find_in(&wanted).await {
            Err(FindError::Nobody(error)) if parameters.track => error,
            found => return found,
        };
        let spread = Parameters { shape_frames: LATER_TRIES + 1, shape_step: None, ..parameters.clone() };
        for frame in spread.shape_fit_frames(end_frame).into_iter().filter(|frame| !wanted.contains(frame)) {
            context.check()?;
            match self.find_in(&[frame]).await {
                Err(FindError::Nobody(_)) => {}
                Err(error) => return Err(error),
                Ok(mut found) => {
                    found.left_out.push(format!("the shape is that of frame {frame}, as before: {first}"));
                    return Ok(found);
                }
            }
        }
        Err(FindError::Nobody(first))
    }

    async fn find_in(&self, frames: &[usize]) -> Result<Found, FindError> {
        let mut moments = Vec::new();
        for &frame in frames {
            let silhouettes = Silhouettes::read(self.resources, self.clips, frame..frame + 1).await?;
            moments.push(Moment { frame, views: silhouettes.views(frame).map_err(JobError::retry)? });
        }
        let (model, parameters) = (self.model.clone(), self.parameters.clone());
        let found = compute::run(move || fit::fit(&model, moments, &parameters)).await;
        found.map_err(FindError::Nobody)
    }
}

/// Why no body was found.
enum FindError {
    /// nobody is there, or they can't be recognised
    Nobody(InputError),
    /// something else
    Job(JobError),
}

impl From<JobError> for FindError {
    fn from(error: JobError) -> Self {
        Self::Job(error)
    }
}

/// Why no body was found, with what is known of the cameras: poor silhouettes are the usual reason.
fn explained(error: FindError, cameras: &[CameraReport]) -> JobError {
    let error = match error {
        FindError::Nobody(error) => error,
        FindError::Job(error) => return error,
    };
    let mut message = error.to_string();
    let advice = cameras.iter().filter_map(|camera| {
        let quality = camera.quality.as_ref().filter(|quality| !quality.advice.is_empty())?;
        let said: Vec<String> = quality.advice.iter().take(2).map(ToString::to_string).collect();
        Some(format!(
            "camera {} (silhouettes {:.2} of 1): {}",
            camera.camera.name,
            quality.score,
            said.join("; ")
        ))
    });
    let advice: Vec<String> = advice.collect();
    if !advice.is_empty() {
        message.push_str(". Of the cameras: ");
        message.push_str(&advice.join(". "));
    }
    message.push_str(
        ". The pictures silhouette_CAMERA.png among the results show what was taken for the person",
    );
    JobError::give_up(message, format!("{error:?}"))
}
