//! What runs on sessions are asked for by: one request a kind.

use anyhow::{Context, Result};
use serde_json::{Value, json};
use tests::{Api, System};

const POINTS: (&str, &[u8]) = ("points.csv", b"time,a_x,a_y,a_z\n0,0,0,0\n");
const CALIBRATION: (&str, &[u8]) = ("calibration.json", b"{}");
const MASKS: (&str, &[u8]) = ("silhouettes.tar", b"x");

/// A project with a session that has something for every kind of run.
fn session_with_all() -> Result<(System, Api, String)> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[POINTS, CALIBRATION, MASKS])?;
    Ok((system, api, session))
}

/// Posts a request for a run; status and, of a refusal, its words, of a run, its kind.
fn ask(api: &Api, session: &str, request: &Value) -> Result<(u16, String)> {
    let answer = api.post(&format!("{session}/runs"), request)?;
    let json = answer.json();
    let word = if answer.status == 202 { &json["kind"] } else { &json["detail"] };
    if let Some(id) = json["id"].as_str() {
        api.make(&format!("/v1/runs/{id}/cancel"), &json!({}))?;
    }
    Ok((answer.status, word.as_str().unwrap_or_default().to_owned()))
}

#[test]
fn a_field_that_no_kind_has_is_refused_by_every_kind() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    for (kind, field) in [
        ("sparse", "motion_database"),
        ("multi-view", "background"),
        ("inverse-kinematics", "inverse_kinematics"),
    ] {
        for value in [json!("red"), Value::Null] {
            let (status, detail) = ask(&api, &session, &json!({"kind": kind, "colour": value}))?;
            assert_eq!(status, 422, "{kind}");
            assert!(
                detail.contains(&format!("colour is not a field of {kind} runs; they have: ")),
                "{detail}"
            );
            assert!(detail.contains(field), "{detail}");
        }
    }
    let (status, detail) = ask(
        &api,
        &session,
        &json!({"kind": "inverse-kinematics", "inverse_kinematics": {"solve": "plain"}}),
    )?;
    assert!(status == 422 && detail.contains("solve"), "{status} {detail}");
    Ok(())
}

#[test]
fn a_field_of_another_kind_is_refused_and_said_where_it_belongs() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    for (kind, field, value, belongs) in [
        ("sparse", "cameras", json!(["cam1"]), "multi-view and inverse-kinematics"),
        ("sparse", "body_model", json!("shipped"), "multi-view and inverse-kinematics"),
        ("sparse", "inverse_kinematics", json!({}), "inverse-kinematics"),
        ("multi-view", "motion_database", json!("walks"), "sparse"),
        ("multi-view", "points", json!(["head", "root"]), "sparse and inverse-kinematics"),
        ("multi-view", "marker_map", json!("x"), "sparse and inverse-kinematics"),
        ("inverse-kinematics", "neighbours", json!(3), "sparse"),
        ("inverse-kinematics", "bvh_metres_per_unit", json!(1.0), "sparse"),
    ] {
        let (status, detail) = ask(&api, &session, &json!({"kind": kind, field: value}))?;
        assert_eq!(status, 422, "{kind} {field}");
        let expected = format!("{field} is not a field of {kind} runs, but of {belongs} runs; they have: ");
        assert!(detail.starts_with(&expected), "{kind} {field}: {detail}");
    }
    // what is null is left out
    let (status, kind) = ask(&api, &session, &json!({"kind": "multi-view", "motion_database": null}))?;
    assert_eq!((status, kind.as_str()), (202, "multi-view"));
    Ok(())
}

#[test]
fn the_kind_follows_from_the_files_when_it_is_left_out() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let none = api.session("none", &[])?;
    let points = api.session("points", &[POINTS])?;
    let cameras = api.session("cameras", &[CALIBRATION, MASKS])?;
    let both = api.session("both", &[POINTS, CALIBRATION, MASKS])?;
    for (session, request, status, expected) in [
        (&none, json!({}), 422, "the session has neither control points nor cameras; upload"),
        (&none, json!({"motion_database": "walks"}), 404, "no motion database \"walks\""),
        (&none, json!({"kind": "multi-view"}), 422, "the session has no calibration"),
        (&none, json!({"kind": "inverse-kinematics"}), 422, "the session has no measured points"),
        (&points, json!({}), 422, "motion_database is missing: name the recordings"),
        (&points, json!({"motion_database": "walks"}), 404, "no motion database \"walks\""),
        (&points, json!({"kind": null, "motion_database": "walks"}), 404, "no motion database \"walks\""),
        (&points, json!({"cameras": ["cam1"]}), 422, "the session has control points, so kind is sparse"),
        (&points, json!({"inverse_kinematics": {}}), 202, "inverse-kinematics"),
        (
            &points,
            json!({"inverse_kinematics": {}, "motion_database": "walks"}),
            422,
            "inverse_kinematics is given",
        ),
        (&cameras, json!({}), 202, "multi-view"),
        (
            &cameras,
            json!({"points": ["head", "root"]}),
            422,
            "the session has a calibration, so kind is multi-view",
        ),
        (&cameras, json!({"inverse_kinematics": {}}), 422, "the session has no measured points"),
        (&both, json!({}), 422, "kind is required: sparse, multi-view or inverse-kinematics"),
        (&both, json!({"motion_database": "walks"}), 422, "kind is required"),
        (&both, json!({"kind": "sparse", "motion_database": "walks"}), 404, "no motion database \"walks\""),
        (&both, json!({"kind": "multi-view"}), 202, "multi-view"),
        (&both, json!({"inverse_kinematics": {}}), 202, "inverse-kinematics"),
        (&both, json!({"kind": "inverse-kinematics"}), 202, "inverse-kinematics"),
        (
            &both,
            json!({"inverse_kinematics": {}, "parameters": {"particles": 9}}),
            422,
            "parameters.particles is not for inverse kinematics, which takes first_frame, num_frames",
        ),
        (
            &both,
            json!({"kind": "multi-view", "parameters": {"particles": 1}}),
            422,
            "parameters.particles is 1, expected",
        ),
        (
            &both,
            json!({"kind": "multi-view", "background": "plate", "parameters": {"background": {"model": "mixture"}}}),
            422,
            "background is given twice",
        ),
        (
            &both,
            json!({"kind": "dance"}),
            422,
            "kind is \"dance\", expected sparse, multi-view or inverse-kinematics",
        ),
        (&both, json!({"kind": 3}), 422, "kind is 3, expected"),
    ] {
        let (found, word) = ask(&api, session, &request)?;
        assert_eq!(found, status, "{request}: {word}");
        assert!(word.contains(expected), "{request}: {word}");
    }
    Ok(())
}

#[test]
fn a_request_is_one_of_its_kinds_and_every_example_is_accepted_as_printed() -> Result<()> {
    let api = crate::with_database();
    let described = api.get("/openapi.json")?.json();
    let content = &described["paths"]["/v1/sessions/{session_id}/runs"]["post"]["requestBody"]["content"]["application/json"];
    let at = |reference: &Value| -> Result<Value> {
        let path = reference["$ref"].as_str().context("no reference")?.trim_start_matches('#');
        described.pointer(path).cloned().with_context(|| format!("{path} leads nowhere"))
    };
    let request = at(&content["schema"])?;
    assert_eq!(request["discriminator"], Value::Null, "kind may be left out");
    let mut kinds = Vec::new();
    for one in request["oneOf"].as_array().context("not one of several")? {
        let schema = at(one)?;
        // one that has to be asked for says so beside its fields
        let object = if schema["allOf"].is_array() { &schema["allOf"][0] } else { &schema };
        assert_eq!(object["additionalProperties"], false, "{schema}");
        // it may be left out, which null stands for
        let [kind, Value::Null] = &object["properties"]["kind"]["enum"].as_array().context("no kind")?[..]
        else {
            anyhow::bail!("not one kind or null: {schema}");
        };
        let example = &content["examples"][kind.as_str().unwrap_or_default()]["value"];
        assert_eq!((&example["kind"], &schema["examples"][0]), (kind, example));
        for field in example.as_object().context("no example")?.keys() {
            assert!(object["properties"][field].is_object(), "{kind} has no {field}");
        }
        kinds.push(kind.clone());
    }
    assert_eq!(kinds, ["sparse", "multi-view", "inverse-kinematics"]);
    let examples = content["examples"].as_object().context("no examples")?;
    assert_eq!(examples.len(), kinds.len());

    let points = crate::points_csv(5, 240)?;
    let filmed = ("GX010042.MP4", &b"x"[..]);
    let session = api.session("s", &[("points.csv", points.as_bytes()), CALIBRATION, MASKS, filmed])?;
    let empty = api.session("empty", &[])?;
    for (kind, example) in examples {
        let (status, word) = ask(api, &session, &example["value"])?;
        assert_eq!(status, 202, "{kind}: {word}");
        let (status, word) = ask(api, &empty, &example["value"])?;
        assert!(status == 422 && word.contains("upload a "), "{kind}: {status} {word}");
    }
    Ok(())
}

#[test]
fn a_value_of_another_type_is_refused_with_the_name_of_its_field() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    let sparse = |field: &str, value: Value| {
        let mut request = json!({"kind": "sparse", "motion_database": "walks"});
        request[field] = value;
        request
    };
    let whole = "expected a whole number of 0 or more";
    for (request, expected) in [
        (sparse("motion_database", json!(5)), "motion_database is 5, expected text".to_owned()),
        (sparse("window", json!(-1)), format!("window is -1, {whole}")),
        (sparse("points", json!("head")), "points is \"head\", expected an array".to_owned()),
        (sparse("points", json!(["head", 5])), "points[1] is 5, expected text".to_owned()),
        (sparse("mapping", json!({"LWRA": 1})), "mapping.LWRA is 1, expected text".to_owned()),
        (sparse("up", json!("w")), "up is \"w\", expected x".to_owned()),
        (
            sparse("parameters", json!({"neighbours": "abc"})),
            format!("parameters.neighbours is \"abc\", {whole}"),
        ),
        (
            json!({"kind": "multi-view", "camera_files": []}),
            "camera_files is an array, expected an object".to_owned(),
        ),
        (
            json!({"kind": "inverse-kinematics", "inverse_kinematics": []}),
            "inverse_kinematics is an array, expected an object".to_owned(),
        ),
        (
            json!({"kind": "inverse-kinematics", "inverse_kinematics": {"steps": "x"}}),
            format!("inverse_kinematics.steps is \"x\", {whole}"),
        ),
    ] {
        let (status, detail) = ask(&api, &session, &request)?;
        assert_eq!(status, 422, "{request}: {detail}");
        assert!(detail.starts_with(&expected), "{request}: {detail}");
    }
    let refused = api.get("/v1/sessions?limit=x")?;
    let detail = refused.json()["detail"].clone();
    assert_eq!((refused.status, detail), (400, json!(format!("limit is \"x\", {whole}"))));
    Ok(())
}

#[test]
fn no_text_of_a_request_has_a_nul_and_no_key_is_given_twice() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    for (request, named) in [
        (json!({"motion_database": "wa\u{0}lks"}), "motion_database has a NUL"),
        (json!({"kind": "multi-view", "body_model": "a\u{0}"}), "body_model has a NUL"),
        (json!({"motion_database": "walks", "points": ["head", "a\u{0}"]}), "points[1] has a NUL"),
        (json!({"motion_database": "walks", "mapping": {"a": "\u{0}"}}), "mapping.a has a NUL"),
        (json!({"motion_database": "walks", "mapping": {"a\u{0}": "head"}}), "mapping.a"),
    ] {
        let (status, detail) = ask(&api, &session, &request)?;
        assert_eq!(status, 422, "{request}: {detail}");
        assert!(detail.starts_with(named), "{request}: {detail}");
    }
    for path in ["/v1/motion-databases/%00", "/v1/body-models/a%00b", &format!("{session}/files/a%00.csv")] {
        for answer in [api.get(path)?, api.delete(path)?] {
            assert_eq!((answer.status, answer.problem().as_str()), (404, "not-found"), "{path}");
        }
    }
    assert_eq!(api.put(&format!("{session}/files/a%00.csv"), b"x")?.status, 422);

    let body = br#"{"kind": "sparse", "motion_database": "a", "motion_database": "b"}"#;
    let twice = api.post_raw(&format!("{session}/runs"), body, "application/json")?;
    let detail = twice.json()["detail"].clone();
    assert_eq!((twice.status, detail), (422, json!("motion_database is given twice, expected once")));
    Ok(())
}

#[test]
fn a_request_without_fields_takes_none() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    let run = api.start_run(&session, &json!({"kind": "multi-view"}))?;
    let cancel = format!("{run}/cancel");
    for (body, status, expected) in [
        (&br#"{"force": true}"#[..], 422, "force is not known; there are none"),
        (b"[]", 422, "the request is an array, expected an object"),
        (b"at once", 400, "body is not JSON"),
    ] {
        let refused = api.post_raw(&cancel, body, "application/json")?;
        let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert_eq!(refused.status, status, "{detail}");
        assert!(detail.starts_with(expected), "{detail}");
    }
    assert_eq!(api.get(&run)?.json()["state"], "queued");
    assert_eq!(api.post_raw(&cancel, b"", "application/json")?.json()["state"], "cancelled");
    assert_eq!(api.post(&cancel, &json!({}))?.status, 200);
    Ok(())
}

#[test]
fn a_file_that_is_not_there_is_missed_where_it_would_be() -> Result<()> {
    let (_system, api, session) = session_with_all()?;
    let run = api.start_run(&session, &json!({"kind": "multi-view"}))?;
    api.make(&format!("{run}/cancel"), &json!({}))?;
    api.make("/v1/motion-databases", &json!({"name": "walks"}))?;
    let file = format!("{session}/files/gone.csv");
    for (answer, expected) in [
        (api.get(&file)?, "there is no file \"gone.csv\" in this session"),
        (api.delete(&file)?, "there is no file \"gone.csv\" in this session"),
        (api.get(&format!("{session}/files/%00"))?, "there is no file \"\\0\" in this session"),
        (api.get(&format!("{run}/results/gone.csv"))?, "there is no result \"gone.csv\" in this run"),
        (
            api.delete("/v1/motion-databases/walks/files/gone.bvh")?,
            "there is no file \"gone.bvh\" in this motion database",
        ),
    ] {
        assert_eq!((answer.status, &answer.json()["detail"]), (404, &json!(expected)));
    }
    Ok(())
}

#[test]
fn an_id_that_is_none_names_nothing() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    for (answer, what) in [
        (api.post("/v1/sessions/abc/runs", &json!({}))?, "session"),
        (api.get("/v1/sessions/abc/files/points.csv")?, "session"),
        (api.get("/v1/runs/abc")?, "run"),
        (api.get("/v1/runs/abc/results/motion.bvh")?, "run"),
    ] {
        let detail = answer.json()["detail"].clone();
        assert_eq!(
            (answer.status, detail),
            (404, json!(format!("there is no {what} \"abc\" in this project")))
        );
    }
    Ok(())
}

#[test]
fn a_body_that_nobody_has_is_refused_before_there_is_a_run() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[POINTS])?;
    for (options, expected) in [
        (json!({"stature_m": 0}), "inverse_kinematics.stature_m is 0 m, expected 1 to 2.4 m"),
        (json!({"stature_m": 178}), "inverse_kinematics.stature_m is 178 m, expected 1 to 2.4 m"),
        (json!({"mass_kg": -70}), "inverse_kinematics.mass_kg is -70 kg, expected 20 to 250 kg"),
        (json!({"age_years": 400}), "inverse_kinematics.age_years is 400 years, expected 0 to 120 years"),
        (
            json!({"alpha": [0, 99]}),
            "inverse_kinematics.alpha[1] is 99, expected -6 to 6 standard deviations",
        ),
        (json!({"stature_m": 1e308}), "inverse_kinematics.stature_m is 1e308 m, expected 1 to 2.4 m"),
        (
            json!({"alpha": [-1e308]}),
            "inverse_kinematics.alpha[0] is -1e308, expected -6 to 6 standard deviations",
        ),
        (
            json!({"frame_rate": 1e308}),
            "inverse_kinematics.frame_rate is 1e308, expected 1 to 1000 frames a second",
        ),
        (json!({"alpha": [0], "mass_kg": 70}), "inverse_kinematics.alpha is given beside measurements"),
        (json!({"alpha": vec![0; 1000]}), "inverse_kinematics.alpha has 1000 numbers, expected at most"),
    ] {
        let request = json!({"kind": "inverse-kinematics", "inverse_kinematics": options});
        let (status, detail) = ask(&api, &session, &request)?;
        assert_eq!(status, 422, "{expected}: {detail}");
        assert!(detail.starts_with(expected), "{expected}: {detail}");
    }
    Ok(())
}
