//! Motion databases over their life: versions, what is in them, who uses them, their end.

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use tests::{Api, system, trials};

/// Uploads trials to a database that is open, builds it and waits.
fn build(api: &Api, path: &str, seeds: &[u32], request: &Value) -> Result<()> {
    if !seeds.is_empty() {
        api.upload(&format!("{path}/files/1.asf"), trials::skeleton().as_bytes())?;
    }
    for seed in seeds {
        api.upload(&format!("{path}/files/1_{seed:02}.amc"), trials::motion(*seed, 240).as_bytes())?;
    }
    let run = api.make(&format!("{path}/build"), request)?;
    let end = api.wait(&format!("/v1/runs/{}", run["id"].as_str().context("no id")?))?;
    ensure!(end["state"] == "succeeded", "building failed: {end}");
    Ok(())
}

fn clips(api: &Api, which: &str) -> Result<Vec<String>> {
    let clips = api.get(&format!("/v1/motion-databases/{which}/clips"))?.json();
    let names = clips.as_array().context("no list")?.iter().filter_map(|clip| clip["name"].as_str());
    Ok(names.map(str::to_owned).collect())
}

#[test]
fn a_database_is_added_to_and_every_version_says_what_is_in_it() -> Result<()> {
    let api = system::shared().project("versions")?;
    let first = api.make("/v1/motion-databases", &json!({"name": "walks"}))?;
    assert_eq!(first["base"], Value::Null);
    let index = b"file,subject,action\n1_01.amc,1,walk\n1_02.amc,1,run\n";
    let mut tar = tar::Builder::new(Vec::new());
    let mut header = tar::Header::new_gnu();
    header.set_size(index.len() as u64);
    tar.append_data(&mut header, "index.csv", &index[..])?;
    for (name, content) in [
        ("1.asf".to_owned(), trials::skeleton()),
        ("1_01.amc".to_owned(), trials::motion(1, 240)),
        ("1_02.amc".to_owned(), trials::motion(2, 240)),
    ] {
        let mut header = tar::Header::new_gnu();
        header.set_size(content.len() as u64);
        tar.append_data(&mut header, name, content.as_bytes())?;
    }
    api.upload("/v1/motion-databases/walks/files/walks.tar", &tar.into_inner()?)?;
    let augment = json!({"mirror": true, "warps": [0.8, 1.25]});
    build(&api, "/v1/motion-databases/walks", &[], &json!({ "augment": augment }))?;

    let shown = api.get("/v1/motion-databases/walks")?.json();
    assert_eq!(
        (&shown["state"], &shown["num_clips"], &shown["num_shards"]),
        (&json!("ready"), &json!(12), &json!(1))
    );
    assert_eq!(shown["contents"]["augment"], augment);
    let actions = shown["contents"]["actions"].as_array().context("no actions")?;
    assert_eq!(actions.iter().map(|a| a["name"].as_str()).collect::<Vec<_>>(), [Some("run"), Some("walk")]);
    assert!(actions.iter().all(|a| a["num_clips"] == 6), "{actions:?}");
    let poses: u64 = actions.iter().filter_map(|a| a["num_poses"].as_u64()).sum();
    assert_eq!(shown["num_poses"], poses);
    assert_eq!(shown["contents"]["subjects"][0]["name"], "1");
    assert!(shown["build_seconds"].as_f64().is_some_and(|s| s > 0.0), "{shown}");
    assert!(clips(&api, "walks")?.contains(&"1_02~mirror~x0.8".to_owned()));

    // More, without a trial and all that was made from it, augmented as before.
    let second =
        api.make("/v1/motion-databases", &json!({"name": "walks", "base": "walks", "without": ["1_01"]}))?;
    assert_eq!(
        (&second["version"], &second["base"], &second["state"]),
        (&json!(2), &json!("walks@1"), &json!("open"))
    );
    let refused = api.post("/v1/motion-databases/walks@2/build", &json!({"augment": {"mirror": true}}))?;
    assert_eq!(refused.status, 422, "{}", refused.json());
    build(&api, "/v1/motion-databases/walks@2", &[3], &json!({}))?;
    let names = clips(&api, "walks@2")?;
    assert_eq!(names.len(), 12, "{names:?}");
    assert!(names.iter().all(|name| !name.starts_with("1_01")), "{names:?}");
    assert!(names.contains(&"1_03~mirror".to_owned()), "{names:?}");
    assert_eq!(clips(&api, "walks@1")?.len(), 12, "the version before stays as it was");
    let listed = api.get("/v1/motion-databases")?.json();
    let versions: Vec<_> =
        listed["items"].as_array().context("no items")?.iter().map(|d| &d["version"]).collect();
    assert_eq!(versions, [2, 1]);

    // The first can go; the second is whole without it.
    assert_eq!(api.delete("/v1/motion-databases/walks@1")?.status, 204);
    assert_eq!(api.get("/v1/motion-databases/walks@1")?.status, 404);
    let left = api.get("/v1/motion-databases/walks")?.json();
    assert_eq!((&left["version"], &left["base"]), (&json!(2), &Value::Null));
    let session = crate::session(&api, 9, 240)?;
    let run = api.start_run(&session, &json!({"motion_database": "walks"}))?;
    assert_eq!(api.wait(&run)?["state"], "succeeded");
    Ok(())
}

#[test]
fn a_divided_database_serves_runs_as_an_undivided_one_does() -> Result<()> {
    let api = system::shared().project("shards")?;
    for (name, shards) in [("whole", 1), ("divided", 3)] {
        api.make("/v1/motion-databases", &json!({ "name": name }))?;
        build(&api, &format!("/v1/motion-databases/{name}"), &[1, 2, 3, 4], &json!({ "shards": shards }))?;
    }
    assert_eq!(api.get("/v1/motion-databases/divided")?.json()["num_shards"], 3);
    let session = crate::session(&api, 9, 240)?;
    let motion = |database: &str| -> Result<Vec<u8>> {
        let run = api.start_run(&session, &json!({"motion_database": database}))?;
        let end = api.wait(&run)?;
        ensure!(end["state"] == "succeeded", "{end}");
        Ok(api.get(&format!("{run}/results/motion.bvh"))?.body)
    };
    assert!(motion("whole")? == motion("divided")?, "the motions differ");
    Ok(())
}

#[test]
fn a_database_in_use_is_not_deleted_and_its_users_are_named() -> Result<()> {
    let (_system, api) = crate::own_system(0)?;
    let session = crate::session(&api, 5, 240)?;
    let run = api.start_run(&session, &json!({"motion_database": "walks"}))?;
    let refused = api.delete("/v1/motion-databases/walks@1")?;
    let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
    assert_eq!(refused.status, 409, "{detail}");
    let id = run.rsplit('/').next().context("no id")?;
    assert!(detail.contains(id) && detail.contains("a walk"), "{detail}");
    let shown = api.get("/v1/motion-databases/walks")?.json();
    assert_eq!(shown["used_by"][0]["run_id"], id);
    assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled");

    // A version that is to be made from it needs it too, until it is built or deleted.
    api.make("/v1/motion-databases", &json!({"name": "more", "base": "walks@1"}))?;
    let refused = api.delete("/v1/motion-databases/walks@1")?;
    let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
    assert_eq!(refused.status, 409, "{detail}");
    assert!(detail.contains("more@1"), "{detail}");
    assert_eq!(api.delete("/v1/motion-databases/more@1")?.status, 204);
    assert_eq!(api.delete("/v1/motion-databases/walks@1")?.status, 204);
    Ok(())
}

#[test]
fn a_database_that_is_not_ready_is_there_and_says_how_far_it_is() -> Result<()> {
    let system = tests::System::start()?;
    let api = system.project("early")?;
    let session = crate::session(&api, 5, 240)?;
    api.make("/v1/motion-databases", &json!({"name": "walks"}))?;
    let refusal = |request: Value| -> Result<(u16, String)> {
        let answer = api.post(&format!("{session}/runs"), &request)?;
        Ok((answer.status, answer.json()["detail"].as_str().unwrap_or_default().to_owned()))
    };
    for which in ["walks", "walks@1"] {
        let (status, detail) = refusal(json!({ "motion_database": which }))?;
        assert_eq!(status, 409, "{detail}");
        assert!(detail.contains("walks@1 is open"), "{detail}");
    }
    api.upload("/v1/motion-databases/walks/files/1.asf", trials::skeleton().as_bytes())?;
    api.make("/v1/motion-databases/walks/build", &json!({}))?;
    let (status, detail) = refusal(json!({ "motion_database": "walks" }))?;
    assert!(status == 409 && detail.contains("walks@1 is building"), "{status} {detail}");
    let train = api.post("/v1/motion-databases/walks/train", &json!({}))?;
    assert_eq!(train.status, 409, "{}", train.json());
    let based = api.post("/v1/motion-databases", &json!({"name": "x", "base": "walks"}))?;
    assert_eq!(based.status, 409, "{}", based.json());
    assert_eq!(refusal(json!({ "motion_database": "none" }))?.0, 404);
    Ok(())
}

#[test]
fn a_gplvm_is_trained_before_it_is_used() -> Result<()> {
    let api = crate::with_database();
    let session = crate::session(api, 8, 120)?;
    let request = json!({"motion_database": "walks", "method": "gplvm"});
    let refused = api.post(&format!("{session}/runs"), &request)?;
    let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
    assert!(
        refused.status == 409 && detail.contains("marey db train walks@1"),
        "{} {detail}",
        refused.status
    );
    let parameters = json!({"latent_dims": 2, "active": 48, "max_iterations": 20});
    let run =
        api.make("/v1/motion-databases/walks/train", &json!({"method": "gplvm", "parameters": parameters}))?;
    assert_eq!(run["parameters"]["parameters"]["active"], 48);
    let end = api.wait(&format!("/v1/runs/{}", run["id"].as_str().context("no id")?))?;
    assert_eq!(end["state"], "succeeded", "{end}");
    assert_eq!(api.get("/v1/motion-databases/walks")?.json()["models"][0]["method"], "gplvm");
    let end = api.wait(&api.start_run(&session, &request)?)?;
    assert_eq!(end["state"], "succeeded", "{end}");
    Ok(())
}

#[test]
fn requests_that_make_no_sense_are_refused_by_name() -> Result<()> {
    let api = crate::with_database();
    let databases = "/v1/motion-databases";
    for (path, request, status, named) in [
        ("", json!({"name": "x", "without": ["1_01"]}), 422, "base"),
        ("", json!({"name": "x", "base": "none"}), 404, "none"),
        ("", json!({"name": "x", "base": "walks", "without": ["no such"]}), 422, "no such"),
        ("", json!({"name": "x", "base": "walks", "without": "1_01"}), 422, "expected an array"),
        ("", json!({"name": "x", "base": "walks", "without": vec!["1_01"; 10_001]}), 422, "10001"),
        ("/walks/train", json!({"method": "nearest"}), 422, "nearest"),
        ("/walks/train", json!({"parameters": {"active": 1}}), 422, "active"),
        ("/walks/train", json!({"parameters": {"colour": 1}}), 422, "colour"),
        ("/none/train", json!({}), 404, "none"),
        ("/walks/build", json!({}), 409, "ready"),
        ("/walks/build", json!({"shards": 0}), 422, "shards is 0"),
        ("/walks/build", json!({"shards": 65}), 422, "shards is 65"),
        ("/walks/build", json!({"shards": -1}), 422, "-1"),
        ("/walks/build", json!({"augment": {"warps": [1.0]}}), 422, "warps"),
        ("/walks/build", json!({"augment": {"warps": [0.8, 0.8]}}), 422, "0.8 twice"),
        ("/walks/build", json!({"augment": {"warps": vec![0.5; 9]}}), 422, "9 speeds"),
        ("/walks/build", json!({"augment": {"shrink": true}}), 422, "shrink"),
        ("/walks/build", json!({"bvh_metres_per_unit": 0.0}), 422, "bvh_metres_per_unit"),
    ] {
        let answer = api.post(&format!("{databases}{path}"), &request)?;
        let detail = answer.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert_eq!(answer.status, status, "{path} {request}: {detail}");
        assert!(detail.contains(named), "{path} {request}: {detail}");
    }
    assert_eq!(api.get("/v1/motion-databases/none/clips")?.status, 404);
    Ok(())
}

#[test]
fn a_worker_killed_in_the_middle_of_a_build_costs_nothing_but_time() -> Result<()> {
    let system = tests::System::start()?;
    system.set_staleness(std::time::Duration::from_secs(1))?;
    let api = system.project("builds")?;
    let spawn = |name: &str| system.spawn(crate::faults::MAREY, "motion-index", name);
    let start = |version: u32| -> Result<String> {
        api.make("/v1/motion-databases", &json!({"name": "walks"}))?;
        let path = format!("/v1/motion-databases/walks@{version}");
        api.upload(&format!("{path}/files/1.asf"), trials::skeleton().as_bytes())?;
        for seed in 1..=100 {
            api.upload(&format!("{path}/files/1_{seed:03}.amc"), trials::motion(seed, 120).as_bytes())?;
        }
        let run = api.make(&format!("{path}/build"), &json!({"augment": {"mirror": true}}))?;
        Ok(format!("/v1/runs/{}", run["id"].as_str().context("no id")?))
    };
    let mut victim = spawn("victim")?;
    let end = api.wait(&start(1)?)?;
    ensure!(end["state"] == "succeeded", "{end}");
    let expected = api.get("/v1/motion-databases/walks@1")?.json()["blake3"].clone();
    // Killed between two jobs nothing is lost: then it is tried again.
    for version in 2..8 {
        let run = start(version)?;
        let event = api.wait_until(&run, |event| event["progress"].as_f64() > Some(0.2))?;
        victim.kill()?;
        victim = spawn("successor")?;
        let end = if event["state"] == "succeeded" { event } else { api.wait(&run)? };
        assert_eq!(end["state"], "succeeded", "{end}");
        let found = api.get(&format!("/v1/motion-databases/walks@{version}"))?.json();
        assert_eq!(found["blake3"], expected, "another index");
        let run = api.get(&run)?.json();
        let jobs = run["jobs"].as_array().context("no jobs")?;
        let sum = |field: &str| jobs.iter().filter_map(|job| job[field].as_u64()).sum::<u64>();
        if sum("attempts") > sum("count") {
            return Ok(());
        }
    }
    anyhow::bail!("no job was ever interrupted")
}
