//! `marey evaluate sparse` as people use it, on drawn motion.

use std::{fs, path::Path, process::Command};

use serde_json::Value;

fn marey(folder: &Path, args: &[&str]) -> Result<String, String> {
    let output = Command::new(env!("CARGO_BIN_EXE_marey")).args(args).current_dir(folder).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    if output.status.success() { Ok(text(output.stdout)) } else { Err(text(output.stderr)) }
}

/// A folder with a few drawn trials.
fn samples() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    marey(folder.path(), &["sample", "--out", "motion", "--count", "6", "--frames", "120"]).unwrap();
    folder
}

#[test]
fn an_evaluation_is_printed_and_written_as_asked() {
    let folder = samples();
    let here = folder.path();
    let mut args = vec!["evaluate", "sparse", "--train", "motion", "--test", "motion", "--points", "4,6"];
    args.extend([
        "--part",
        "report",
        "--frames",
        "90",
        "--occlusion",
        "one:0.5s",
        "--compare",
        "max_steps=4",
    ]);
    args.extend(["--json", "e.json", "--markdown", "e.md", "--html", "e.html"]);
    let said = marey(here, &args).unwrap();
    for words in ["local-regression", "nearest", "protocol trial-out", "synthetic", "hidden", "max_steps=4"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(said.contains("the defaults were tuned on others: "), "{said}");
    let json: Value = serde_json::from_slice(&fs::read(here.join("e.json")).unwrap()).unwrap();
    assert_eq!(json["tested_trials"].as_array().map(Vec::len), Some(4));
    assert_eq!(json["tuning_trials"].as_array().map(Vec::len), Some(2));
    assert_eq!((&json["synthetic"], &json["protocol"]), (&Value::Bool(true), &"trial-out".into()));
    // Two methods, two numbers of points, with and without gap, as given and compared, four trials.
    assert_eq!(json["trials"].as_array().map(Vec::len), Some(2 * 2 * 2 * 2 * 4));
    assert!(json["rows"][0]["rms_deg"].as_f64().is_some_and(|deg| deg > 0.1), "{}", json["rows"][0]);
    assert!(json["tables"].as_array().is_some_and(|tables| tables.len() >= 4));
    let markdown = fs::read_to_string(here.join("e.md")).unwrap();
    assert!(markdown.contains("marey evaluate sparse --train motion") && markdown.contains("| --- |"));
    let html = fs::read_to_string(here.join("e.html")).unwrap();
    assert!(html.starts_with("<!DOCTYPE html>") && html.ends_with("</html>\n") && !html.contains("http"));
    assert!(html.contains("marey evaluate sparse --train motion"), "the command is in the report");
}

#[test]
fn what_can_not_be_evaluated_is_refused_with_the_reason() {
    let folder = samples();
    let refused = |more: &[&str]| {
        let args = [&["evaluate", "sparse", "--train", "motion", "--test", "motion"], more].concat();
        marey(folder.path(), &args).unwrap_err()
    };
    for (args, word) in [
        (&["--points", "7"][..], "7 control points"),
        (&["--actions", "swimming"], "swimming"),
        (&["--set", "speed=3"], "speed"),
        (&["--window", "99"], "window"),
        (&["--occlusion", "two:1s"], "two:1s"),
        (&["--noise-mm", "-3"], "-3"),
        (&["--train", "nowhere"], "nowhere"),
    ] {
        let message = refused(args);
        assert!(message.contains(word), "{args:?}: {message}");
    }
}
