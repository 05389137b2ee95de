//! `marey run`.

use anyhow::Context;
use client::{
    Client, Run, ServerArgs,
    parameters::{pairs, values},
};
use serde_json::{Map, Value, json};

use crate::{marker_sets, watch};

/// Reconstruct a session: motion from control points, or a body and its motion from what cameras saw
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey run \"take 3\" --database walks --watch
  marey run \"take 3\" --database walks@2 --points left_wrist,right_wrist,left_ankle,right_ankle
  marey run \"take 3\" --database walks --map plug-in-gait
  marey run \"take 3\" --database walks --map map.toml            (see `marey markers --write`)
  marey run \"take 3\" --database walks --map LWRA=left_wrist --map RWRA=right_wrist
  marey run \"take 3\" --database walks --set chunk_frames=1200
  marey run \"take 4\" --watch                                  (a session with cameras)
  marey run \"take 4\" --cameras cam01,cam02,cam03 --camera GX010042.MP4=cam01
  marey run \"take 4\" --set frame_rate=60 --set particles=50
  marey run \"take 4\" --set track=false                       (the body in the first frame alone)
  marey run \"take 5\" --kind inverse-kinematics --stature 1.78 --sex male --watch")]
pub struct Args {
    /// The session: its name or id
    session: String,
    /// Motion database to learn from: NAME (its latest version) or NAME@VERSION; needed for control points
    #[arg(long, short)]
    database: Option<String>,
    /// Body model, for cameras: NAME (its latest version) or NAME@VERSION [default: shipped]
    #[arg(long, value_name = "NAME", help_heading = "Cameras")]
    body_model: Option<String>,
    /// Cameras to use, separated by commas [default: all with pictures]
    #[arg(long, value_delimiter = ',', value_name = "NAMES", help_heading = "Cameras")]
    cameras: Vec<String>,
    /// Which camera a file is of, where its name doesn't tell: FILE=CAMERA; may be given often
    #[arg(long = "camera", value_name = "FILE=CAMERA", help_heading = "Cameras")]
    camera_files: Vec<String>,
    /// How the person is told from the background: auto, plate, adaptive or mixture [default: auto, the plate if there is one]
    #[arg(long, help_heading = "Cameras")]
    background: Option<String>,
    /// Metres of one unit of the calibration, where the file doesn't say it
    #[arg(long, value_name = "METRES", help_heading = "Cameras")]
    calibration_unit: Option<f64>,
    /// sparse, multi-view or inverse-kinematics; to be said where a session has control points and cameras
    #[arg(long, value_parser = ["sparse", "multi-view", "inverse-kinematics"])]
    kind: Option<String>,
    #[command(flatten)]
    inverse_kinematics: InverseKinematicsArgs,
    /// Control points to use, separated by commas [default: all in the file]
    #[arg(long, value_delimiter = ',')]
    points: Vec<String>,
    /// Which markers of the file make which control point: a marker set's name (see `marey markers`), a file with a marker
    /// map, or MARKER=POINT, which may be given often [default: the set that the names belong to]
    #[arg(long = "map", value_name = "SET, FILE or MARKER=POINT")]
    mapping: Vec<String>,
    /// What the names of the performer's markers begin with, where a file has several people: Anna:
    #[arg(long, value_name = "PREFIX")]
    prefix: Option<String>,
    /// Axis of a TRC or C3D file, or of a calibration, that points up: x, y or z [default: what the file says, else y for TRC,
    /// z for C3D]
    #[arg(long, value_parser = ["x", "y", "z"])]
    up: Option<String>,
    /// Metres of one unit of BVH files [default: 0.01, centimetres]
    #[arg(long, value_name = "METRES")]
    bvh_unit: Option<f64>,
    /// local-regression, nearest, lpca, lpcr or gplvm [default: local-regression]; docs/methods.md
    #[arg(long)]
    method: Option<String>,
    /// Frames of history to look at
    #[arg(long)]
    window: Option<u32>,
    /// Neighbours to learn from
    #[arg(long)]
    neighbours: Option<u32>,
    /// Any other parameter of the method: NAME=VALUE; may be given often
    #[arg(long = "set", value_name = "NAME=VALUE")]
    parameters: Vec<String>,
    /// Show the progress and wait for the end
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Options that make a run one by inverse kinematics.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Inverse kinematics")]
struct InverseKinematicsArgs {
    /// plain, priority, image-constrained, extended, image-first or reach-then-image-then-posture [default: image-constrained
    /// with cameras, else priority]
    #[arg(long)]
    solver: Option<String>,
    /// Most steps of one solve [default: 15]
    #[arg(long)]
    steps: Option<u32>,
    /// Frames a second that are solved [default: the cameras', or those of the file of points]
    #[arg(long, value_name = "HZ")]
    frame_rate: Option<f64>,
    /// The person's height, metres
    #[arg(long, value_name = "METRES")]
    stature: Option<f64>,
    /// The person's mass, kilograms
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// The person's age, years
    #[arg(long, value_name = "YEARS")]
    age: Option<f64>,
    /// female or male
    #[arg(long, value_parser = ["female", "male"])]
    sex: Option<String>,
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
    let client = Client::new(args.server.server()?);
    let session = client
        .find_session(&args.session)?
        .with_context(|| format!("there is no session {:?}; upload its files first", args.session))?;
    let run: Run = client.post(&format!("/v1/sessions/{}/runs", session.id), &request(args)?)?;
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

/// What was sloppy about the files, as the run's report has it.
fn warnings(client: &Client, run: &str) -> anyhow::Result<Vec<String>> {
    let report: Value = client.get(&format!("/v1/runs/{run}/results/run.json"))?;
    let warnings = report["warnings"].as_array().into_iter().flatten();
    Ok(warnings.filter_map(Value::as_str).map(str::to_owned).collect())
}

fn request(args: &Args) -> anyhow::Result<Value> {
    let mut request = json!({});
    let named = [
        ("motion_database", args.database.as_ref().map(|name| json!(name))),
        ("kind", args.kind.as_ref().map(|kind| json!(kind))),
        ("inverse_kinematics", args.inverse_kinematics.request()),
        ("body_model", args.body_model.as_ref().map(|name| json!(name))),
        ("cameras", (!args.cameras.is_empty()).then(|| json!(args.cameras))),
        (
            "camera_files",
            (!args.camera_files.is_empty())
                .then(|| pairs(&args.camera_files, |name| name.into()))
                .transpose()?,
        ),
        ("background", args.background.as_ref().map(|kind| json!(kind))),
        ("metres_per_unit", args.calibration_unit.map(Value::from)),
        ("points", (!args.points.is_empty()).then(|| json!(args.points))),
        ("marker_prefix", args.prefix.as_ref().map(|prefix| json!(prefix))),
        ("up", args.up.as_ref().map(|axis| json!(axis))),
        ("bvh_metres_per_unit", args.bvh_unit.map(Value::from)),
        ("method", args.method.as_ref().map(|m| json!(m))),
        ("window", args.window.map(Value::from)),
        ("neighbours", args.neighbours.map(Value::from)),
        (
            "parameters",
            // a number or true where it reads as one, else a word
            (!args.parameters.is_empty()).then(|| values(&args.parameters)).transpose()?,
        ),
    ];
    for (name, value) in marker_sets::request(&args.mapping)? {
        request[name] = value;
    }
    for (name, value) in named {
        if let Some(value) = value {
            request[name] = value;
        }
    }
    Ok(request)
}
