//! What motion databases and body models have in common: one test of all that is the same, run on both.

use anyhow::{Context, Result};
use serde_json::{Value, json};
use tests::{Api, System};

/// One of the two.
struct Noun {
    name: &'static str,
    path: &'static str,
    /// a file that it is built from, and one that it is not
    files: (&'static str, &'static str),
    /// whether one comes with the program
    is_shipped: bool,
}

const NOUNS: [Noun; 2] = [
    Noun {
        name: "motion database",
        path: "/v1/motion-databases",
        files: ("walks.zip", "points.csv"),
        is_shipped: false,
    },
    Noun { name: "body model", path: "/v1/body-models", files: ("scans.zip", "walks.bvh"), is_shipped: true },
];

fn detail(answer: &tests::Answer) -> String {
    answer.json()["detail"].as_str().unwrap_or_default().to_owned()
}

fn on_both(test: fn(&System, &Api, &Noun) -> Result<()>) -> Result<()> {
    for noun in &NOUNS {
        // a system of its own, as objects are counted
        let system = System::start()?;
        let api = system.project("p")?;
        test(&system, &api, noun).with_context(|| noun.name)?;
    }
    Ok(())
}

#[test]
fn versions_are_counted_and_found_by_id_name_and_version() -> Result<()> {
    on_both(|system, api, noun| {
        let path = noun.path;
        let made = api.post(path, &json!({"name": "a"}))?;
        let first = made.json();
        assert_eq!((made.status, &first["version"], &first["state"]), (201, &json!(1), &json!("open")));
        let id = first["id"].as_str().context("no id")?.to_owned();
        assert_eq!(made.header("location"), format!("{path}/{id}"));
        let key = [("idempotency-key", "k")];
        let second = api.post_with(path, &json!({"name": "a"}), &key)?;
        assert_eq!(second.json()["version"], 2);
        assert_eq!(api.post_with(path, &json!({"name": "a"}), &key)?.json(), second.json());
        for (which, version) in [(id.as_str(), 1), ("a@1", 1), ("a@2", 2), ("a", 2)] {
            assert_eq!(api.get(&format!("{path}/{which}"))?.json()["version"], version, "{which}");
        }
        let other = system.project("other")?;
        for which in [id.as_str(), "a@3", "a@x", "a@", "b", "018f3f4e-0000-7000-8000-000000000000"] {
            let api = if which == id { &other } else { api };
            for at in [format!("{path}/{which}"), format!("{path}/{which}/files")] {
                let missing = api.get(&at)?;
                assert_eq!((missing.status, missing.problem().as_str()), (404, "not-found"), "{at}");
                assert!(detail(&missing).contains(&format!("no {} \"{which}\"", noun.name)), "{at}");
            }
        }
        for name in ["", "a/b", "a@1", "-a", "018f3f4e-0000-7000-8000-000000000000", &"a".repeat(65)] {
            let refused = api.post(path, &json!({ "name": name }))?;
            assert_eq!(refused.status, 422, "{name:?}");
            let said = format!("{name:?} is not a valid {} name", noun.name);
            assert!(detail(&refused).starts_with(&said), "{}", detail(&refused));
        }
        assert_eq!(api.post(path, &json!({"name": "a", "colour": "red"}))?.status, 422);
        Ok(())
    })
}

#[test]
fn versions_are_listed_newest_first() -> Result<()> {
    on_both(|_, api, noun| {
        for name in ["a", "b", "a"] {
            api.make(noun.path, &json!({ "name": name }))?;
        }
        let (mut seen, mut query) = (Vec::new(), "limit=2".to_owned());
        loop {
            let page = api.get(&format!("{}?{query}", noun.path))?.json();
            for item in page["items"].as_array().context("no items")? {
                seen.push(format!("{}@{}", item["name"].as_str().unwrap_or_default(), item["version"]));
            }
            let Some(next) = page["next"].as_str() else { break };
            query = format!("limit=2&cursor={next}");
        }
        let mut expected = vec!["a@2", "b@1", "a@1"];
        expected.extend(noun.is_shipped.then_some("shipped@1"));
        assert_eq!(seen, expected);
        assert_eq!(api.get(&format!("{}?limit=0", noun.path))?.status, 400);
        Ok(())
    })
}

#[test]
fn files_are_fixed_from_the_build_on_until_it_has_failed() -> Result<()> {
    on_both(|system, api, noun| {
        api.make(noun.path, &json!({"name": "a"}))?;
        let path = format!("{}/a", noun.path);
        let (good, bad) = noun.files;
        let file = format!("{path}/files/{good}");
        let empty = api.post(&format!("{path}/build"), &json!({}))?;
        assert_eq!(empty.status, 422);
        assert!(
            detail(&empty).contains(&format!("{} a@1 has no files; upload", noun.name)),
            "{}",
            detail(&empty)
        );
        let refused = api.put(&format!("{path}/files/{bad}"), b"x")?;
        assert_eq!(refused.status, 422);
        assert!(detail(&refused).contains(&format!("a {} is built from", noun.name)), "{}", detail(&refused));
        assert_eq!((api.put(&file, b"x")?.status, api.put(&file, b"not a zip")?.status), (201, 200));
        assert_eq!((api.delete(&file)?.status, api.delete(&file)?.status), (204, 404));
        assert_eq!(api.put(&file, b"not a zip")?.status, 201);
        let files = api.get(&format!("{path}/files"))?.json();
        assert_eq!((files.as_array().map(Vec::len), &files[0]["name"]), (Some(1), &json!(good)));

        assert_eq!(api.post(&format!("{path}/build"), &json!({"colour": "red"}))?.status, 422);
        let run = api.make(&format!("{path}/build"), &json!({}))?;
        let id = run["id"].as_str().context("no id")?;
        let shown = api.get(&path)?.json();
        assert_eq!((&shown["state"], &shown["build_run_id"]), (&json!("building"), &json!(id)));
        let refused =
            [api.put(&file, b"x")?, api.delete(&file)?, api.post(&format!("{path}/build"), &json!({}))?];
        for answer in &refused {
            assert_eq!(answer.status, 409, "{}", detail(answer));
            assert!(detail(answer).contains("a@1 is building"), "{}", detail(answer));
        }
        let in_use = api.delete(&path)?;
        assert_eq!(in_use.status, 409);
        assert!(detail(&in_use).contains(&format!("in use by run {id}")), "{}", detail(&in_use));

        let run = format!("/v1/runs/{id}");
        assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled");
        assert_eq!(api.get(&path)?.json()["state"], "failed");
        assert_eq!(api.put(&file, b"x")?.status, 200, "it collects files again");
        let unclear = api.delete(&path)?;
        assert_eq!(unclear.status, 422);
        assert!(detail(&unclear).ends_with("name the one to delete, such as a@1"), "{}", detail(&unclear));
        let version = format!("{path}@1");
        assert_eq!((api.delete(&version)?.status, api.delete(&version)?.status), (204, 404));
        assert_eq!(api.get(&run)?.status, 404, "its build is of no use without it");
        assert_eq!(system.num_objects(), 0);
        Ok(())
    })
}

#[test]
fn only_what_is_ready_is_used() -> Result<()> {
    on_both(|_, api, noun| {
        api.make(noun.path, &json!({"name": "a"}))?;
        let session =
            api.session("take", &[("points.csv", b"x"), ("calib.toml", b"x"), ("masks.zip", b"x")])?;
        let request = match noun.name {
            "motion database" => json!({"kind": "sparse", "motion_database": "a"}),
            _ => json!({"kind": "multi-view", "body_model": "a"}),
        };
        let refused = api.post(&format!("{session}/runs"), &request)?;
        assert_eq!((refused.status, refused.problem().as_str()), (409, "conflict"));
        let expected = format!("{} a@1 is open, expected ready: upload", noun.name);
        assert!(detail(&refused).starts_with(&expected), "{}", detail(&refused));
        let runs = api.get("/v1/runs")?.json();
        assert_eq!(runs["items"], Value::Array(Vec::new()), "nothing was started");
        Ok(())
    })
}

#[test]
fn the_number_of_a_deleted_version_is_not_used_again() -> Result<()> {
    on_both(|_, api, noun| {
        let path = noun.path;
        for version in 1..=3 {
            assert_eq!(api.make(path, &json!({"name": "a"}))?["version"], version);
        }
        for which in ["a@3", "a@1", "a@2"] {
            assert_eq!(api.delete(&format!("{path}/{which}"))?.status, 204, "{which}");
        }
        assert_eq!(api.make(path, &json!({"name": "a"}))?["version"], 4);
        assert_eq!(api.get(&format!("{path}/a@3"))?.status, 404);
        assert_eq!(api.make(path, &json!({"name": "b"}))?["version"], 1, "names are counted apart");
        Ok(())
    })
}
