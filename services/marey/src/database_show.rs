//! What `marey db show` prints.

use std::fmt::Write;

use client::MotionDatabase;
use jobs::motion_database::{Augment, Clip, Contents, Share};
use model::{counted, shown_rate};
use serde::Deserialize;

/// A motion database and what is in it.
#[derive(Debug, Deserialize)]
pub struct Details {
    #[serde(flatten)]
    database: MotionDatabase,
    skeleton: Option<String>,
    build_run_id: Option<String>,
    created_at: String,
    ready_at: Option<String>,
    num_shards: Option<u32>,
    #[serde(default)]
    without: Vec<String>,
    contents: Option<Contents>,
    build_seconds: Option<f64>,
    #[serde(default)]
    models: Vec<Model>,
    #[serde(default)]
    used_by: Vec<User>,
}

#[derive(Debug, Deserialize)]
struct Model {
    method: String,
    bytes: u64,
    trained_at: String,
}

#[derive(Debug, Deserialize)]
struct User {
    run_id: Option<String>,
    session: Option<String>,
    motion_database: Option<String>,
}

/// All of it, for people.
pub fn description(details: &Details) -> String {
    let MotionDatabase { name, version, state, .. } = &details.database;
    let mut out = format!("motion database {name}@{version}, {state}\n");
    let mut line = |what: &str, value: String| {
        if !value.is_empty() {
            let _ = writeln!(out, "  {what:<12} {value}");
        }
    };
    line("id", details.database.id.clone());
    line("created", details.created_at.clone());
    line("ready", details.ready_at.clone().unwrap_or_default());
    let built = |run: &String| match details.build_seconds {
        Some(seconds) => format!("run {run}, {seconds:.1} s"),
        None => format!("run {run}"),
    };
    line("build", details.build_run_id.as_ref().map(built).unwrap_or_default());
    line("made from", details.database.base.clone().unwrap_or_default());
    line("without", details.without.join(", "));
    let index = |bytes: u64| match details.num_shards {
        Some(shards) if shards > 1 => format!("{:.1} MB in {shards} shards", bytes as f64 / 1e6),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    };
    line("index", details.database.bytes.map(index).unwrap_or_default());
    for model in &details.models {
        let size = model.bytes as f64 / 1e3;
        line("model", format!("{}, {size:.0} kB, trained {}", model.method, model.trained_at));
    }
    if let Some(contents) = &details.contents {
        let skeleton = details.skeleton.clone().unwrap_or_default();
        line(
            "skeleton",
            format!("{skeleton}, {} joints, {} degrees of freedom", contents.num_joints, contents.num_dofs),
        );
        let (clips, poses) = (details.database.num_clips, details.database.num_poses);
        line(
            "motion",
            format!(
                "{}, {} at {} Hz",
                counted(clips.unwrap_or_default(), "clip"),
                counted(poses.unwrap_or_default(), "pose"),
                shown_rate(contents.frame_rate_hz)
            ),
        );
        line("augmented", augmented(&contents.augment));
    }
    for user in &details.used_by {
        line("in use by", user.in_words());
    }
    if let Some(contents) = &details.contents {
        table(&mut out, "ACTION", &contents.actions);
        table(&mut out, "SUBJECT", &contents.subjects);
        for warning in &contents.warnings {
            let _ = writeln!(out, "warning: {warning}");
        }
    }
    out
}

fn augmented(Augment { mirror, speeds }: &Augment) -> String {
    let speeds = speeds.iter().map(|speed| format!("at {speed} times the speed"));
    mirror.then(|| "mirrored".to_owned()).into_iter().chain(speeds).collect::<Vec<_>>().join(", ")
}

impl User {
    fn in_words(&self) -> String {
        match (&self.run_id, &self.session, &self.motion_database) {
            (Some(run), Some(session), _) => format!("run {run} of session {session:?}"),
            (Some(run), None, _) => format!("run {run}"),
            (None, _, version) => {
                format!("{}, which is being made from it", version.as_deref().unwrap_or_default())
            }
        }
    }
}

fn table(out: &mut String, what: &str, shares: &[Share]) {
    let _ = writeln!(out, "\n{what:<24} {:>7} {:>10}", "CLIPS", "POSES");
    for share in shares {
        let name = if share.name.is_empty() { "(not known)" } else { &share.name };
        let _ = writeln!(out, "{name:<24} {:>7} {:>10}", share.num_clips, share.num_poses);
    }
}

/// The clips as a table.
pub fn clips(clips: &Vec<Clip>) -> String {
    let mut out = format!("\n{:<32} {:<10} {:<16} {:>8}\n", "CLIP", "SUBJECT", "ACTION", "POSES");
    for clip in clips {
        let _ =
            writeln!(out, "{:<32} {:<10} {:<16} {:>8}", clip.name, clip.subject, clip.action, clip.num_poses);
    }
    out
}
