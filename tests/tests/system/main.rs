//! The whole system as its users meet it: real services, a real PostgreSQL, real HTTP.

mod access;
mod bodies;
mod cameras;
mod command;
mod databases;
mod downloads;
mod faults;
mod interface;
mod inverse_kinematics;
mod live;
mod markers;
mod requests;
mod run_json;
mod runs;
mod tracking;
mod uploads;
mod versioned;

use std::sync::OnceLock;

use anyhow::{Result, ensure};
use model::Motion;
use serde_json::{Value, json};
use tests::{Api, System, system, trials};

/// All of the papers' control points.
const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];

/// The motion of a trial.
fn motion(seed: u32, frames: usize) -> Result<Motion> {
    let acclaim = formats::asf::read(trials::skeleton().as_bytes())?.value;
    let amc = trials::motion(seed, frames);
    Ok(formats::amc::read(amc.as_bytes(), &acclaim, trials::FRAME_RATE as f64)?.value)
}

/// What is measured of a trial: its control points, as CSV.
fn points_csv(seed: u32, frames: usize) -> Result<String> {
    Ok(formats::points_csv::write(&evaluation::control_trajectories(&motion(seed, frames)?, &POINTS)?))
}

/// Builds a motion database of six trials under that name.
fn build_database(api: &Api, name: &str) -> Result<()> {
    api.make("/v1/motion-databases", &json!({ "name": name }))?;
    let path = format!("/v1/motion-databases/{name}");
    api.upload(&format!("{path}/files/1.asf"), trials::skeleton().as_bytes())?;
    for seed in 1..=6 {
        api.upload(&format!("{path}/files/1_{seed:02}.amc"), trials::motion(seed, 360).as_bytes())?;
    }
    let run = api.make(&format!("{path}/build"), &json!({}))?;
    let end = api.wait(&format!("/v1/runs/{}", run["id"].as_str().unwrap_or_default()))?;
    ensure!(end["state"] == "succeeded", "building failed: {end}");
    Ok(())
}

/// The shared system's caller of project `walks`, which has a motion database of that name.
fn with_database() -> &'static Api {
    static READY: OnceLock<Api> = OnceLock::new();
    READY.get_or_init(|| {
        let api = system::shared().project("walks").expect("a key is made");
        build_database(&api, "walks").expect("a motion database is built");
        api
    })
}

/// A session with the control points of a trial that is not in the database; its path.
fn session(api: &Api, seed: u32, frames: usize) -> Result<String> {
    let points = points_csv(seed, frames)?;
    let skeleton = trials::skeleton();
    api.session("a walk", &[("points.csv", points.as_bytes()), ("skeleton.asf", skeleton.as_bytes())])
}

/// A run of many short chunks.
fn in_chunks() -> Value {
    json!({ "motion_database": "walks", "parameters": { "chunk_frames": 60, "warm_up_frames": 30 } })
}

/// A system of its own with a motion database.
fn own_system(workers: usize) -> Result<(System, Api)> {
    let mut system = System::start()?;
    system.start_motion_index()?;
    if workers > 0 {
        system.start_reconstruction(workers)?;
    }
    let api = system.project("walks")?;
    build_database(&api, "walks")?;
    Ok((system, api))
}
