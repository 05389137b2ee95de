//! `run.json`: whatever its kind, a run says who made its results from what, and how long it took.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Map, Value, json};
use tests::{Api, System, trials};

use crate::{bodies, inverse_kinematics, tracking};

/// A run that has succeeded, and what its `run.json` must have.
struct Expected {
    run: String,
    kind: &'static str,
    /// what it is on
    subject: &'static str,
    /// what is said of that beside what is said of all such subjects
    subject_own: &'static [&'static str],
    /// its input files
    files: Vec<Value>,
    /// versions of what was learned before
    learned_from: &'static [&'static str],
    stages: &'static [&'static str],
}

#[test]
fn every_kind_of_run_says_who_made_its_results_from_what() -> Result<()> {
    let mut system = System::with_cameras(2)?;
    system.start_motion_index()?;
    system.start_reconstruction(2)?;
    let api = system.project("heads")?;
    let runs = [
        build_database(&api)?,
        train(&api)?,
        build_body_model(&api)?,
        sparse(&api, "local-regression")?,
        sparse(&api, "gplvm")?,
        multi_view(&api, false, &["plan", "cameras", "fit_shape"])?,
        multi_view(&api, true, &["plan", "cameras", "fit_shape", "chunks", "merge"])?,
        solve(&api, 1)?,
        solve(&api, 0)?,
    ];
    let whole = [
        "code",
        "code.commit",
        "code.version",
        "kind",
        "parameters",
        "run_id",
        "seeds",
        "subject",
        "timings",
        "warnings",
        "workers",
    ];
    for expected in runs {
        let end = api.wait(&expected.run)?;
        ensure!(end["state"] == "succeeded", "{}: {end}", expected.kind);
        let report = api.get(&format!("{}/results/run.json", expected.run))?.json();
        check(&report, &expected).with_context(|| format!("{}: {report:#}", expected.kind))?;
        assert_eq!(head(&report, &expected)?, whole, "head of {}", expected.kind);
        let subject: &[&str] = match expected.subject {
            "session" => &["files", "frame_rate_hz", "frames", "id", "name", "reading"],
            _ => &["files", "id", "name", "version"],
        };
        let found = keys(&report[expected.subject], expected.subject_own)?;
        assert_eq!(found, subject, "{} of {}", expected.subject, expected.kind);
    }
    Ok(())
}

/// The parts of a report that only some kinds have.
const OWN: [&str; 8] =
    ["base", "body", "body_model", "built", "cameras", "feet", "fitted_skeleton", "tracking"];

/// The keys of the head: all but those that are a kind's own. What a run is on has one name here, and what was learned before
/// none.
fn head(report: &Value, expected: &Expected) -> Result<Vec<String>> {
    let is_own = |key: &str| OWN.contains(&key) || key == "quality" || expected.learned_from.contains(&key);
    let all = object(report)?.keys().map(String::as_str);
    let mut keys = vec!["subject".to_owned()];
    keys.extend(all.filter(|key| *key != expected.subject && !is_own(key)).map(str::to_owned));
    keys.extend(object(&report["code"])?.keys().map(|key| format!("code.{key}")));
    keys.sort();
    Ok(keys)
}

/// The keys of an object, sorted: all but its `own`, which it must have too.
fn keys<'a>(value: &'a Value, own: &[&str]) -> Result<Vec<&'a str>> {
    let mut keys: Vec<&str> = object(value)?.keys().map(String::as_str).collect();
    for key in own {
        ensure!(keys.contains(key), "no {key} in {value}");
    }
    keys.retain(|key| !own.contains(key));
    keys.sort_unstable();
    Ok(keys)
}

fn check(report: &Value, expected: &Expected) -> Result<()> {
    let id = expected.run.rsplit('/').next().unwrap_or_default();
    ensure!(report["run_id"] == id && report["kind"] == expected.kind, "run and kind");
    let code = json!({ "version": env!("CARGO_PKG_VERSION"), "commit": marey::CODE.commit });
    ensure!(report["code"] == code, "code of the run, expected {code}");
    let is_checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.git").exists();
    match marey::CODE.commit {
        Some(commit) => ensure!(!commit.is_empty(), "the commit is empty"),
        None => ensure!(!is_checkout, "no commit, though there is a checkout"),
    }
    let subject = object(&report[expected.subject])?;
    ensure!(
        subject["id"].as_str().is_some_and(|id| id.len() == 36) && subject["name"].is_string(),
        "subject"
    );
    let files = subject["files"].as_array().context("no files")?;
    for (found, uploaded) in files.iter().zip(&expected.files) {
        ensure!(keys(found, &[])? == ["blake3", "bytes", "name", "role"], "keys of {found}");
        for (key, value) in object(found)? {
            ensure!(*value == uploaded[key] && !value.is_null(), "{key} of {found}");
        }
    }
    ensure!(files.len() == expected.files.len(), "number of input files");
    if report["parameters"]["method"] == "gplvm" {
        ensure!(report["motion_database"]["gplvm"]["blake3"].is_string(), "the model that was trained");
    }
    for learned in expected.learned_from {
        let learned = object(&report[learned])?;
        ensure!(learned["version"].is_i64() && learned["blake3"].as_str().is_some_and(|b| b.len() == 64));
    }
    if expected.subject == "session" {
        ensure!(object(&subject["reading"])?.contains_key("up"), "how the files were read");
    }
    ensure!(!object(&report["parameters"])?.is_empty(), "parameters");
    ensure!(report["seeds"].is_array() && report["warnings"].is_array(), "seeds and warnings");
    let workers = report["workers"].as_array().context("no workers")?;
    ensure!(!workers.is_empty() && workers.iter().all(|w| w.as_str().is_some_and(|w| !w.is_empty())));
    let timings = object(&report["timings"])?;
    for stage in expected.stages {
        let jobs = match timings.get(*stage).context(*stage)? {
            Value::Array(jobs) => jobs.clone(),
            job => vec![job.clone()],
        };
        ensure!(!jobs.is_empty(), "no job of stage {stage}");
        for job in jobs {
            ensure!(workers.contains(&job["worker"]), "the worker of {job} is not named");
            ensure!(
                job["attempt"] == 1 && job["seconds"].as_f64() > Some(0.0) && job["frames"].is_u64(),
                "{job}"
            );
        }
    }
    Ok(())
}

fn object(value: &Value) -> Result<&Map<String, Value>> {
    value.as_object().with_context(|| format!("{value} is no object"))
}

fn path_of(run: &Value) -> Result<String> {
    Ok(format!("/v1/runs/{}", run["id"].as_str().context("no id")?))
}

fn files(api: &Api, owner: &str) -> Result<Vec<Value>> {
    api.get(&format!("{owner}/files"))?.json().as_array().cloned().context("no files")
}

fn build_database(api: &Api) -> Result<Expected> {
    let path = "/v1/motion-databases/walks";
    api.make("/v1/motion-databases", &json!({ "name": "walks" }))?;
    api.upload(&format!("{path}/files/1.asf"), trials::skeleton().as_bytes())?;
    for seed in 1..=4 {
        api.upload(&format!("{path}/files/1_{seed:02}.amc"), trials::motion(seed, 240).as_bytes())?;
    }
    let run = path_of(&api.make(&format!("{path}/build"), &json!({}))?)?;
    let end = api.wait(&run)?;
    ensure!(end["state"] == "succeeded", "{end}");
    let stages = &["plan", "imports", "build"];
    let (kind, subject, files) = ("motion-database", "motion_database", files(api, path)?);
    Ok(Expected { run, kind, subject, subject_own: &[], files, learned_from: &[], stages })
}

fn train(api: &Api) -> Result<Expected> {
    let parameters = json!({"latent_dims": 2, "active": 48, "max_iterations": 5});
    let request = json!({"method": "gplvm", "parameters": parameters});
    let run = path_of(&api.make("/v1/motion-databases/walks/train", &request)?)?;
    // a run below uses it
    let end = api.wait(&run)?;
    ensure!(end["state"] == "succeeded", "{end}");
    let (kind, subject, stages) = ("training", "motion_database", &["train"]);
    // it reads the database itself, which has been built
    let (files, subject_own, learned_from) = (Vec::new(), &["blake3"], &["motion_database"]);
    Ok(Expected { run, kind, subject, subject_own, files, learned_from, stages })
}

fn build_body_model(api: &Api) -> Result<Expected> {
    let (path, run, end) = bodies::build(api, "people", &bodies::scans(8))?;
    ensure!(end["state"] == "succeeded", "{end}");
    let (kind, subject, files) = ("body-model", "body_model", files(api, &path)?);
    Ok(Expected { run, kind, subject, subject_own: &[], files, learned_from: &[], stages: &["build"] })
}

fn sparse(api: &Api, method: &str) -> Result<Expected> {
    let session = crate::session(api, 21, 240)?;
    let run = api.start_run(&session, &json!({"motion_database": "walks", "method": method}))?;
    let (files, subject_own, learned_from) = (files(api, &session)?, &["points"], &["motion_database"]);
    let stages = &["plan", "chunks", "merge"];
    Ok(Expected { run, kind: "sparse", subject: "session", subject_own, files, learned_from, stages })
}

fn multi_view(api: &Api, track: bool, stages: &'static [&'static str]) -> Result<Expected> {
    let session = tracking::take(0)?.upload(api)?;
    let parameters = json!({"track": track, "overlay": false, "frame_rate": 25});
    let run = api.start_run(&session, &json!({ "parameters": parameters }))?;
    let (files, learned_from) = (files(api, &session)?, &["body_model"]);
    Ok(Expected {
        run,
        kind: "multi-view",
        subject: "session",
        subject_own: &[],
        files,
        learned_from,
        stages,
    })
}

fn solve(api: &Api, cameras: usize) -> Result<Expected> {
    let capture = inverse_kinematics::capture(cameras)?;
    let mut uploads: Vec<(&str, &[u8])> = vec![("points.csv", &capture.points)];
    if cameras > 0 {
        uploads.extend([
            ("calibration.json", capture.calibration.as_slice()),
            ("silhouettes.tar", capture.masks.as_slice()),
        ]);
    }
    let session = api.session("take", &uploads)?;
    let run = api.start_run(&session, &json!({ "kind": "inverse-kinematics" }))?;
    let (files, subject_own, learned_from) = (files(api, &session)?, &["points"], &["body_model"]);
    let stages: &[&str] = if cameras > 0 { &["plan", "cameras", "solve"] } else { &["solve"] };
    let kind = "inverse-kinematics";
    Ok(Expected { run, kind, subject: "session", subject_own, files, learned_from, stages })
}
