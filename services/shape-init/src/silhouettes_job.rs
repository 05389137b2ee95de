//! The job that makes the silhouettes of one camera.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use formats::{
    calibration::fit_to_image,
    image_files,
    media_type::{BINARY, PNG},
};
use jobs::{
    file_part,
    multi_view::{
        CameraReport, ClipPlace, MakeSilhouettes, Source, clip_name, matches_name, picture_name, report_name,
    },
};
use model::Image;
use multi_view::CameraRecord;
use queue::{Artefact, Handler, JobContext, JobError, Outcome};
use results::ResultFile;
use service::{FileError, compute, objects};
use tempfile::TempDir;
use tokio::sync::mpsc;

use crate::{
    InputError, Shared,
    opened::{Opened, entries, open},
    segment::{self, Made, Piece, Sink},
};

/// Pieces that wait to be written, at most.
const WAITING: usize = 2;
/// Colour of the outline of silhouettes.
const OUTLINE: [u8; 3] = [255, 230, 0];

pub(crate) struct SilhouettesHandler {
    pub shared: Arc<Shared>,
}

impl Handler for SilhouettesHandler {
    type Job = MakeSilhouettes;

    async fn run(&self, context: JobContext, payload: MakeSilhouettes) -> Result<Outcome, JobError> {
        let resources = &self.shared.resources;
        let store = &resources.store;
        let index = payload.index;
        context.progress(0.0, format!("camera {}: reading {}", payload.camera.name, payload.source.name));
        let scratch = TempDir::new().map_err(JobError::retry)?;
        let opened =
            open(resources, &payload.source, payload.parameters.largest_side, scratch.path()).await?;
        let plate = self.plate(payload.plate.as_ref()).await?;
        context.check()?;
        let (made, written) = self.make(&context, &payload, opened, plate).await?;
        let (camera, made) = made;
        let report = CameraReport {
            index,
            camera,
            source: payload.source.clone(),
            plate: payload.plate.as_ref().map(|plate| plate.name.clone()),
            end_frame: made.made.end_frame,
            frame_rate: made.frame_rate,
            quality: made.made.quality,
            warnings: made.made.warnings,
            clips: written.clips,
            matches: written.matches,
            job: resources.job_report(&context, made.made.end_frame - payload.parameters.first_frame),
        };
        let report = objects::write_json(store, &context, &report_name(index), &report).await?;
        Ok(written.artefacts.into_iter().fold(Outcome::default(), Outcome::artefact).artefact(report))
    }
}

/// What came of a camera.
struct Segmented {
    made: Made,
    frame_rate: Option<f64>,
}

#[derive(Default)]
struct Written {
    artefacts: Vec<Artefact>,
    clips: Vec<ClipPlace>,
    matches: Vec<ClipPlace>,
}

impl SilhouettesHandler {
    async fn plate(&self, source: Option<&Source>) -> Result<Option<Image>, JobError> {
        let Some(source) = source else { return Ok(None) };
        let entries = entries(&self.shared.resources, source).await?;
        let name = source.name.clone();
        let read = compute::run(move || {
            let entry =
                entries.first().ok_or_else(|| FileError::unexpected(&name, "nothing", "a picture"))?;
            image_files::read_image(&entry.bytes, &image_files::Limits::default())
                .map_err(FileError::in_file(&name))
        });
        Ok(Some(read.await.map_err(InputError::from)?))
    }

    /// Makes silhouettes on a thread of their own and writes them as they come.
    async fn make(
        &self,
        context: &JobContext,
        payload: &MakeSilhouettes,
        opened: Opened,
        plate: Option<Image>,
    ) -> Result<((CameraRecord, Segmented), Written), JobError> {
        let (sender, mut receiver) = mpsc::channel(WAITING);
        let cancelled = Arc::new(AtomicBool::new(false));
        let mut sink =
            JobSink { context: context.clone(), camera: payload.camera.name.clone(), sender, cancelled };
        let job = payload.clone();
        let made = compute::run(move || make(&job, &opened, plate.as_ref(), &mut sink));
        let written = async {
            let mut written = Written::default();
            while let Some(piece) = receiver.recv().await {
                self.write(context, payload, piece, &mut written).await?;
            }
            Ok::<_, JobError>(written)
        };
        let (made, written) = tokio::join!(made, written);
        context.check()?;
        let written = written?;
        // stopped without a reason of the input's: the job is to end, and check() has said so, or nothing was written
        let made = made?.ok_or(JobError::Stopped)?;
        Ok((made, written))
    }

    async fn write(
        &self,
        context: &JobContext,
        payload: &MakeSilhouettes,
        piece: Piece,
        written: &mut Written,
    ) -> Result<(), JobError> {
        let store = &self.shared.resources.store;
        match piece {
            Piece::Clip { first_frame, num_frames, bytes, matches } => {
                let name = clip_name(payload.index, first_frame);
                let artefact = objects::write(store, context, &name, BINARY, bytes).await?;
                written.artefacts.push(artefact);
                written.clips.push(ClipPlace { name, first_frame, num_frames });
                if let Some(bytes) = matches {
                    let name = matches_name(payload.index, first_frame);
                    let artefact = objects::write(store, context, &name, BINARY, bytes).await?;
                    written.artefacts.push(artefact);
                    written.matches.push(ClipPlace { name, first_frame, num_frames });
                }
            }
            Piece::Picture { frame, mut image, silhouette } => {
                let (plain, drawn) = compute::run(move || {
                    let plain = image_files::write_image(&image);
                    shape_fit::draw_outline(&mut image, &silhouette, OUTLINE);
                    (plain, image_files::write_image(&image))
                })
                .await;
                let name = picture_name(payload.index, frame);
                written.artefacts.push(objects::write(store, context, &name, PNG, plain).await?);
                // A run that fails later shows here what its cameras saw.
                let name = format!("silhouette_{}.png", file_part(&payload.camera.name, payload.index));
                written
                    .artefacts
                    .push(results::write_one(store, context, ResultFile::ready(name, PNG, drawn)).await?);
            }
        }
        Ok(())
    }
}

/// All of the work on the frames; `None` if it was stopped.
fn make(
    payload: &MakeSilhouettes,
    opened: &Opened,
    plate: Option<&Image>,
    sink: &mut JobSink,
) -> Result<Option<(CameraRecord, Segmented)>, InputError> {
    let calibrated = payload
        .camera
        .camera()
        .map_err(|e| FileError::unexpected(&payload.camera.name, e.to_string(), "a camera"))?;
    let (size, frame_rate) = match opened {
        Opened::Masks(entries) => {
            let frames =
                entries.first().map(|entry| image_files::size(&entry.bytes, &image_files::Limits::default()));
            let first = entries.first().map_or("", |entry| entry.name.as_str());
            let size = frames
                .transpose()
                .map_err(FileError::in_file(&format!("{}: {first}", payload.source.name)))?;
            (size.unwrap_or_default(), None)
        }
        Opened::Frames(frames) => {
            let announced = frames.announced()?;
            (announced.size, announced.rate)
        }
    };
    let fitted = fit_to_image(&calibrated, size).map_err(FileError::in_file(&payload.source.name))?;
    let name = &payload.source.name;
    let cancelled = sink.cancelled.clone();
    let made = match opened {
        Opened::Masks(entries) => segment::from_masks(name, entries, &payload.parameters, sink)?,
        Opened::Frames(frames) => {
            segment::from_frames(name, frames, plate, &payload.parameters, &cancelled, sink)?
        }
    };
    let Some(mut made) = made else { return Ok(None) };
    let assumed = fitted.warnings.into_iter().map(|warning| warning.message);
    made.warnings = assumed.chain(made.warnings).collect();
    Ok(Some((CameraRecord::from(&fitted.value), Segmented { made, frame_rate })))
}

/// Sends pieces to where they are written, and progress to the user.
struct JobSink {
    context: JobContext,
    camera: String,
    sender: mpsc::Sender<Piece>,
    cancelled: Arc<AtomicBool>,
}

impl JobSink {
    fn goes_on(&self) -> bool {
        let is_over = self.context.is_cancelled();
        if is_over {
            self.cancelled.store(true, Ordering::Relaxed);
        }
        !is_over
    }
}

impl Sink for JobSink {
    fn piece(&mut self, piece: Piece) -> bool {
        // the receiver is gone when writing failed
        self.sender.blocking_send(piece).is_ok() && self.goes_on()
    }

    fn frame_done(&mut self, done: usize, expected: Option<usize>) -> bool {
        let total = expected.map_or_else(String::new, |count| format!(" of {count}"));
        let share = expected.map_or(0.5, |count| done as f64 / count.max(1) as f64);
        let phrase =
            if done == 0 { "learning the background".to_owned() } else { format!("frame {done}{total}") };
        self.context.progress(share.min(0.99), format!("camera {}: {phrase}", self.camera));
        self.goes_on()
    }
}
