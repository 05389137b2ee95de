//! What holds for every path: problems, paging, idempotency, the description.

use anyhow::{Context, Result};
use serde_json::json;
use tests::system;

#[test]
fn every_refusal_is_a_problem() -> Result<()> {
    let api = system::shared().project("refusals")?;
    let session = api.session("s", &[])?;
    let json_type = "application/json";
    let cases = [
        (api.get("/v1/nothing")?, 404, "not-found"),
        (api.get("/v1/sessions/not-an-id")?, 404, "not-found"),
        (api.get("/v1/sessions/018f3f4e-0000-7000-8000-000000000000")?, 404, "not-found"),
        (api.get("/v1/motion-databases/none@x")?, 404, "not-found"),
        (api.delete("/v1/me")?, 405, "method-not-allowed"),
        (api.get("/v1/sessions?limit=0")?, 400, "bad-request"),
        (api.get("/v1/sessions?limit=many")?, 400, "bad-request"),
        (api.get("/v1/sessions?cursor=%00")?, 400, "bad-request"),
        (api.get("/v1/sessions?unknown=1")?, 400, "bad-request"),
        (api.post_raw("/v1/sessions", b"{", json_type)?, 400, "bad-request"),
        (api.post_raw("/v1/sessions", b"\xff", json_type)?, 400, "bad-request"),
        (api.post_raw("/v1/sessions", b"{\"name\":\"x\"}", "text/plain")?, 415, "unsupported-media-type"),
        (api.post_raw("/v1/sessions", &vec![b' '; 300 << 10], json_type)?, 413, "too-large"),
        (api.post("/v1/sessions", &json!({}))?, 422, "unprocessable"),
        (api.post("/v1/sessions", &json!({"name": ""}))?, 422, "unprocessable"),
        (api.post("/v1/sessions", &json!({"name": "a\u{0}b"}))?, 422, "unprocessable"),
        (api.post("/v1/sessions", &json!({"name": 3}))?, 422, "unprocessable"),
        (api.post("/v1/sessions", &json!({"name": "x", "colour": "red"}))?, 422, "unprocessable"),
        (api.post("/v1/motion-databases", &json!({"name": "a/b"}))?, 422, "unprocessable"),
        (api.post(&format!("{session}/runs"), &json!({"motion_database": "none"}))?, 404, "not-found"),
        (api.put(&format!("{session}/files/notes.txt"), b"x")?, 422, "unprocessable"),
        (api.put(&format!("{session}/files/a%2Fb.csv"), b"x")?, 422, "unprocessable"),
        (api.put(&format!("{session}/files/p.csv?role=skeleton"), b"x")?, 422, "unprocessable"),
        (api.put(&format!("{session}/files/p.csv?role=king"), b"x")?, 400, "bad-request"),
        (api.put(&format!("{session}/files/p.csv"), b"")?, 422, "unprocessable"),
    ];
    for (number, (answer, status, problem)) in cases.iter().enumerate() {
        let text = String::from_utf8_lossy(&answer.body);
        assert_eq!((answer.status, answer.problem().as_str()), (*status, *problem), "case {number}: {text}");
        assert_eq!(answer.json()["status"], *status, "case {number}");
        assert!(answer.json()["detail"].as_str().is_some_and(|d| !d.is_empty()), "case {number}");
    }
    Ok(())
}

#[test]
fn parameters_that_make_no_sense_are_refused_by_name() -> Result<()> {
    let api = crate::with_database();
    let session = api.session("s", &[("points.csv", b"time,a_x,a_y,a_z\n0,0,0,0\n")])?;
    for (request, named) in [
        (json!({"motion_database": "walks", "neighbours": 0}), "neighbours is 0"),
        (json!({"motion_database": "walks", "method": "guess"}), "guess"),
        (json!({"motion_database": "walks", "parameters": {"windw": 3}}), "windw"),
        (json!({"motion_database": "walks", "window": 3, "parameters": {"window": 3}}), "window"),
        (json!({"motion_database": "walks", "window": -1}), "-1"),
    ] {
        let answer = api.post(&format!("{session}/runs"), &request)?;
        let detail = answer.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert_eq!(answer.status, 422, "{request}: {detail}");
        assert!(detail.contains(named), "{request}: {detail}");
    }
    Ok(())
}

#[test]
fn a_query_parameter_that_a_path_does_not_have_is_refused_by_name() -> Result<()> {
    let system = tests::System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    for (answer, expected) in [
        (api.get("/v1/sessions?colour=red&limit=1")?, "\"colour\" is not known; there are: "),
        (
            api.get(&format!("{session}?limit=1"))?,
            "\"limit\" is not known; there are no query parameters here",
        ),
        (api.post("/v1/sessions?name=b", &json!({"name": "a"}))?, "\"name\" is not known; "),
        (
            api.put(&format!("{session}/files/points.csv?rôle=control-points"), b"x")?,
            "\"rôle\" is not known; ",
        ),
        (api.delete(&format!("{session}?force"))?, "\"force\" is not known; "),
    ] {
        let detail = answer.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert_eq!(answer.status, 400, "{expected}: {detail}");
        assert!(detail.starts_with(expected), "{detail}");
    }
    assert_eq!(api.get(&session)?.status, 200, "nothing was deleted");
    assert_eq!(api.get("/healthz?from=probe")?.status, 200, "probes may ask as they like");
    Ok(())
}

#[test]
fn an_empty_tag_is_called_a_tag() -> Result<()> {
    let system = tests::System::start()?;
    let api = system.project("p")?;
    let refused = api.post("/v1/sessions", &json!({"name": "a", "tags": ["x", ""]}))?;
    assert_eq!(refused.status, 422);
    let detail = refused.json()["detail"].clone();
    assert_eq!(detail, "tags[1] has 0 characters, expected 1 to 200");
    Ok(())
}

#[test]
fn lists_are_paged_newest_first_without_gap_or_repetition() -> Result<()> {
    let api = system::shared().project("pages")?;
    let names: Vec<String> = (0..7).map(|n| format!("session {n}")).collect();
    for name in &names {
        api.make("/v1/sessions", &json!({ "name": name }))?;
    }
    let mut seen = Vec::new();
    let mut path = "/v1/sessions?limit=3".to_owned();
    loop {
        let page = api.get(&path)?.json();
        let items = page["items"].as_array().context("no items")?.clone();
        seen.extend(items.iter().map(|item| item["name"].as_str().unwrap_or_default().to_owned()));
        match page["next"].as_str() {
            Some(cursor) => {
                assert_eq!(items.len(), 3);
                path = format!("/v1/sessions?limit=3&cursor={cursor}");
            }
            None => break,
        }
    }
    seen.reverse();
    assert_eq!(seen, names);
    Ok(())
}

#[test]
fn a_post_sent_again_with_its_key_is_answered_again_and_not_done_again() -> Result<()> {
    let api = system::shared().project("again")?;
    let body = json!({"name": "once"});
    let key = [("idempotency-key", "k-1")];
    let first = api.post_with("/v1/sessions", &body, &key)?;
    let second = api.post_with("/v1/sessions", &body, &key)?;
    assert_eq!((first.status, second.status), (201, 201));
    assert_eq!(first.json(), second.json());
    assert_eq!(first.header("location"), second.header("location"));
    assert_eq!(second.header("idempotency-replayed"), "true");
    let reused = api.post_with("/v1/sessions", &json!({"name": "other"}), &key)?;
    assert_eq!((reused.status, reused.problem().as_str()), (422, "idempotency-key-reused"));
    assert_eq!(api.get("/v1/sessions")?.json()["items"].as_array().map(Vec::len), Some(1));

    // a failure is not kept: the same key may succeed later
    let key = [("idempotency-key", "k-2")];
    let session = first.header("location").to_owned();
    let runs = format!("{session}/runs");
    assert_eq!(api.post_with(&runs, &json!({"motion_database": "none"}), &key)?.status, 404);
    assert_eq!(api.post_with(&runs, &json!({"motion_database": "none"}), &key)?.status, 404);
    Ok(())
}

#[test]
fn twenty_posts_at_once_with_one_key_make_one_session() -> Result<()> {
    let api = system::shared().project("at-once")?;
    let ids: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..20)
            .map(|_| {
                scope.spawn(|| {
                    let answer =
                        api.post_with("/v1/sessions", &json!({"name": "one"}), &[("idempotency-key", "k")])?;
                    anyhow::Ok(answer.json()["id"].as_str().unwrap_or_default().to_owned())
                })
            })
            .collect();
        threads.into_iter().map(|t| t.join().expect("no panic")).collect::<Result<_>>()
    })?;
    assert!(ids.iter().all(|id| *id == ids[0] && !id.is_empty()), "{ids:?}");
    assert_eq!(api.get("/v1/sessions")?.json()["items"].as_array().map(Vec::len), Some(1));
    Ok(())
}

#[test]
fn the_description_is_openapi_3_1_and_lists_every_route() -> Result<()> {
    let stranger = system::shared().stranger();
    let api = stranger.get("/openapi.json")?.json();
    assert_eq!(api["openapi"], "3.1.0");
    let mut found: Vec<String> = Vec::new();
    for (path, item) in api["paths"].as_object().context("no paths")? {
        for (method, operation) in item.as_object().context("no item")? {
            found.push(format!("{} {path}", method.to_uppercase()));
            let responses = operation["responses"].as_object().context("no responses")?;
            // 101: it becomes a WebSocket
            let is_success = |status: &String| status.starts_with('2') || status == "101";
            assert!(responses.keys().any(is_success), "{method} {path} never succeeds");
            assert!(responses.contains_key("default"), "{method} {path} has no problem");
            assert!(operation["summary"].is_string(), "{method} {path} has no summary");
            for name in path.split('{').skip(1).filter_map(|part| part.split('}').next()) {
                let parameters = operation["parameters"].as_array().context("no parameters")?;
                assert!(parameters.iter().any(|p| p["name"] == name), "{method} {path} lacks {name}");
            }
        }
    }
    found.sort();
    let expected = [
        "DELETE /v1/body-models/{body_model}",
        "DELETE /v1/body-models/{body_model}/files/{name}",
        "DELETE /v1/motion-databases/{motion_database}",
        "DELETE /v1/motion-databases/{motion_database}/files/{name}",
        "DELETE /v1/sessions/{session_id}",
        "DELETE /v1/sessions/{session_id}/files/{name}",
        "GET /healthz",
        "GET /metrics",
        "GET /readyz",
        "GET /v1/body-models",
        "GET /v1/body-models/{body_model}",
        "GET /v1/body-models/{body_model}/body.glb",
        "GET /v1/body-models/{body_model}/files",
        "GET /v1/body-models/{body_model}/model",
        "GET /v1/live",
        "GET /v1/me",
        "GET /v1/motion-databases",
        "GET /v1/motion-databases/{motion_database}",
        "GET /v1/motion-databases/{motion_database}/clips",
        "GET /v1/motion-databases/{motion_database}/files",
        "GET /v1/runs",
        "GET /v1/runs/{run_id}",
        "GET /v1/runs/{run_id}/events",
        "GET /v1/runs/{run_id}/results",
        "GET /v1/runs/{run_id}/results/{name}",
        "GET /v1/sessions",
        "GET /v1/sessions/{session_id}",
        "GET /v1/sessions/{session_id}/files",
        "GET /v1/sessions/{session_id}/files/{name}",
        "GET /v1/sessions/{session_id}/runs",
        "POST /v1/body-models",
        "POST /v1/body-models/{body_model}/build",
        "POST /v1/motion-databases",
        "POST /v1/motion-databases/{motion_database}/build",
        "POST /v1/motion-databases/{motion_database}/train",
        "POST /v1/runs/{run_id}/cancel",
        "POST /v1/sessions",
        "POST /v1/sessions/{session_id}/runs",
        "PUT /v1/body-models/{body_model}/files/{name}",
        "PUT /v1/motion-databases/{motion_database}/files/{name}",
        "PUT /v1/sessions/{session_id}/files/{name}",
    ];
    assert_eq!(found, expected);
    // every reference leads somewhere
    let text = api.to_string();
    for reference in text.split("\"$ref\":\"#").skip(1).filter_map(|rest| rest.split('"').next()) {
        assert!(api.pointer(reference).is_some(), "{reference} leads nowhere");
    }
    Ok(())
}

#[test]
fn the_api_page_needs_nothing_from_elsewhere() -> Result<()> {
    let stranger = system::shared().stranger();
    let page = stranger.get("/docs/")?;
    assert_eq!(page.status, 200);
    let html = String::from_utf8(page.body)?;
    assert!(html.contains("swagger-ui"), "{html}");
    // the address alone leads there
    assert_eq!(stranger.get("/")?.status, 200);
    for attribute in ["src=\"http", "href=\"http", "src=\"//", "href=\"//"] {
        assert!(!html.contains(attribute), "{html}");
    }
    assert_eq!(stranger.get("/docs/swagger-ui-bundle.js")?.status, 200);
    Ok(())
}

#[test]
fn metrics_count_requests_and_jobs() -> Result<()> {
    let api = crate::with_database();
    api.get("/v1/me")?;
    let text = String::from_utf8(api.get("/metrics")?.body)?;
    for line in [
        "marey_http_requests_total{method=\"GET\",route=\"/v1/me\",status=\"200\"} ",
        "marey_runs{kind=\"motion-database\",state=\"succeeded\"} ",
        "# TYPE marey_jobs gauge",
    ] {
        assert!(text.contains(line), "no {line:?} in\n{text}");
    }
    Ok(())
}
