//! `marey upload`.

use std::{fs::File, path::PathBuf};

use anyhow::Context;
use client::{Client, ServerArgs, Session, encode};
use formats::FileRole;
use serde_json::Value;

use model::counted;

use crate::{
    session_files::{self, SessionFile},
    words::name,
};

/// Upload what was recorded: control points and a skeleton, or a calibration and what the cameras saw
///
/// The control points are a .csv (time,left_wrist_x,left_wrist_y,…; seconds and metres, y up), .trc or .c3d file. The
/// performer's skeleton, .asf or .bvh, is optional: without one, it is fitted to the points. A true motion (.amc, .bvh), if
/// there is one, serves to measure the error.
///
/// For cameras: a calibration (.toml, .json, .yml, .yaml, .xml, .qca.txt), and for each camera a video (.mp4, .mov, .m4v, .avi,
/// .mkv, .webm), or pictures or masks in a folder or archive, named after the camera; pictures of the empty scene are called
/// cam01.plate.png or lie in a folder plates/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey upload \"take 3\" points.csv skeleton.asf
  marey upload \"take 3\" truth.amc                       # the true motion, where it is known
  marey upload \"on a rig\" points.csv
  marey upload \"on a rig\" rig.bvh --role skeleton       # a .bvh counts as the true motion otherwise
  marey upload \"markers\" take3.c3d skeleton.asf
  marey upload \"take 4\" calib.toml cam*.mp4 plates/     # a session with cameras")]
pub struct Args {
    /// The session, by name or id; a new one is made if no session has that name
    #[arg(value_parser = name)]
    session: String,
    /// Files to upload, or folders of pictures
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// What the files are: skeleton, control-points, ground-truth, calibration, video, images, masks or plate [default: by
    /// their names]
    #[arg(long)]
    role: Option<FileRole>,
    /// Name to store it under, for a single file [default: its own]
    #[arg(long, value_parser = name)]
    name: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey upload`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    // first of all: a file that is missing must not leave an empty session
    let files = session_files::gather(&args.files)?;
    anyhow::ensure!(
        args.name.is_none() || files.len() == 1,
        "--name is for a single file, found {} to upload",
        files.len()
    );
    let files = with_roles(files, args)?;
    let client = Client::new(args.server.server()?);
    let (session, is_new) = match client.find_session(&args.session)? {
        Some(session) => (session, false),
        None => (client.create_session(&args.session)?, true),
    };
    for (index, (name, role, file)) in files.into_iter().enumerate() {
        let sent = put(&client, &session, &name, role, file);
        if sent.is_err() && is_new && index == 0 {
            // refused before it held anything: as if it had not been made
            client.delete(&format!("/v1/sessions/{}", session.id))?;
        }
        sent?;
        if is_new && index == 0 {
            println!("to a new session {:?}, id {}", session.name, session.id);
        }
    }
    Ok(())
}

/// Every file with its name there and the role that is stated for it; refuses what the server would, before anything is sent.
fn with_roles(files: Vec<SessionFile>, args: &Args) -> anyhow::Result<Vec<(String, Option<FileRole>, File)>> {
    let named = files.into_iter().map(|found| {
        let name = args.name.clone().unwrap_or(found.name);
        let role = args.role.or(found.role);
        gateway::check_file_name(&name)?;
        FileRole::in_session(&name, role)?;
        Ok((name, role, found.file))
    });
    named.collect()
}

/// Uploads one file and says so.
fn put(
    client: &Client,
    session: &Session,
    name: &str,
    role: Option<FileRole>,
    file: File,
) -> anyhow::Result<()> {
    let stored = send(client, session, name, role, file)?;
    println!(
        "uploaded {name} as {} ({})",
        stored["role"].as_str().unwrap_or("?"),
        counted(stored["bytes"].as_u64().unwrap_or_default(), "byte")
    );
    Ok(())
}

/// Uploads one file; what the server keeps of it.
pub fn send(
    client: &Client,
    session: &Session,
    name: &str,
    role: Option<FileRole>,
    file: File,
) -> anyhow::Result<Value> {
    let query = role.map(|role| format!("?role={}", encode(role.as_str()))).unwrap_or_default();
    let path = format!("/v1/sessions/{}/files/{}{query}", session.id, encode(name));
    client.put_file(&path, file).with_context(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::{alone::Alone, cli::Cli};

    #[test]
    fn the_help_names_all_roles_and_the_endings_of_their_files() {
        let mut command = Cli::command();
        let upload = command.find_subcommand_mut("upload").expect("there is such a command");
        let help = upload.render_long_help().to_string();
        let roles = [
            FileRole::Skeleton,
            FileRole::ControlPoints,
            FileRole::GroundTruth,
            FileRole::Calibration,
            FileRole::Video,
        ];
        for role in roles {
            let endings = role.endings().replace(" or ", ", ");
            for ending in endings.split(", ") {
                assert!(help.contains(ending), "{role} {ending}");
            }
        }
        for role in FileRole::session_roles() {
            assert!(help.contains(role.as_str()), "{role}");
        }
    }

    #[test]
    fn every_file_is_looked_at_before_the_first_is_sent() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        for name in ["points.csv", "up.log", "index.csv"] {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        let check = |words: &[&str]| {
            let args = Alone::<Args>::parse_from(["upload", "s"].iter().chain(words)).args;
            // no server is there: what is refused is refused before one is asked
            with_roles(session_files::gather(&args.files)?, &args).map(|files| files.len())
        };
        let points = path("points.csv");
        assert_eq!(check(&[&points]).unwrap(), 1);
        let (log, index) = (path("up.log"), path("index.csv"));
        let (hidden, empty) = (path(".hidden.csv"), path("empty.csv"));
        fs::write(&hidden, "x").unwrap();
        fs::write(&empty, "").unwrap();
        let is_empty = format!("{empty} is empty");
        for (words, expected) in [
            (&[points.as_str(), &log][..], "the type of \"up.log\" is not known"),
            (&[&points, &index], "\"index.csv\" is the list that goes with files for motion databases"),
            (&[&points, &hidden], "\".hidden.csv\" is not a valid file name"),
            (&[&points, &empty], &is_empty),
            (&[&points, "--role", "motion"], "role motion belongs to motion databases"),
            (&[&points, "--role", "skeleton"], "a skeleton must be .asf or .bvh, found \"points.csv\""),
        ] {
            let message = check(words).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
