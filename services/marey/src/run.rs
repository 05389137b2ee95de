//! `marey run`.

use anyhow::{Context, bail};
use body::Sex;
use clap::builder::PossibleValuesParser;
use client::{
    Client, Request, Run, ServerArgs,
    numbers::{not_negative, positive},
    parameters::{pairs, values},
};
use model::Axis;
use serde_json::{Value, json};

use crate::{
    marker_sets, watch,
    words::{name, unit},
};

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
    #[arg(long, value_name = "AXIS")]
    up: Option<Axis>,
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
    #[arg(long, visible_alias = "bvh-unit", value_name = "METRES", value_parser = unit)]
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
    #[arg(long, value_name = "METRES", value_parser = unit)]
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
    #[arg(long, value_name = "YEARS", value_parser = not_negative)]
    age: Option<f64>,
    /// female or male
    #[arg(long)]
    sex: Option<Sex>,
}

impl PointsArgs {
    fn add_to(&self, request: Request) -> anyhow::Result<Request> {
        let mut markers = marker_sets::request(&self.mapping)?;
        if self.prefix.is_some() && !["marker_map", "marker_set"].iter().any(|way| markers.contains_key(*way))
        {
            bail!("--prefix needs a marker set or a file with a marker map: --map SET or --map FILE");
        }
        Ok(request
            .with("points", "--points", several(&self.points))
            .with("mapping", "--map", markers.remove("mapping"))
            .with("marker_map", "--map", markers.remove("marker_map"))
            .with("marker_set", "--map", markers.remove("marker_set"))
            .with("marker_prefix", "--prefix", self.prefix.as_deref())
            .with("up", "--up", self.up.map(|axis| axis.to_string())))
    }
}

impl SparseArgs {
    fn add_to(&self, request: Request) -> Request {
        request
            .with("motion_database", "--database", self.database.as_deref())
            .with("method", "--method", self.method.as_deref())
            .with("window", "--window", self.window)
            .with("neighbours", "--neighbours", self.neighbours)
            .with("bvh_metres_per_unit", "--bvh-metres-per-unit", self.bvh_metres_per_unit)
    }
}

impl CameraArgs {
    fn add_to(&self, request: Request) -> anyhow::Result<Request> {
        let files = pairs(&self.camera_files, "FILE=CAMERA", |name| name.into())?;
        Ok(request
            .with("cameras", "--cameras", several(&self.cameras))
            .with("camera_files", "--camera", (!files.is_empty()).then_some(files))
            .with("body_model", "--body-model", self.body_model.as_deref())
            .with("background", "--background", self.background.as_deref())
            .with("metres_per_unit", "--calibration-unit", self.calibration_unit))
    }
}

impl InverseKinematicsArgs {
    fn add_to(&self, request: Request) -> Request {
        request
            .with("inverse_kinematics.solver", "--solver", self.solver.as_deref())
            .with("inverse_kinematics.steps", "--steps", self.steps)
            .with("inverse_kinematics.frame_rate", "--frame-rate", self.frame_rate)
            .with("inverse_kinematics.stature_m", "--stature", self.stature)
            .with("inverse_kinematics.mass_kg", "--mass", self.mass)
            .with("inverse_kinematics.age_years", "--age", self.age)
            .with("inverse_kinematics.sex", "--sex", self.sex.as_ref().map(|sex| json!(sex)))
    }
}

/// The names that were given, if any were.
fn several(names: &[String]) -> Option<&[String]> {
    (!names.is_empty()).then_some(names)
}

/// Runs `marey run`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let request = request(args)?;
    let client = Client::new(args.server.server()?);
    let session = client
        .find_session(&args.session)?
        .with_context(|| format!("there is no session {:?}; upload its files first", args.session))?;
    let run: Run = client.post_request(&format!("/v1/sessions/{}/runs", session.id), &request)?;
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

/// The request that the options are.
fn request(args: &Args) -> anyhow::Result<Request> {
    // a number or true where it reads as one, else a word
    let parameters = values(&args.parameters)?;
    let request = Request::default().with("kind", "--kind", args.kind.as_deref()).with(
        "parameters",
        "--set",
        (!parameters.is_empty()).then_some(parameters),
    );
    let request = args.sparse.add_to(args.points.add_to(request)?);
    Ok(args.inverse_kinematics.add_to(args.cameras.add_to(request)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::Alone;
    use clap::{CommandFactory, Parser};

    fn asked(words: &[&str]) -> anyhow::Result<Request> {
        request(&Alone::<Args>::parse_from(["run", "take 3"].iter().chain(words)).args)
    }

    #[test]
    fn a_request_has_what_was_given_and_nothing_else() {
        assert_eq!(asked(&[]).unwrap().to_json(), json!({}));
        let words = ["--stature", "1.8", "--sex", "male", "--set", "smooth=true", "--points", "head,root"];
        let expected = json!({
            "inverse_kinematics": {"stature_m": 1.8, "sex": "male"},
            "parameters": {"smooth": true},
            "points": ["head", "root"],
        });
        assert_eq!(asked(&words).unwrap().to_json(), expected);
        let words = ["--camera", "a.mp4=cam01", "--map", "LWRA=left_wrist", "--database", "walks"];
        let expected = json!({
            "camera_files": {"a.mp4": "cam01"},
            "mapping": {"LWRA": "left_wrist"},
            "motion_database": "walks",
        });
        assert_eq!(asked(&words).unwrap().to_json(), expected);
    }

    #[test]
    fn refusals_name_the_options() {
        let request = asked(&["--stature", "180", "--set", "particles=5000"]).unwrap();
        for (said, expected) in [
            (
                "inverse_kinematics.stature_m is 180 m, expected 1 to 2.4 m",
                "--stature is 180 m, expected 1 to 2.4 m",
            ),
            (
                "parameters.particles is 5000, expected 2 to 2000",
                "--set particles is 5000, expected 2 to 2000",
            ),
            ("metres_per_unit is 0, expected 1", "--calibration-unit is 0, expected 1"),
        ] {
            assert_eq!(request.in_options(said), expected);
        }
    }

    #[test]
    fn every_field_of_a_run_names_an_option_that_there_is() {
        let command = Alone::<Args>::command();
        let request = asked(&[]).unwrap();
        for kind in gateway::session_run_fields() {
            let shown = request.in_options(&format!("they have: {kind}"));
            let option = shown.trim_start_matches("they have: ");
            for option in option.split(", ") {
                let name =
                    option.strip_prefix("--").unwrap_or_else(|| panic!("{kind} has no option: {shown}"));
                assert!(command.get_arguments().any(|known| known.get_long() == Some(name)), "{option}");
            }
        }
    }

    #[test]
    fn a_prefix_needs_names_to_go_before() {
        let refused = asked(&["--prefix", "Anna:"]).unwrap_err().to_string();
        assert!(refused.starts_with("--prefix needs a marker set"), "{refused}");
        asked(&["--prefix", "Anna:", "--map", "plug-in-gait"]).unwrap();
    }
}
