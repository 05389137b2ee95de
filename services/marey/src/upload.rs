//! `marey upload`.

use std::{fs::File, path::PathBuf};

use anyhow::Context;
use client::{Client, ServerArgs, Session, encode};

use crate::session_files;

/// Upload the files of a session: control points, skeleton, true motion; or calibration, videos, masks, plates
///
/// The control points are a .csv (time,left_wrist_x,left_wrist_y,…; seconds and metres, y up), .trc or .c3d file. The
/// performer's skeleton, .asf or .bvh, is optional: without it the motion database's is used. A true motion (.amc, .bvh), if
/// there is one, is for measuring the error.
///
/// For cameras: a calibration (.toml, .json, .yml, .xml, .qca.txt), and of every camera a video, or pictures or masks in a
/// folder or archive, named after the camera; pictures of the empty scene as cam01.plate.png or in a folder plates/.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey upload \"take 3\" points.csv skeleton.asf
  marey upload \"take 3\" rig.bvh --role skeleton
  marey upload \"take 4\" calib.toml cam*.mp4 plates/")]
pub struct Args {
    /// The session: its name or id; made if there is none
    session: String,
    /// Files to upload, or folders of pictures
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// What the files are for: skeleton, control-points, ground-truth, calibration, video, images, masks, plate [default: by
    /// extension]
    #[arg(long)]
    role: Option<String>,
    /// Name of the file there, when it is only one [default: its own]
    #[arg(long)]
    name: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `marey upload`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    anyhow::ensure!(args.name.is_none() || args.files.len() == 1, "--name is for a single file");
    let client = Client::new(args.server.server()?);
    let session = match client.find_session(&args.session)? {
        Some(session) => session,
        None => {
            let session = client.create_session(&args.session)?;
            println!("made session {:?}, id {}", session.name, session.id);
            session
        }
    };
    for found in session_files::gather(&args.files)? {
        let name = args.name.clone().unwrap_or(found.name);
        put(&client, &session, &name, args.role.as_deref().or(found.role), found.file)?;
    }
    Ok(())
}

/// Uploads one file.
pub fn put(
    client: &Client,
    session: &Session,
    name: &str,
    role: Option<&str>,
    file: File,
) -> anyhow::Result<()> {
    let query = role.map(|role| format!("?role={}", encode(role))).unwrap_or_default();
    let path = format!("/v1/sessions/{}/files/{}{query}", session.id, encode(name));
    let stored = client.put_file(&path, file).with_context(|| name.to_owned())?;
    println!(
        "uploaded {name} as {} ({} bytes)",
        stored["role"].as_str().unwrap_or("?"),
        stored["bytes"].as_u64().unwrap_or_default()
    );
    Ok(())
}
