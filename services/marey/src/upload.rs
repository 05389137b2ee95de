//! `marey upload`.

use std::{fs::File, path::PathBuf};

use anyhow::Context;
use client::{Client, ServerArgs, Session, encode};
use formats::FileRole;
use serde_json::Value;

use crate::{
    session_files,
    words::{counted, name},
};

/// Upload what was recorded: control points and a skeleton, or a calibration and what the cameras saw
///
/// The control points are a .csv (time,left_wrist_x,left_wrist_y,…; seconds and metres, y up), .trc or .c3d file. The
/// performer's skeleton, .asf or .bvh, is optional: without one, it is fitted to the points. A true motion (.amc, .bvh), if
/// there is one, serves to measure the error.
///
/// For cameras: a calibration (.toml, .json, .yml, .xml, .qca.txt), and for each camera a video, or pictures or masks in a
/// folder or archive, named after the camera; pictures of the empty scene are called cam01.plate.png or lie in a folder plates/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey upload \"take 3\" points.csv skeleton.asf
  marey upload \"take 3\" truth.amc                       # the true motion, where it is known
  marey upload \"on a rig\" points.csv
  marey upload \"on a rig\" rig.bvh --role skeleton       # otherwise taken for the true motion
  marey upload \"markers\" take3.c3d skeleton.asf
  marey upload \"take 4\" calib.toml cam*.mp4 plates/     # a session with cameras")]
pub struct Args {
    /// The session, by name or id; a new one is made if no session has that name
    #[arg(value_parser = name)]
    session: String,
    /// Files to upload, or folders of pictures
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// What the files are: skeleton, control-points, ground-truth, calibration, video, images, masks or plate [default: told by
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
    let client = Client::new(args.server.server()?);
    let (session, is_new) = match client.find_session(&args.session)? {
        Some(session) => (session, false),
        None => (client.create_session(&args.session)?, true),
    };
    for (index, found) in files.into_iter().enumerate() {
        let name = args.name.clone().unwrap_or(found.name);
        let sent = put(&client, &session, &name, args.role.or(found.role), found.file);
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
