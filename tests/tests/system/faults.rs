//! What goes wrong while a run goes on costs time and nothing else.

use std::time::Duration;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use tests::{Api, System};

/// This program as `marey`, built beside the tests.
pub const MAREY: &str = env!("CARGO_BIN_EXE_marey-under-test");

/// 1,200 frames at 60 a second, in 20 chunks.
const FRAMES: usize = 2_400;

/// 6,000 frames in 20 chunks, long enough to be interrupted in.
const LONG_FRAMES: usize = 12_000;
const LONG_CHUNK: u64 = 300;

/// The workers that had chunks of a run, and the attempts that these took together.
fn chunk_work(api: &Api, run: &str) -> Result<(usize, u64)> {
    let run = api.get(run)?.json();
    let jobs = run["jobs"].as_array().context("no jobs")?;
    let jobs = jobs.iter().find(|j| j["kind"] == "reconstruct-chunk").context("no chunks")?;
    Ok((jobs["workers"].as_array().map_or(0, Vec::len), jobs["attempts"].as_u64().unwrap_or(0)))
}

fn undisturbed(api: &Api, session: &str, request: &Value) -> Result<Vec<(String, Vec<u8>)>> {
    let run = api.start_run(session, request)?;
    let end = api.wait(&run)?;
    anyhow::ensure!(end["state"] == "succeeded", "{end}");
    api.motion_files(&run)
}

fn assert_same(found: &[(String, Vec<u8>)], expected: &[(String, Vec<u8>)]) {
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(found), names(expected));
    assert!(expected.len() >= 6, "{:?}", names(expected));
    for ((name, a), (_, b)) in found.iter().zip(expected) {
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn the_result_does_not_depend_on_the_number_of_workers() -> Result<()> {
    let (system, api) = crate::own_system(0)?;
    let session = crate::session(&api, 31, FRAMES)?;
    let one = system.spawn(MAREY, "reconstruction", "only")?;
    let alone = undisturbed(&api, &session, &crate::in_chunks())?;
    drop(one);
    let _three = ["first", "second", "third"]
        .map(|name| system.spawn(MAREY, "reconstruction", name))
        .into_iter()
        .collect::<Result<Vec<_>>>()?;
    // On a busy machine one of them may be first with every chunk of a run: then it is asked again.
    for _ in 0..5 {
        let run = api.start_run(&session, &crate::in_chunks())?;
        let end = api.wait(&run)?;
        assert_eq!(end["state"], "succeeded", "{end}");
        assert_same(&api.motion_files(&run)?, &alone);
        if chunk_work(&api, &run)?.0 >= 2 {
            return Ok(());
        }
    }
    anyhow::bail!("three workers never shared a run")
}

#[test]
fn a_worker_killed_in_the_middle_of_a_run_costs_nothing_but_time() -> Result<()> {
    let (system, api) = crate::own_system(0)?;
    system.set_staleness(Duration::from_secs(1))?;
    let session = crate::session(&api, 32, LONG_FRAMES)?;
    let parameters = json!({ "chunk_frames": LONG_CHUNK, "warm_up_frames": 30 });
    let request = json!({ "motion_database": "walks", "parameters": parameters });
    let mut victim = system.spawn(MAREY, "reconstruction", "victim")?;
    let expected = undisturbed(&api, &session, &request)?;
    // Killed between two jobs nothing is lost: then it is tried again.
    for trial in 0..10 {
        let run = api.start_run(&session, &request)?;
        let event = api.wait_until(&run, |event| event["progress"].as_f64() > Some(0.2))?;
        assert_eq!(event["state"], "running", "{event}");
        victim.kill()?;
        victim = system.spawn(MAREY, "reconstruction", &format!("successor {trial}"))?;
        let end = api.wait(&run)?;
        assert_eq!(end["state"], "succeeded", "{end}");
        assert_same(&api.motion_files(&run)?, &expected);
        let (workers, attempts) = chunk_work(&api, &run)?;
        if attempts > (LONG_FRAMES as u64 / 2).div_ceil(LONG_CHUNK) && workers == 2 {
            return Ok(());
        }
    }
    anyhow::bail!("no job was ever interrupted")
}

#[test]
fn without_its_database_the_gateway_says_so_and_recovers() -> Result<()> {
    let system = System::start_in_own_cluster()?;
    let api = system.project("p")?;
    assert_eq!(api.get("/readyz")?.status, 200);
    system.restart_database()?;
    let begin = std::time::Instant::now();
    while api.get("/readyz")?.status != 200 {
        assert!(begin.elapsed() < Duration::from_secs(30), "it is not ready again");
    }
    // a throw-away server may lose its last commits in a crash, the key's among them
    assert_eq!(system.project("p")?.get("/v1/me")?.status, 200);
    Ok(())
}
