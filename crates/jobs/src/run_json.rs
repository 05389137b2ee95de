//! `run.json`: all that decided a result, what was found, and what it took.

use background::CameraQuality;
use formats::FileRole;
use serde::Serialize;
use serde_json::Value;
use uuid::Uuid;

use crate::{
    InputFile, JobReport,
    body_model::BodyModelFile,
    multi_view::{CameraReport, PlanMultiView},
};

/// The program that made a result.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Code {
    /// of the program
    pub version: &'static str,
    /// commit that it was built from, when the build said so
    pub commit: Option<&'static str>,
}

impl Code {
    /// This program.
    pub const THIS: Self = Self { version: env!("CARGO_PKG_VERSION"), commit: option_env!("MAREY_COMMIT") };
}

/// A file of a session.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FileReport<'a> {
    name: &'a str,
    role: FileRole,
    bytes: u64,
    blake3: &'a str,
}

impl<'a> From<&'a InputFile> for FileReport<'a> {
    fn from(file: &'a InputFile) -> Self {
        Self { name: &file.name, role: file.role, bytes: file.bytes, blake3: &file.blake3 }
    }
}

/// What a run was on.
#[derive(Debug, Clone, Serialize)]
pub struct SessionReport<'a> {
    id: Uuid,
    name: &'a str,
    files: Vec<FileReport<'a>>,
}

#[derive(Debug, Clone, Serialize)]
struct OfCamera<'a> {
    name: &'a str,
    source: &'a str,
    plate: Option<&'a str>,
    size: [u32; 2],
    end_frame: usize,
    frame_rate_hz: Option<f64>,
    quality: Option<&'a CameraQuality>,
    warnings: &'a [String],
}

#[derive(Debug, Clone, Serialize)]
struct Timings<'a> {
    plan: &'a JobReport,
    cameras: Vec<&'a JobReport>,
    initialise: &'a JobReport,
    #[serde(skip_serializing_if = "<[JobReport]>::is_empty")]
    chunks: &'a [JobReport],
    #[serde(skip_serializing_if = "Option::is_none")]
    merge: Option<&'a JobReport>,
}

/// What a run that follows the person adds to its report.
#[derive(Debug, Clone, Serialize)]
pub struct TrackingParts<'a> {
    /// what was found
    pub found: Value,
    /// who tracked the chunks
    pub chunks: &'a [JobReport],
    /// who put them together
    pub merge: &'a JobReport,
}

/// The report of a run on cameras.
#[derive(Debug, Clone, Serialize)]
pub struct MultiViewReport<'a> {
    run_id: Uuid,
    kind: &'static str,
    code: Code,
    session: SessionReport<'a>,
    body_model: &'a BodyModelFile,
    parameters: &'a multi_view::Parameters,
    /// What random numbers came from: only the search by particles draws any.
    seeds: Vec<u64>,
    cameras: Vec<OfCamera<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tracking: Option<Value>,
    warnings: &'a [String],
    timings: Timings<'a>,
}

impl<'a> MultiViewReport<'a> {
    /// Of a run that has found a body, and with `tracking` has followed it.
    pub fn new(
        run_id: Uuid,
        request: &'a PlanMultiView,
        (plan, initialise): (&'a JobReport, &'a JobReport),
        cameras: &'a [CameraReport],
        warnings: &'a [String],
        tracking: Option<TrackingParts<'a>>,
    ) -> Self {
        let camera = |c: &'a CameraReport| OfCamera {
            name: &c.camera.name,
            source: &c.source.name,
            plate: c.plate.as_deref(),
            size: c.camera.size,
            end_frame: c.end_frame,
            frame_rate_hz: c.frame_rate,
            quality: c.quality.as_ref(),
            warnings: &c.warnings,
        };
        let (chunks, merge) =
            tracking.as_ref().map_or((&[][..], None), |parts| (parts.chunks, Some(parts.merge)));
        Self {
            run_id,
            kind: "multi-view",
            code: Code::THIS,
            session: SessionReport {
                id: request.session_id,
                name: &request.session_name,
                files: request.files.iter().map(FileReport::from).collect(),
            },
            body_model: &request.body_model,
            parameters: &request.parameters,
            seeds: if tracking.is_some() { vec![request.parameters.seed] } else { Vec::new() },
            cameras: cameras.iter().map(camera).collect(),
            tracking: tracking.map(|parts| parts.found),
            warnings,
            timings: Timings {
                plan,
                cameras: cameras.iter().map(|c| &c.job).collect(),
                initialise,
                chunks,
                merge,
            },
        }
    }
}
