//! Recorded markers: found by their names, mapped, and reconstructed.

use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};
use sample_motion::{Action, DrawOptions, Model};
use serde_json::{Value, json};
use tests::{Api, system};

/// The caller of a project whose motion database `drawn` has walks of a whole body.
fn with_walks() -> &'static Api {
    static READY: OnceLock<Api> = OnceLock::new();
    READY.get_or_init(|| {
        let api = system::shared().project("drawn").expect("a key is made");
        build(&api).expect("a motion database is built");
        api
    })
}

fn build(api: &Api) -> Result<()> {
    api.make("/v1/motion-databases", &json!({ "name": "drawn" }))?;
    for seed in 1..=6 {
        let options = DrawOptions { frames: 240, subject: seed / 4 };
        let walk = Model::bundled().draw(Action::Walk, seed, &options)?;
        let path = format!("/v1/motion-databases/drawn/files/1_{seed:02}.bvh");
        api.upload(&path, formats::bvh::write(&walk).as_bytes())?;
    }
    let run = api.make("/v1/motion-databases/drawn/build", &json!({}))?;
    let end = api.wait(&format!("/v1/runs/{}", run["id"].as_str().unwrap_or_default()))?;
    ensure!(end["state"] == "succeeded", "building failed: {end}");
    Ok(())
}

/// The report of a run that succeeds, and its poses as numbers.
fn finished(api: &Api, session: &str, request: &Value) -> Result<(Value, Vec<f64>)> {
    let run = api.start_run(session, request)?;
    let end = api.wait(&run)?;
    ensure!(end["state"] == "succeeded", "{end}");
    let files = api.motion_files(&run)?;
    let poses = files.iter().find(|file| file.0 == "poses.csv").context("no poses")?;
    let text = std::str::from_utf8(&poses.1)?;
    let numbers = text.lines().skip(1).flat_map(|line| line.split(',')).map(str::parse::<f64>);
    Ok((api.get(&format!("{run}/results/run.json"))?.json(), numbers.collect::<Result<_, _>>()?))
}

fn warnings(report: &Value) -> String {
    report["warnings"].to_string()
}

#[test]
fn a_recorded_walk_is_known_by_its_markers_and_reconstructed() -> Result<()> {
    let test = "a_recorded_walk_is_known_by_its_markers_and_reconstructed";
    let Some(folder) = testkit::shared::find("data/markers", test) else { return Ok(()) };
    let api = with_walks();
    let walk = testkit::shared::read(&folder, "opensim_walk_free_01.trc");
    let session = api.session("walk", &[("walk.trc", &walk)])?;
    let (report, poses) = finished(api, &session, &json!({"motion_database": "drawn"}))?;
    let mut points: Vec<&str> = report["session"]["points"]
        .as_array()
        .context("no points")?
        .iter()
        .filter_map(Value::as_str)
        .collect();
    points.sort_unstable();
    let mut expected = crate::POINTS;
    expected.sort_unstable();
    assert_eq!(points, expected);
    assert!(warnings(&report).contains("taken for the set gait2392"), "{}", warnings(&report));
    assert!(poses.len() > 73 * 60 && poses.iter().all(|v| v.is_finite()), "{} numbers", poses.len());

    // the same by name, with the two points that were asked for
    let asked =
        json!({"motion_database": "drawn", "marker_set": "gait2392", "points": ["root", "left_wrist"]});
    let (report, _) = finished(api, &session, &asked)?;
    assert_eq!(report["session"]["points"], json!(["root", "left_wrist"]));
    assert!(!warnings(&report).contains("taken for"), "{}", warnings(&report));
    assert_eq!(report["parameters"]["neighbours"], 64);
    Ok(())
}

/// A file with markers that no set has.
fn own_markers() -> String {
    let row = |frame: u32| {
        let t = f64::from(frame) / 60.0;
        format!("{t:.4},0.3,1,{t:.4},0.32,1,{t:.4},0,0.95,{t:.4},0,1.65,{t:.4},0.01\n")
    };
    let head = "time,W1_x,W1_y,W1_z,W2_x,W2_y,W2_z,P_x,P_y,P_z,T_x,T_y,T_z,T_sigma\n";
    (0..60).fold(head.to_owned(), |text, frame| text + &row(frame))
}

#[test]
fn a_map_of_ones_own_says_what_unknown_markers_are() -> Result<()> {
    let api = with_walks();
    let session = api.session("own", &[("own.csv", own_markers().as_bytes())])?;
    let map = "sigma_mm = 15\n[points]\nleft_wrist = ['W1', 'W2']\nroot = 'P'\n\
               head = { markers = ['T'], offset_mm = [0, 80, 0] }\n";
    let request = json!({"motion_database": "drawn", "marker_map": map});
    let (report, poses) = finished(api, &session, &request)?;
    assert_eq!(report["session"]["points"], json!(["left_wrist", "root", "head"]));
    assert!(poses.iter().all(|v| v.is_finite()));

    // two markers of one point without a file of one's own
    let pairs = json!({"W1": "left_wrist", "W2": "left_wrist", "P": "root"});
    let (report, _) = finished(api, &session, &json!({"motion_database": "drawn", "mapping": pairs}))?;
    assert_eq!(report["session"]["points"], json!(["left_wrist", "root"]));

    let fails = |request: Value| -> Result<String> {
        let run = api.start_run(&session, &request)?;
        Ok(api.wait(&run)?["error"].as_str().unwrap_or_default().to_owned())
    };
    let unknown = fails(json!({"motion_database": "drawn"}))?;
    assert!(unknown.contains("own.csv: the file's markers match no known marker set"), "{unknown}");
    let lacking =
        fails(json!({"motion_database": "drawn", "marker_map": "[points]\nroot = 'P'\nhead = 'Q'\n"}))?;
    assert!(lacking.contains("none of the markers of control point head (Q) is in the file"), "{lacking}");
    Ok(())
}

#[test]
fn a_map_that_makes_no_sense_is_refused_at_once() -> Result<()> {
    let api = with_walks();
    let session = api.session("own", &[("own.csv", own_markers().as_bytes())])?;
    for (field, value, expected) in [
        ("marker_set", json!("plug-out-gait"), "there is no marker set \"plug-out-gait\""),
        ("marker_map", json!("[points]\nhead = 3\n"), "line 2: expected a marker's name"),
        ("marker_prefix", json!("Anna:"), "marker_prefix needs a marker_map"),
        ("mapping", json!({"W1": "head"}), "found several"),
    ] {
        let mut request = json!({"motion_database": "drawn"});
        if field == "mapping" {
            request["marker_set"] = json!("cmu-41");
        }
        request[field] = value;
        let refused = api.post(&format!("{session}/runs"), &request)?;
        assert_eq!(refused.status, 422, "{field}");
        let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert!(detail.contains(expected), "{field}: {detail}");
    }
    Ok(())
}
