//! Who may do what.

use anyhow::Result;
use gateway::access::Scope;
use serde_json::json;
use tests::{Api, system};

#[test]
fn without_a_known_key_there_is_nothing_but_health() -> Result<()> {
    let stranger = system::shared().stranger();
    for path in ["/v1/me", "/v1/sessions", "/v1/runs", "/v1/motion-databases"] {
        let answer = stranger.get(path)?;
        assert_eq!((answer.status, answer.problem().as_str()), (401, "unauthorized"), "{path}");
        assert_eq!(answer.header("www-authenticate"), "Bearer");
    }
    let forger =
        Api::new(stranger.url(), "mk_0000000000000000000000000000000000000000000000000000000000000000");
    assert_eq!(forger.get("/v1/me")?.status, 401);
    for path in ["/healthz", "/readyz", "/metrics", "/openapi.json"] {
        assert_eq!(stranger.get(path)?.status, 200, "{path}");
    }
    Ok(())
}

#[test]
fn a_key_is_bound_to_its_project_and_scopes() -> Result<()> {
    let reader = system::shared().caller("scopes", &[Scope::Read])?;
    let me = reader.get("/v1/me")?.json();
    assert_eq!((me["project"].as_str(), &me["scopes"]), (Some("scopes"), &json!(["read"])));
    assert_eq!(reader.get("/v1/sessions")?.status, 200);
    let refused = reader.post("/v1/sessions", &json!({"name": "x"}))?;
    assert_eq!((refused.status, refused.problem().as_str()), (403, "forbidden"));
    let writer = system::shared().caller("scopes", &[Scope::Write])?;
    assert_eq!(writer.get("/v1/sessions")?.status, 403);
    assert_eq!(writer.post("/v1/sessions", &json!({"name": "x"}))?.status, 201);
    Ok(())
}

#[test]
fn what_another_project_has_is_not_there() -> Result<()> {
    let owner = crate::with_database();
    let session = crate::session(owner, 9, 240)?;
    let run = owner.start_run(&session, &json!({"motion_database": "walks"}))?;
    owner.wait(&run)?;
    let other = system::shared().project("other")?;
    let own_session = other.session("mine", &[("points.csv", b"time,a_x,a_y,a_z\n0,0,0,0\n")])?;
    let theirs = [
        session.clone(),
        format!("{session}/files"),
        format!("{session}/files/points.csv"),
        format!("{session}/runs"),
        run.clone(),
        format!("{run}/events"),
        format!("{run}/results"),
        format!("{run}/results/motion.bvh"),
        "/v1/motion-databases/walks".to_owned(),
        "/v1/motion-databases/walks/files".to_owned(),
    ];
    for path in theirs {
        assert_eq!(owner.get(&path)?.status, 200, "{path}");
        let answer = other.get(&path)?;
        assert_eq!((answer.status, answer.problem().as_str()), (404, "not-found"), "{path}");
    }
    for path in
        [session.clone(), format!("{session}/files/points.csv"), "/v1/motion-databases/walks@1".into()]
    {
        assert_eq!(other.delete(&path)?.status, 404, "{path}");
    }
    assert_eq!(other.put(&format!("{session}/files/points.csv"), b"x")?.status, 404);
    assert_eq!(other.post(&format!("{run}/cancel"), &json!({}))?.status, 404);
    assert_eq!(other.post(&format!("{session}/runs"), &json!({"motion_database": "walks"}))?.status, 404);
    assert_eq!(other.post(&format!("{own_session}/runs"), &json!({"motion_database": "walks"}))?.status, 404);
    let listed = other.get("/v1/sessions")?.json();
    assert_eq!(listed["items"].as_array().map(Vec::len), Some(1));
    Ok(())
}
