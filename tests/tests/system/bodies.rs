//! Body models: shipped, learned, refused.

use anyhow::{Context, Result, ensure};
use body::BodyModel;
use serde_json::json;
use tests::{Api, System};

use crate::cameras::tar;

/// Scans made of the shipped model: as many bodies, all different.
pub(crate) fn scans(count: usize) -> Vec<(String, Vec<u8>)> {
    let model = BodyModel::shipped();
    let scan = |index: usize| {
        // numbers that are spread and the same every time
        let alpha: Vec<f64> = (0..8).map(|i| ((index * 37 + i * 61) % 23) as f64 / 7.6 - 1.5).collect();
        (format!("scans/s{index:02}.ply"), formats::ply::write(&model.shape(&alpha).mesh(&model)))
    };
    (0..count).map(scan).collect()
}

/// Builds a model: its path, that of the run, and how the run ended.
pub(crate) fn build(
    api: &Api,
    name: &str,
    files: &[(String, Vec<u8>)],
) -> Result<(String, String, serde_json::Value)> {
    let model = api.make("/v1/body-models", &json!({ "name": name }))?;
    let path = format!("/v1/body-models/{}", model["id"].as_str().context("no id")?);
    let files: Vec<(&str, &[u8])> =
        files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    api.upload(&format!("{path}/files/scans.tar"), &tar(&files)?)?;
    let run = api.make(&format!("{path}/build"), &json!({ "components": 6 }))?;
    let run = format!("/v1/runs/{}", run["id"].as_str().context("no id")?);
    let end = api.wait(&run)?;
    Ok((path, run, end))
}

#[test]
fn the_shipped_model_is_always_there() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let list = api.get("/v1/body-models")?.json();
    assert_eq!(list["items"][0]["name"], "shipped");
    assert_eq!(list["items"][0]["state"], "ready");
    let model = api.get("/v1/body-models/shipped/model")?;
    assert_eq!(BodyModel::from_bytes(&model.body)?.num_vertices() as i64, list["items"][0]["num_vertices"]);
    let glb = api.get("/v1/body-models/shipped/body.glb?stature_m=1.8&mass_kg=75")?;
    assert!(glb.body.starts_with(b"glTF"), "{}", glb.status);
    assert_eq!(api.get("/v1/body-models/shipped/body.glb?stature_m=3")?.status, 422);
    assert_eq!(api.delete("/v1/body-models/shipped")?.status, 409);
    assert_eq!(api.post("/v1/body-models", &json!({"name": "shipped"}))?.status, 422);
    assert_eq!(
        api.get("/v1/body-models?limit=1&cursor=00000000000000000000000000000000")?.json()["items"],
        json!([])
    );
    Ok(())
}

#[test]
fn a_model_is_learned_from_scans_and_then_never_changes() -> Result<()> {
    let system = System::with_shape_init(1)?;
    let api = system.project("p")?;
    let (path, _, end) = build(&api, "people", &scans(8))?;
    ensure!(end["state"] == "succeeded", "{end}");
    let shown = api.get("/v1/body-models/people")?.json();
    assert_eq!(
        (&shown["state"], &shown["num_components"], &shown["version"]),
        (&json!("ready"), &json!(6), &json!(1))
    );
    assert_eq!(shown["contents"]["num_scans"], 8);
    let model = BodyModel::from_bytes(&api.get(&format!("{path}/model"))?.body)?;
    assert_eq!(model.num_vertices(), BodyModel::shipped().num_vertices());
    assert!(api.get(&format!("{path}/body.glb"))?.body.starts_with(b"glTF"));
    assert_eq!(api.put(&format!("{path}/files/more.ply"), b"ply\n")?.status, 409);
    assert_eq!(api.post(&format!("{path}/build"), &json!({}))?.status, 409);
    // another project has none of it
    assert_eq!(system.project("q")?.get(&path)?.status, 404);
    let objects = system.num_objects();
    assert_eq!(api.delete("/v1/body-models/people@1")?.status, 204);
    assert_eq!(api.get(&path)?.status, 404);
    assert!(system.num_objects() < objects);
    Ok(())
}

#[test]
fn a_bad_scan_is_refused_with_its_file() -> Result<()> {
    let system = System::with_shape_init(1)?;
    let api = system.project("p")?;
    let mut files = scans(4);
    let mut mesh = formats::ply::read(&files[2].1)?.value;
    mesh.vertices.iter_mut().for_each(|vertex| vertex.x = -vertex.x);
    files[2].1 = formats::ply::write(&mesh);
    let (path, _, end) = build(&api, "people", &files)?;
    assert_eq!(end["state"], "failed");
    let error = end["error"].as_str().unwrap_or_default();
    assert!(error.contains("s02.ply") && error.contains("mirrored"), "{error}");
    // it collects files again
    assert_eq!(api.get(&path)?.json()["state"], "failed");
    assert_eq!(api.delete(&format!("{path}/files/scans.tar"))?.status, 204);
    Ok(())
}
