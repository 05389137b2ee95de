//! The job that draws the body over what a camera saw, as a video.

use std::{
    path::Path,
    sync::{Arc, atomic::AtomicBool},
};

use body::{BodyModel, Posed};
use camera_jobs::{Silhouettes, tracking_session};
use formats::media_type::{MP4, TEXT};
use jobs::{
    file_part,
    multi_view::{DrawOverlay, SourceKind, TRACKED},
    named,
};
use model::{Camera, Image};
use queue::{Handler, JobContext, JobError, Outcome};
use results::ResultFile;
use service::compute::{self, StopOnDrop};
use tempfile::TempDir;
use tracking::{Chunk, Tracked};
use video::{FrameWriter, WriteOptions};

use crate::{
    InputError, Shared,
    drawing::Drawer,
    frames::{Frames, Stream},
    opened::{Opened, open},
    segment::painted,
};

/// Largest artefact of tracked frames, bytes: a kilobyte a frame.
const MAX_TRACKED_BYTES: u64 = 1 << 30;

pub(crate) struct OverlayHandler {
    pub shared: Arc<Shared>,
}

/// What bodies are drawn on.
enum Ground {
    /// what the camera saw
    Frames(Frames),
    /// silhouettes, where there is nothing else
    Masks(Silhouettes),
}

/// What is drawn.
struct Scene {
    camera: Camera,
    ground: Ground,
    model: Arc<BodyModel>,
    alpha: Vec<f64>,
    tracked: Chunk,
    frame_rate: f64,
}

impl Handler for OverlayHandler {
    type Job = DrawOverlay;

    async fn run(&self, context: JobContext, payload: DrawOverlay) -> Result<Outcome, JobError> {
        let Shared { resources, models } = &*self.shared;
        let session = tracking_session(resources, &payload.session).await?;
        let (Some(camera), Some(clips)) =
            (session.cameras.get(payload.camera), session.clips.get(payload.camera))
        else {
            return Err(JobError::retry(format!("no camera {}", payload.camera)));
        };
        let name = camera.camera.name.clone();
        context.progress(0.0, format!("camera {name}: reading"));
        let artefacts = resources.artefacts_before(&context).await?;
        let tracked = resources.read_artefact(named(&artefacts, TRACKED)?, MAX_TRACKED_BYTES).await?;
        let tracked = compute::run(move || Chunk::from_bytes(&tracked)).await.map_err(JobError::retry)?;
        let scratch = TempDir::new().map_err(JobError::retry)?;
        let frames = session.first_frame..session.end_frame;
        let largest_side = session.request.parameters.largest_side;
        let ground = match camera.source.kind {
            SourceKind::Masks => {
                Ground::Masks(Silhouettes::read(resources, std::slice::from_ref(clips), frames).await?)
            }
            _ => match open(resources, &camera.source, largest_side, scratch.path()).await? {
                Opened::Frames(frames) => Ground::Frames(frames),
                Opened::Masks(_) => return Err(JobError::retry(format!("{name} has masks"))),
            },
        };
        context.check()?;
        let scene = Scene {
            camera: camera.camera.camera().map_err(JobError::retry)?,
            ground,
            model: models.get(&session.request.body_model).await?,
            alpha: session.alpha,
            tracked,
            frame_rate: session.frame_rate,
        };
        let stem = format!("overlay_{}", file_part(&name, payload.camera));
        let path = scratch.path().join(format!("{stem}.mp4"));
        let stop = StopOnDrop::default();
        let (watched, to, flag) = (context.clone(), path.clone(), stop.flag());
        let drawn = compute::run(move || draw(&scene, &to, &watched, &flag)).await;
        context.check()?;
        let file = match drawn {
            Ok(()) => ResultFile::on_disk(format!("{stem}.mp4"), MP4, path),
            // The motion is there all the same.
            Err(DrawError::NoEncoder(error)) => {
                let text = format!("no overlay video of camera {name}: {error}\n");
                ResultFile::ready(format!("{stem}.txt"), TEXT, text.into_bytes())
            }
            Err(DrawError::Input(error)) => return Err(error.into()),
            Err(DrawError::Video(error)) => return Err(JobError::retry(error)),
            Err(DrawError::Stopped) => return Err(JobError::Stopped),
        };
        Ok(Outcome::default().artefact(results::write_one(&resources.store, &context, file).await?))
    }
}

/// Why there is no video.
enum DrawError {
    /// the program that encodes is not there
    NoEncoder(video::Error),
    Video(video::Error),
    Input(InputError),
    Stopped,
}

impl From<video::Error> for DrawError {
    fn from(error: video::Error) -> Self {
        match error {
            error @ video::Error::ProgramMissing { .. } => Self::NoEncoder(error),
            error => Self::Video(error),
        }
    }
}

impl From<InputError> for DrawError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

/// Draws frame after frame; one is in memory at a time.
fn draw(scene: &Scene, path: &Path, context: &JobContext, stop: &Arc<AtomicBool>) -> Result<(), DrawError> {
    let Scene { camera, model, tracked, .. } = scene;
    let shape = model.shape(&scene.alpha);
    let mut drawer = Drawer::new(model, camera);
    let mut posed = Posed::default();
    let options = WriteOptions { rate: scene.frame_rate, ..WriteOptions::default() };
    let mut writer = FrameWriter::create(path, camera.size, &options)?;
    let mut pictures = Pictures::open(&scene.ground, &tracked.frames, stop)?;
    let mut picture = Image::black(0, 0);
    let count = tracked.frames.len();
    for (done, frame) in tracked.frames.iter().enumerate() {
        if context.is_cancelled() || stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(DrawError::Stopped);
        }
        if !pictures.next(frame.frame, &mut picture)? {
            break;
        }
        shape.pose(model, &frame.pose, &mut posed);
        drawer.tracked(&mut picture, &posed.vertices, frame);
        writer.write(&picture)?;
        let phrase = format!("drawing camera {}: frame {} of {count}", camera.name, done + 1);
        context.progress(0.99 * done as f64 / count as f64, phrase);
    }
    Ok(writer.finish()?)
}

/// The pictures of a ground, one after the other.
enum Pictures<'a> {
    Frames(Stream<'a>),
    Masks(&'a Silhouettes),
}

impl<'a> Pictures<'a> {
    /// Begins with the first of the frames.
    fn open(ground: &'a Ground, frames: &[Tracked], stop: &Arc<AtomicBool>) -> Result<Self, InputError> {
        Ok(match ground {
            Ground::Masks(silhouettes) => Self::Masks(silhouettes),
            Ground::Frames(frames_of_camera) => {
                let mut stream = frames_of_camera.open(1, stop)?;
                stream.skip(frames.first().map_or(0, |first| first.frame))?;
                Self::Frames(stream)
            }
        })
    }

    /// False at the end.
    fn next(&mut self, frame: usize, picture: &mut Image) -> Result<bool, InputError> {
        match self {
            Self::Frames(stream) => stream.next(picture),
            Self::Masks(silhouettes) => {
                if let Some((_, mask)) = silhouettes.views(frame)?.first() {
                    *picture = painted(mask);
                }
                Ok(true)
            }
        }
    }
}
