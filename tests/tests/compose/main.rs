//! The compose stack as its users meet it: through the published port, with replicas added and killed.
//!
//! `make test-compose` brings the stack up and runs these tests one after the other; without a stack they are skipped.

mod stack;

use std::{
    collections::BTreeSet,
    sync::OnceLock,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, ensure};
use model::Motion;
use sample_motion::{Action, DrawOptions, Model};
use serde_json::{Value, json};
use stack::Stack;
use tests::{Api, api::LONGEST_RUN};

const POINTS: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
/// Chunks of this many frames, so that one run has work for several replicas.
const CHUNK_FRAMES: usize = 300;
const NUM_CHUNKS: usize = 16;
/// Between two looks at the jobs of a run.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// After this, what a container sent before it was frozen has been done: that takes milliseconds.
const SETTLE: Duration = Duration::from_millis(500);

/// A result's name and content.
type Files = Vec<(String, Vec<u8>)>;

/// The stack with a motion database in it; `None` where there is no stack.
fn stack(test: &str) -> Option<&'static (Stack, Api)> {
    static READY: OnceLock<Option<(Stack, Api)>> = OnceLock::new();
    let ready = READY.get_or_init(|| {
        let (stack, api) = Stack::from_environment()?;
        build_motion_database(&api).expect("a motion database is built");
        Some((stack, api))
    });
    if ready.is_none() {
        println!("skipped: {test}: no compose stack");
    }
    ready.as_ref()
}

/// A drawn walk as its file says it.
fn walk(seed: u64, frames: usize) -> Result<Motion> {
    let drawn = Model::bundled().draw(Action::Walk, seed, &DrawOptions { frames, subject: 1 })?;
    let file = formats::bvh::write(&drawn);
    Ok(formats::bvh::read(file.as_bytes(), &formats::bvh::Options::default())?.value)
}

fn build_motion_database(api: &Api) -> Result<()> {
    api.make("/v1/motion-databases", &json!({"name": "walks"}))?;
    for seed in 1..=8 {
        let path = format!("/v1/motion-databases/walks/files/walk-{seed}.bvh");
        api.upload(&path, formats::bvh::write(&walk(seed, 600)?).as_bytes())?;
    }
    let run = api.make("/v1/motion-databases/walks/build", &json!({}))?;
    succeed(api, &format!("/v1/runs/{}", run["id"].as_str().context("a run has an id")?))
}

/// A session with the control points of a trial that is not in the database. Returns its path.
fn session_of(api: &Api, truth: &Motion) -> Result<String> {
    let points = formats::points_csv::write(&evaluation::control_trajectories(truth, &POINTS)?);
    api.session("a drawn walk", &[("points.csv", points.as_bytes())])
}

fn start_run(api: &Api, session: &str) -> Result<String> {
    let parameters = json!({"chunk_frames": CHUNK_FRAMES});
    api.start_run(session, &json!({"motion_database": "walks", "points": POINTS, "parameters": parameters}))
}

fn succeed(api: &Api, run: &str) -> Result<()> {
    let end = api.wait(run)?;
    ensure!(end["state"] == "succeeded", "{run} ended as {end}");
    Ok(())
}

/// The session that the tests of replicas share, and what a single undisturbed replica makes of it.
fn undisturbed(stack: &Stack, api: &Api) -> Result<&'static (String, Files)> {
    static DONE: OnceLock<(String, Files)> = OnceLock::new();
    if let Some(done) = DONE.get() {
        return Ok(done);
    }
    stack.scale("reconstruction", 1)?;
    let session = session_of(api, &walk(101, CHUNK_FRAMES * NUM_CHUNKS)?)?;
    let run = start_run(api, &session)?;
    succeed(api, &run)?;
    let chunks = Chunks::from_run(api, &run)?;
    ensure!(chunks.count == NUM_CHUNKS as u64 && chunks.workers.len() == 1, "one replica, but {chunks:?}");
    let files = api.motion_files(&run)?;
    ensure!(!files.is_empty(), "{run} has no results");
    Ok(DONE.get_or_init(|| (session, files)))
}

/// Fails with the names of the results that differ.
fn ensure_same(found: &Files, expected: &Files) -> Result<()> {
    let names = |files: &Files| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    ensure!(names(found) == names(expected), "results {:?}, expected {:?}", names(found), names(expected));
    let differing: Vec<_> = found.iter().zip(expected).filter(|(f, e)| f != e).map(|(f, _)| &f.0).collect();
    ensure!(differing.is_empty(), "{differing:?} differ from those of an undisturbed run");
    Ok(())
}

#[test]
fn a_session_uploaded_through_the_published_port_comes_back_reconstructed() -> Result<()> {
    let Some((_, api)) = stack("a_session_uploaded_through_the_published_port_comes_back_reconstructed")
    else {
        return Ok(());
    };
    let truth = walk(100, 240)?;
    let run = start_run(api, &session_of(api, &truth)?)?;
    succeed(api, &run)?;

    let bvh = api.get(&format!("{run}/results/motion.bvh"))?;
    let found = formats::bvh::read(&bvh.body, &formats::bvh::Options::default())?.value;
    ensure!(found.num_frames() == truth.num_frames(), "{} frames came back", found.num_frames());
    ensure!(found.skeleton().num_joints() == truth.skeleton().num_joints(), "another skeleton came back");
    let errors = evaluation::compare(&truth, &found);
    ensure!(errors.mpjpe_cm < 5.0, "expected joints less than 5 cm away on average: {errors:?}");

    let description = api.get(&format!("{run}/results/run.json"))?.json();
    ensure!(description.to_string().contains("chunk_frames"), "no parameters in run.json: {description}");
    Ok(())
}

#[test]
fn three_replicas_share_one_run_and_change_no_bit_of_it() -> Result<()> {
    let Some((stack, api)) = stack("three_replicas_share_one_run_and_change_no_bit_of_it") else {
        return Ok(());
    };
    let (session, expected) = undisturbed(stack, api)?;
    stack.scale("reconstruction", 3)?;
    let run = start_run(api, session)?;
    succeed(api, &run)?;
    let chunks = Chunks::from_run(api, &run)?;
    ensure!(chunks.workers.len() >= 2, "one replica did everything: {chunks:?}");
    ensure_same(&api.motion_files(&run)?, expected)
}

#[test]
fn a_replica_killed_in_the_middle_of_a_run_costs_nothing() -> Result<()> {
    let Some((stack, api)) = stack("a_replica_killed_in_the_middle_of_a_run_costs_nothing") else {
        return Ok(());
    };
    let (session, expected) = undisturbed(stack, api)?;
    stack.scale("reconstruction", 3)?;
    let run = start_run(api, session)?;
    let killed = kill_a_busy_replica(stack, api, &run)?;
    succeed(api, &run)?;
    let chunks = Chunks::from_run(api, &run)?;
    ensure!(chunks.attempts > chunks.count, "{killed} was killed, but no chunk begun again: {chunks:?}");
    ensure_same(&api.motion_files(&run)?, expected)
}

/// Kills a replica that has a chunk of the run. It is frozen before it is looked at again, so it can't have
/// finished in between.
fn kill_a_busy_replica(stack: &Stack, api: &Api, run: &str) -> Result<String> {
    let begin = Instant::now();
    while begin.elapsed() < LONGEST_RUN {
        for worker in Chunks::from_run(api, run)?.running_on {
            let container = stack::container_of(&worker)?;
            stack.docker(&["pause", &container])?;
            // It may have sent the chunk's end to PostgreSQL before that: such a chunk isn't begun again.
            std::thread::sleep(SETTLE);
            if Chunks::from_run(api, run)?.running_on.contains(&worker) {
                stack.docker(&["kill", "--signal", "KILL", &container])?;
                return Ok(worker);
            }
            stack.docker(&["unpause", &container])?;
        }
        std::thread::sleep(LOOK_EVERY);
    }
    anyhow::bail!("no replica took a chunk of {run} within {LONGEST_RUN:?}")
}

/// The chunks of a run.
#[derive(Debug, Default)]
struct Chunks {
    count: u64,
    attempts: u64,
    /// workers that had one last
    workers: BTreeSet<String>,
    /// those of them that are at it
    running_on: BTreeSet<String>,
}

impl Chunks {
    fn from_run(api: &Api, run: &str) -> Result<Self> {
        let shown = api.get(run)?.json();
        let jobs = shown["jobs"].as_array().with_context(|| format!("no jobs in {shown}"))?;
        let mut chunks = Self::default();
        for job in jobs.iter().filter(|job| job["kind"] == "reconstruct-chunk") {
            let workers = job["workers"].as_array().into_iter().flatten();
            let workers: BTreeSet<String> = workers.filter_map(Value::as_str).map(str::to_owned).collect();
            chunks.count += job["count"].as_u64().context("no count")?;
            chunks.attempts += job["attempts"].as_u64().context("no attempts")?;
            if job["state"] == "running" {
                chunks.running_on.extend(workers.clone());
            }
            chunks.workers.extend(workers);
        }
        Ok(chunks)
    }
}
