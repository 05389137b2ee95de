//! The compose stack as its users meet it: through the published port, with containers added and killed.
//!
//! `make test-compose` brings the stack up and runs these tests one after the other; without a stack they are skipped.

mod client;
mod stack;
mod trials;

use anyhow::{Context, Result, ensure};
use client::{Client, Run};
use stack::Stack;
use std::{
    collections::BTreeSet,
    sync::OnceLock,
    time::{Duration, Instant},
};

/// Chunks of this many frames, so that one run has work for several replicas.
const CHUNK_FRAMES: usize = 300;
const NUM_CHUNKS: usize = 16;
const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
/// Longer than any of these runs takes on a slow machine, killed replicas included.
const LONGEST_RUN: Duration = Duration::from_secs(180);

/// The stack with a motion database in it; `None` where there is no stack.
fn stack(test: &str) -> Option<&'static (Stack, Client)> {
    static READY: OnceLock<Option<(Stack, Client)>> = OnceLock::new();
    let ready = READY.get_or_init(|| {
        let (stack, client) = Stack::from_environment()?;
        build_motion_database(&client).expect("a motion database is built");
        Some((stack, client))
    });
    if ready.is_none() {
        println!("skipped: {test}: no compose stack");
    }
    ready.as_ref()
}

fn build_motion_database(client: &Client) -> Result<()> {
    client.post("/v1/motion-databases", &serde_json::json!({"name": "walks"}))?;
    for seed in 1..=6 {
        let bytes = formats::bvh::write(&trials::draw(seed, 600)?);
        client.put(&format!("/v1/motion-databases/walks/files/{seed}.bvh"), bytes.as_bytes())?;
    }
    let build = client.start("/v1/motion-databases/walks/build", &serde_json::json!({}))?;
    client.wait_until_succeeded(&build, LONGEST_RUN)?;
    Ok(())
}

/// A session of a trial that is not in the database. Returns its path.
fn upload_session(client: &Client, truth: &model::Motion) -> Result<String> {
    let session = client.post("/v1/sessions", &serde_json::json!({"name": "drawn trial"}))?;
    let path = format!("/v1/sessions/{}", session["id"].as_str().context("a session has an id")?);
    client.put(
        &format!("{path}/files/points.csv"),
        formats::points_csv::write(&evaluation::control_trajectories(truth, &POINTS)?).as_bytes(),
    )?;
    Ok(path)
}

fn start_run(client: &Client, session: &str) -> Result<Run> {
    let parameters = serde_json::json!({
        "motion_database": "walks",
        "points": POINTS,
        "parameters": {"chunk_frames": CHUNK_FRAMES},
    });
    client.start(&format!("{session}/runs"), &parameters)
}

/// Name and BLAKE3 of every result that may not depend on who computed it and when: all but `run.json`.
fn motion_files(client: &Client, run: &Run) -> Result<Vec<(String, String)>> {
    let files: Vec<_> =
        client.results(run)?.into_iter().filter(|(name, _)| !name.ends_with("run.json")).collect();
    ensure!(!files.is_empty(), "the run has no results");
    Ok(files)
}

/// The session that the tests of replicas share, and what a single undisturbed replica makes of it.
fn undisturbed(stack: &Stack, client: &Client) -> Result<&'static (String, Vec<(String, String)>)> {
    static DONE: OnceLock<(String, Vec<(String, String)>)> = OnceLock::new();
    if let Some(done) = DONE.get() {
        return Ok(done);
    }
    stack.scale("reconstruction", 1)?;
    let session = upload_session(client, &trials::draw(101, CHUNK_FRAMES * NUM_CHUNKS)?)?;
    let run = start_run(client, &session)?;
    let run = client.wait_until_succeeded(&run, LONGEST_RUN)?;
    ensure!(run.workers("reconstruct-chunk").len() == 1, "one replica, but workers {:?}", run.jobs);
    let files = motion_files(client, &run)?;
    Ok(DONE.get_or_init(|| (session, files)))
}

#[test]
fn a_session_uploaded_through_the_published_port_comes_back_reconstructed() -> Result<()> {
    let Some((_, client)) = stack("a_session_uploaded_through_the_published_port_comes_back_reconstructed")
    else {
        return Ok(());
    };
    let truth = trials::draw(100, 240)?;
    let session = upload_session(client, &truth)?;
    let run = start_run(client, &session)?;
    let run = client.wait_until_succeeded(&run, LONGEST_RUN)?;

    let found = formats::bvh::read(&client.result(&run, "motion.bvh")?, &formats::bvh::Options::default())?;
    ensure!(found.value.num_frames() == truth.num_frames(), "{} frames", found.value.num_frames());
    ensure!(found.value.skeleton().same_structure(truth.skeleton()), "the result has another skeleton");
    let errors = evaluation::compare(&truth, &found.value);
    ensure!(errors.mpjpe_cm < 5.0, "expected joints less than 5 cm away on average: {errors:?}");

    let description: serde_json::Value = serde_json::from_slice(&client.result(&run, "run.json")?)?;
    ensure!(description.to_string().contains("chunk_frames"), "run.json lacks the parameters: {description}");
    Ok(())
}

#[test]
fn three_replicas_share_one_run_and_change_no_bit_of_it() -> Result<()> {
    let Some((stack, client)) = stack("three_replicas_share_one_run_and_change_no_bit_of_it") else {
        return Ok(());
    };
    let (session, expected) = undisturbed(stack, client)?;
    stack.scale("reconstruction", 3)?;
    let run = start_run(client, session)?;
    let run = client.wait_until_succeeded(&run, LONGEST_RUN)?;
    let workers = run.workers("reconstruct-chunk");
    ensure!(workers.len() >= 2, "all chunks went to {workers:?}");
    ensure!(motion_files(client, &run)? == *expected, "the result depends on the number of replicas");
    Ok(())
}

#[test]
fn a_replica_killed_in_the_middle_of_a_run_costs_nothing() -> Result<()> {
    let Some((stack, client)) = stack("a_replica_killed_in_the_middle_of_a_run_costs_nothing") else {
        return Ok(());
    };
    let (session, expected) = undisturbed(stack, client)?;
    stack.scale("reconstruction", 3)?;
    let run = start_run(client, session)?;
    let killed = kill_a_busy_replica(stack, client, &run)?;
    let run = client.wait_until_succeeded(&run, LONGEST_RUN)?;
    let attempts: u64 = run.jobs_of("reconstruct-chunk").map(|job| job.attempts).sum();
    let jobs: u64 = run.jobs_of("reconstruct-chunk").map(|job| job.count).sum();
    ensure!(attempts > jobs, "{killed} was killed, but no chunk was begun again: {:?}", run.jobs);
    ensure!(motion_files(client, &run)? == *expected, "the result depends on the loss of a replica");
    Ok(())
}

/// Kills a replica that has a chunk of the run. It is frozen before it is looked at again, so it can't have
/// finished in between.
fn kill_a_busy_replica(stack: &Stack, client: &Client, run: &Run) -> Result<String> {
    let deadline = Instant::now() + LONGEST_RUN;
    while Instant::now() < deadline {
        let now = client.run(run)?;
        ensure!(!now.is_finished(), "the run was over before a replica could be killed: {now:?}");
        for worker in now.running_workers("reconstruct-chunk") {
            let container = stack::container_of(&worker)?;
            stack.docker(&["pause", &container])?;
            if client.run(run)?.running_workers("reconstruct-chunk").contains(&worker) {
                stack.docker(&["kill", "--signal", "KILL", &container])?;
                return Ok(worker);
            }
            stack.docker(&["unpause", &container])?;
        }
        std::thread::sleep(client::LOOK_EVERY);
    }
    anyhow::bail!("no replica took a chunk")
}

impl Run {
    fn workers(&self, kind: &str) -> BTreeSet<String> {
        self.jobs_of(kind).flat_map(|job| job.workers.iter().cloned()).collect()
    }

    fn running_workers(&self, kind: &str) -> BTreeSet<String> {
        let running = self.jobs_of(kind).filter(|job| job.state == "running");
        running.flat_map(|job| job.workers.iter().cloned()).collect()
    }

    fn jobs_of<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = &'a client::Job> {
        self.jobs.iter().filter(move |job| job.kind == kind)
    }
}
