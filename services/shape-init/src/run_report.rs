//! `run.json` and `shape.json`: all that decided the result, what was found, and what it took.

use background::CameraQuality;
use body::{BodyModel, Measurements, Shape};
use payloads::{BodyModelFile, InputFile, JobReport, PlanMultiView};
use serde::Serialize;
use serde_json::{Map, Value, json};
use shape_fit::Fit;
use uuid::Uuid;

use crate::{fit::Moment, payload::CameraReport};

/// Name of the result with everything that decided the others.
pub(crate) const RUN: &str = "run.json";

#[derive(Serialize)]
pub(crate) struct RunReport<'a> {
    run_id: Uuid,
    kind: &'static str,
    code: Code,
    session: SessionReport<'a>,
    body_model: &'a BodyModelFile,
    parameters: &'a multi_view::Parameters,
    /// Nothing in this method is drawn at random.
    seeds: [u64; 0],
    cameras: Vec<OfCamera<'a>>,
    warnings: &'a [String],
    timings: Timings<'a>,
}

#[derive(Serialize)]
struct Code {
    version: &'static str,
    /// Commit that it was built from, when the build said so.
    commit: Option<&'static str>,
}

#[derive(Serialize)]
struct SessionReport<'a> {
    id: Uuid,
    name: &'a str,
    files: Vec<FileReport<'a>>,
}

#[derive(Serialize)]
struct FileReport<'a> {
    name: &'a str,
    role: &'a str,
    bytes: u64,
    blake3: &'a str,
}

#[derive(Serialize)]
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

#[derive(Serialize)]
struct Timings<'a> {
    plan: &'a JobReport,
    cameras: Vec<&'a JobReport>,
    initialise: &'a JobReport,
}

impl<'a> RunReport<'a> {
    /// Of a run that has found a body.
    pub fn new(
        run_id: Uuid,
        request: &'a PlanMultiView,
        plan: &'a JobReport,
        cameras: &'a [CameraReport],
        warnings: &'a [String],
        initialise: &'a JobReport,
    ) -> Self {
        let file =
            |f: &'a InputFile| FileReport { name: &f.name, role: &f.role, bytes: f.bytes, blake3: &f.blake3 };
        let camera = |c: &'a CameraReport| OfCamera {
            name: &c.camera.name,
            source: &c.source,
            plate: c.plate.as_deref(),
            size: c.camera.size,
            end_frame: c.end_frame,
            frame_rate_hz: c.frame_rate,
            quality: c.quality.as_ref(),
            warnings: &c.warnings,
        };
        Self {
            run_id,
            kind: "multi-view",
            code: Code { version: env!("CARGO_PKG_VERSION"), commit: option_env!("MAREY_COMMIT") },
            session: SessionReport {
                id: request.session_id,
                name: &request.session_name,
                files: request.files.iter().map(file).collect(),
            },
            body_model: &request.body_model,
            parameters: &request.parameters,
            seeds: [],
            cameras: cameras.iter().map(camera).collect(),
            warnings,
            timings: Timings { plan, cameras: cameras.iter().map(|c| &c.job).collect(), initialise },
        }
    }
}

/// What `shape.json` says: the shape once, and pose and joints of every frame it was found from.
pub(crate) fn shape_report(
    model: &BodyModel,
    shape: &Shape,
    moments: &[Moment],
    fits: &[Fit],
    warnings: &[String],
) -> Value {
    let frames = moments.iter().zip(fits).map(|(moment, fit)| {
        let joints: Map<String, Value> = model
            .rig()
            .joints()
            .iter()
            .zip(&fit.joints)
            .map(|(joint, place)| (joint.name.clone(), json!([place.x, place.y, place.z])))
            .collect();
        let pose: Map<String, Value> = model
            .rig()
            .dofs()
            .iter()
            .zip(&fit.pose)
            .map(|(dof, value)| (dof.name.clone(), json!(value)))
            .collect();
        let views = fit.views.iter();
        let views = views.map(|v| json!({ "camera": v.camera, "overlap": v.iou, "is_used": v.is_used }));
        json!({
            "frame": moment.frame,
            "confidence": fit.confidence,
            "joints_m": joints,
            "pose": pose,
            "views": views.collect::<Vec<_>>(),
        })
    });
    json!({
        "alpha": shape.alpha,
        "measurements": measurements(&shape.measurements(model)),
        "confidence": fits.iter().map(|fit| fit.confidence).fold(f64::INFINITY, f64::min),
        "frames": frames.collect::<Vec<_>>(),
        "warnings": warnings,
    })
}

fn measurements(m: &Measurements) -> Value {
    json!({
        "stature_m": m.stature_m,
        "mass_kg": m.mass_kg,
        "arm_span_m": m.arm_span_m,
        "inseam_m": m.inseam_m,
        "chest_m": m.chest_m,
        "waist_m": m.waist_m,
        "hip_m": m.hip_m,
    })
}
