//! `marey run`.

use anyhow::Context;
use body::Sex;
use clap::builder::PossibleValuesParser;
use client::{
    Client, Run, ServerArgs,
    numbers::positive,
    parameters::{pairs, values},
};
use serde_json::{Map, Value, json};

use crate::{marker_sets, watch, words::name};

/// Reconstruct a session: a motion from control points, or a body and its motion from what cameras saw
///
/// How depends on the session's files: with control points, --database names the recordings to learn from; with a
/// calibration and videos, pictures or masks, the person's body is found and followed. Points and cameras together, or points
/// without recordings: --kind inverse-kinematics.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey run \"take 3\" --database walks --watch
  marey run \"take 3\" --database walks@1 --points left_wrist,right_wrist,left_ankle,right_ankle
  marey run \"take 3\" --database walks --set smooth=true
  marey run \"markers\" --database walks --map plug-in-gait     # see `marey markers --list`
  marey run \"markers\" --database walks --map take3.toml         # see `marey markers --write`
  marey run \"markers\" --database walks --map LWRA=left_wrist --map RWRA=right_wrist
  marey run \"take 4\" --watch                                  # a session with cameras
  marey run \"take 4\" --cameras cam01,cam02,cam03
  marey run \"take 4\" --set frame_rate=60 --set particles=50
  marey run \"take 4\" --set track=false                        # the body in the first frame alone
  marey run \"take 3\" --kind inverse-kinematics --stature 1.78 --sex male --watch")]
pub struct Args {
    /// The session, by name or id
    #[arg(value_parser = name)]
    session: String,
    /// sparse (control points and a motion database), multi-view (cameras) or inverse-kinematics [default: by the
    /// session's files; required if it has both control points and cameras]
    #[arg(long, value_parser = PossibleValuesParser::new(gateway::session_run_kinds()))]
    kind: Option<String>,
    /// Any other parameter: of points, see docs/methods.md; of cameras, see docs/multiview.md; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    parameters: Vec<String>,
    /// Show the progress and wait for the end
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    points: PointsArgs,
    #[command(flatten)]
    sparse: SparseArgs,
    #[command(flatten)]
    cameras: CameraArgs,
    #[command(flatten)]
    inverse_kinematics: InverseKinematicsArgs,
    #[command(flatten)]
    server: ServerArgs,
}

/// Options on the file of measured points.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Measured points")]
struct PointsArgs {
    /// Control points to use, separated by commas [default: all in the file]
    #[arg(long, value_delimiter = ',', value_parser = name, value_name = "NAMES")]
    points: Vec<String>,
    /// Which markers of the file make which control point: the name of a marker set (see `marey markers --list`), a file with a
    /// marker map, or MARKER=POINT, which may be given several times [default: the marker set that the names belong to]
    #[arg(long = "map", value_name = "SET, FILE or MARKER=POINT")]
    mapping: Vec<String>,
    /// What the names of the performer's markers begin with, if the file has several people, such as Anna:
    #[arg(long, value_name = "PREFIX")]
    prefix: Option<String>,
    /// Axis of the file of points, or of the calibration, that points up: x, y or z [default: as the file says; else for points z
    /// (C3D) or y, for a calibration what its format and the cameras say]
    #[arg(long, value_parser = ["x", "y", "z"], value_name = "AXIS")]
    up: Option<String>,
}

/// Options of a run that learns from a motion database.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Control points and a motion database")]
struct SparseArgs {
    /// Motion database to learn from: NAME (its latest version) or NAME@VERSION
    #[arg(long, short, value_name = "NAME")]
    database: Option<String>,
    /// local-regression, nearest, lpca, lpcr or gplvm [default: local-regression]; see docs/methods.md
    #[arg(long)]
    method: Option<String>,
    /// How many of the latest poses are compared with the recordings [default: 2]
    #[arg(long, value_name = "FRAMES")]
    window: Option<u32>,
    /// How many moments of the recordings, the most similar ones, each frame is learned from [default: 64]
    #[arg(long, value_name = "NUMBER")]
    neighbours: Option<u32>,
    /// Length of one unit of BVH files, in metres [default: 0.01, centimetres]
    #[arg(long, visible_alias = "bvh-unit", value_name = "METRES", value_parser = positive)]
    bvh_metres_per_unit: Option<f64>,
}

/// Options of a session with cameras.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Cameras")]
struct CameraArgs {
    /// Cameras to use, separated by commas [default: all that have pictures]
    #[arg(long, value_delimiter = ',', value_parser = name, value_name = "NAMES")]
    cameras: Vec<String>,
    /// Which camera a file is from, if its name doesn't tell; may be given several times
    #[arg(long = "camera", value_name = "FILE=CAMERA")]
    camera_files: Vec<String>,
    /// Body model: NAME (its latest version) or NAME@VERSION [default: shipped]
    #[arg(long, value_name = "NAME")]
    body_model: Option<String>,
    /// How the person is separated from the background: auto, plate, adaptive or mixture [default: auto, which takes the plate if
    /// there is one]
    #[arg(long)]
    background: Option<String>,
    /// Length of one unit of the calibration, in metres, if its file doesn't say it
    #[arg(long, value_name = "METRES", value_parser = positive)]
    calibration_unit: Option<f64>,
}

/// Options of a run by inverse kinematics.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Inverse kinematics")]
struct InverseKinematicsArgs {
    /// plain, priority, image-constrained, extended, image-first or reach-then-image-then-posture [default: image-constrained
    /// with cameras, otherwise priority]
    #[arg(long)]
    solver: Option<String>,
    /// Largest number of steps for each frame [default: 15]
    #[arg(long)]
    steps: Option<u32>,
    /// Frames per second to solve [default: those of the cameras, otherwise those of the file of points]
    #[arg(long, value_name = "HZ", value_parser = positive)]
    frame_rate: Option<f64>,
    /// The person's stature in metres
    #[arg(long, value_name = "METRES", value_parser = positive)]
    stature: Option<f64>,
    /// The person's mass in kilograms
    #[arg(long, value_name = "KG", value_parser = positive)]
    mass: Option<f64>,
    /// The person's age in years
    #[arg(long, value_name = "YEARS", value_parser = positive)]
    age: Option<f64>,
    /// female or male
    #[arg(long)]
    sex: Option<Sex>,
}

impl InverseKinematicsArgs {
    /// The object of the request; none if nothing of it was said.
    fn request(&self) -> Option<Value> {
        let given = [
            ("solver", self.solver.as_ref().map(|name| json!(name))),
            ("steps", self.steps.map(Value::from)),
            ("frame_rate", self.frame_rate.map(Value::from)),
            ("stature_m", self.stature.map(Value::from)),
            ("mass_kg", self.mass.map(Value::from)),
            ("age_years", self.age.map(Value::from)),
            ("sex", self.sex.as_ref().map(|sex| json!(sex))),
        ];
        let object: Map<String, Value> =
            given.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect();
        (!object.is_empty()).then_some(Value::Object(object))
    }
}

/// Runs `marey run`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let request = request(args)?;
    let client = Client::new(args.server.server()?);
    let session = client
        .find_session(&args.session)?
        .with_context(|| format!("there is no session {:?}; upload its files first", args.session))?;
    let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &request)?;
    println!("run {}", run.id);
    if args.watch {
        watch::until_end(&client, &run.id)?;
        for warning in warnings(&client, &run.id)? {
            eprintln!("warning: {warning}");
        }
        println!("done; download the results with\n  marey results {} -o FOLDER", run.id);
    }
    Ok(())
}

/// Problems in the files, as the run's report has them.
fn warnings(client: &Client, run: &str) -> anyhow::Result<Vec<String>> {
    let report: Value = client.get(&format!("/v1/runs/{run}/results/run.json"))?;
    let warnings = report["warnings"].as_array().into_iter().flatten();
    Ok(warnings.filter_map(Value::as_str).map(str::to_owned).collect())
}

fn request(args: &Args) -> anyhow::Result<Value> {
    let mut request = json!({});
    let named = [
        ("motion_database", args.sparse.database.as_ref().map(|name| json!(name))),
        ("kind", args.kind.as_ref().map(|kind| json!(kind))),
        ("inverse_kinematics", args.inverse_kinematics.request()),
        ("body_model", args.cameras.body_model.as_ref().map(|name| json!(name))),
        ("cameras", (!args.cameras.cameras.is_empty()).then(|| json!(args.cameras.cameras))),
        (
            "camera_files",
            (!args.cameras.camera_files.is_empty())
                .then(|| {
                    pairs(&args.cameras.camera_files, "FILE=CAMERA", |name| name.into()).map(Value::Object)
                })
                .transpose()?,
        ),
        ("background", args.cameras.background.as_ref().map(|kind| json!(kind))),
        ("metres_per_unit", args.cameras.calibration_unit.map(Value::from)),
        ("points", (!args.points.points.is_empty()).then(|| json!(args.points.points))),
        ("marker_prefix", args.points.prefix.as_ref().map(|prefix| json!(prefix))),
        ("up", args.points.up.as_ref().map(|axis| json!(axis))),
        ("bvh_metres_per_unit", args.sparse.bvh_metres_per_unit.map(Value::from)),
        ("method", args.sparse.method.as_ref().map(|m| json!(m))),
        ("window", args.sparse.window.map(Value::from)),
        ("neighbours", args.sparse.neighbours.map(Value::from)),
        (
            "parameters",
            // a number or true where it reads as one, else a word
            (!args.parameters.is_empty()).then(|| values(&args.parameters).map(Value::Object)).transpose()?,
        ),
    ];
    for (name, value) in marker_sets::request(&args.points.mapping)? {
        request[name] = value;
    }
    for (name, value) in named {
        if let Some(value) = value {
            request[name] = value;
        }
    }
    Ok(request)
}
