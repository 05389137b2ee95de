//! From control points to motion.

use anyhow::{Context, Result};
use evaluation::compare;
use serde_json::json;
use tests::trials;

use crate::POINTS;

#[test]
fn a_session_comes_back_as_full_body_motion() -> Result<()> {
    let api = crate::with_database();
    let session = crate::session(api, 21, 600)?;
    api.upload(&format!("{session}/files/truth.amc"), trials::motion(21, 600).as_bytes())?;
    let started =
        api.post(&format!("{session}/runs"), &json!({"motion_database": "walks", "neighbours": 48}))?;
    assert_eq!(started.status, 202);
    let run = started.header("location").to_owned();
    assert_eq!(started.json()["parameters"]["parameters"]["neighbours"], 48);
    assert_eq!(started.json()["parameters"]["parameters"]["window"], 2, "defaults are shown resolved");
    let end = api.wait(&run)?;
    assert_eq!((&end["state"], &end["progress"]), (&json!("succeeded"), &json!(1.0)), "{end}");

    let files = api.motion_files(&run)?;
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    for name in ["motion.bvh", "motion.amc", "skeleton.asf", "poses.csv", "positions.csv", "quality.csv"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    let file = |name: &str| files.iter().find(|f| f.0 == name).map(|f| f.1.as_slice()).context("not there");
    let acclaim = formats::asf::read(file("skeleton.asf")?)?.value;
    let found = formats::amc::read(file("motion.amc")?, &acclaim, 60.0)?.value;
    assert_eq!(found.num_frames(), 300);
    let truth = crate::motion(21, 600)?;
    let every_second: Vec<f64> = truth.poses().step_by(2).flatten().copied().collect();
    let truth = model::Motion::new(truth.skeleton().clone(), 60.0, every_second)?;
    let errors = compare(&truth, &found);
    assert!(errors.rms_deg < 3.0 && errors.mpjpe_cm < 3.0, "{errors:?}");

    let report = api.get(&format!("{run}/results/run.json"))?.json();
    assert_eq!(report["parameters"]["neighbours"], 48);
    assert_eq!(report["session"]["points"], json!(POINTS));
    let shown = api.get(&run)?.json();
    let kinds: Vec<&str> =
        shown["jobs"].as_array().context("no jobs")?.iter().filter_map(|j| j["kind"].as_str()).collect();
    assert_eq!(kinds, ["plan-sparse", "reconstruct-chunk", "merge-chunks"]);
    assert!(shown["jobs"][1]["workers"][0].as_str().is_some_and(|w| !w.is_empty()), "{shown}");
    let listed = api.get(&format!("{session}/runs"))?.json();
    assert_eq!(listed["items"].as_array().map(Vec::len), Some(1));
    Ok(())
}

#[test]
fn bad_control_points_fail_the_run_and_name_file_and_line() -> Result<()> {
    let api = crate::with_database();
    let csv = "time,left_wrist_x,left_wrist_y,left_wrist_z,head_x,head_y,head_z\n\
               0,0,0,0,0,1,0\n0.0166,0,zero,0,0,1,0\n";
    let session = api.session("bad", &[("take-7.csv", csv.as_bytes())])?;
    let run = api.start_run(&session, &json!({"motion_database": "walks"}))?;
    let end = api.wait(&run)?;
    assert_eq!(end["state"], "failed");
    let error = end["error"].as_str().unwrap_or_default();
    assert!(error.contains("take-7.csv") && error.contains("line 3"), "{error}");
    assert_eq!(api.get(&run)?.json()["error"].as_str(), Some(error));
    assert_eq!(api.get(&format!("{run}/results"))?.json(), json!([]));
    Ok(())
}

#[test]
fn an_archive_that_is_none_fails_the_build_and_is_named() -> Result<()> {
    let api = crate::with_database();
    api.make("/v1/motion-databases", &json!({"name": "broken"}))?;
    api.upload("/v1/motion-databases/broken/files/broken.zip", b"PK\x03\x04 and then nothing")?;
    let run = api.make("/v1/motion-databases/broken/build", &json!({}))?;
    let end = api.wait(&format!("/v1/runs/{}", run["id"].as_str().unwrap_or_default()))?;
    assert_eq!(end["state"], "failed", "{end}");
    assert!(end["error"].as_str().is_some_and(|e| e.contains("broken.zip")), "{end}");
    let database = api.get("/v1/motion-databases/broken")?.json();
    assert_eq!(database["state"], "failed");
    let session = crate::session(api, 3, 240)?;
    let refused = api.post(&format!("{session}/runs"), &json!({"motion_database": "broken"}))?;
    assert_eq!(refused.status, 409, "it is there, and not ready");
    let refused = api.post(&format!("{session}/runs"), &json!({"motion_database": "broken@1"}))?;
    assert_eq!((refused.status, refused.problem().as_str()), (409, "conflict"));
    Ok(())
}

#[test]
fn marker_names_are_mapped_to_control_points() -> Result<()> {
    let api = crate::with_database();
    let csv = crate::points_csv(5, 240)?.replacen("left_wrist", "LWRA", 3).replacen("head", "TOP", 3);
    let session = api.session("markers", &[("points.csv", csv.as_bytes())])?;
    let request = json!({
        "motion_database": "walks",
        "points": ["left_wrist", "head", "root"],
        "mapping": {"LWRA": "left_wrist", "TOP": "head"},
    });
    let run = api.start_run(&session, &request)?;
    let end = api.wait(&run)?;
    assert_eq!(end["state"], "succeeded", "{end}");
    Ok(())
}

#[test]
fn a_run_is_cancelled_before_it_begins() -> Result<()> {
    let (_system, api) = crate::own_system(0)?;
    let session = crate::session(&api, 5, 240)?;
    let run = api.start_run(&session, &json!({"motion_database": "walks"}))?;
    assert_eq!(api.get(&run)?.json()["state"], "queued");
    assert_eq!(api.delete(&session)?.status, 409, "a run of it goes on");
    assert_eq!(api.delete(&format!("{session}/files/points.csv"))?.status, 409);
    assert_eq!(api.put(&format!("{session}/files/points.csv"), b"x")?.status, 409);
    assert_eq!(api.delete("/v1/motion-databases/walks")?.status, 409);
    assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled");
    assert_eq!(api.wait(&run)?["state"], "cancelled");
    assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled", "again is no error");
    assert_eq!(api.delete(&session)?.status, 204);
    assert_eq!(api.delete("/v1/motion-databases/walks@1")?.status, 204);
    Ok(())
}

#[test]
fn a_run_is_cancelled_while_it_runs() -> Result<()> {
    let (system, api) = crate::own_system(1)?;
    system.set_staleness(std::time::Duration::from_secs(1))?;
    let session = crate::session(&api, 5, 12_000)?;
    let run = api.start_run(&session, &crate::in_chunks())?;
    let event = api.wait_until(&run, |event| event["progress"].as_f64() > Some(0.1))?;
    assert_eq!(event["state"], "running", "{event}");
    assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled");
    assert_eq!(api.wait(&run)?["state"], "cancelled");
    // the worker is free for others
    let next = crate::session(&api, 6, 240)?;
    let run = api.start_run(&next, &json!({"motion_database": "walks"}))?;
    assert_eq!(api.wait(&run)?["state"], "succeeded");
    Ok(())
}

#[test]
fn progress_comes_as_events_that_rise_and_end() -> Result<()> {
    let api = crate::with_database();
    let session = crate::session(api, 5, 12_000)?;
    let run = api.start_run(&session, &crate::in_chunks())?;
    let seen = std::cell::RefCell::new(Vec::new());
    let end = api.wait_until(&run, |event| {
        seen.borrow_mut().push(event["progress"].as_f64().unwrap_or(-1.0));
        false
    })?;
    assert_eq!(end["state"], "succeeded", "{end}");
    let seen = seen.into_inner();
    assert!(seen.len() >= 3, "{seen:?}");
    assert!(seen.is_sorted(), "{seen:?}");
    // who comes later hears the end at once
    assert_eq!(api.wait(&run)?, end);
    Ok(())
}
