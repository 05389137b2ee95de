//! A file is there whole and right, or not at all.

use std::{
    io::{Read, Write},
    net::TcpStream,
    time::Duration,
};

use anyhow::{Context, Result};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::json;
use sha2::{Digest, Sha256};
use tests::{Api, System, system::MAX_UPLOAD_BYTES};

const CSV: &[u8] = b"time,a_x,a_y,a_z\n0,0,0,0\n";

fn digest(content: &[u8]) -> String {
    format!("sha-256=:{}:", BASE64_STANDARD.encode(Sha256::digest(content)))
}

fn names(api: &Api, session: &str) -> Result<Vec<String>> {
    let files = api.get(&format!("{session}/files"))?.json();
    Ok(files
        .as_array()
        .context("no list")?
        .iter()
        .filter_map(|f| f["name"].as_str().map(str::to_owned))
        .collect())
}

#[test]
fn a_file_comes_back_as_it_was_sent() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    let content: Vec<u8> = (0..7_000_000u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let path = format!("{session}/files/L%C3%A4ufer%201.c3d");
    let sent = api.put_with(&path, &content, &[("content-digest", &digest(&content))])?;
    assert_eq!(sent.status, 201);
    assert_eq!(
        (&sent.json()["role"], &sent.json()["name"]),
        (&json!("control-points"), &json!("Läufer 1.c3d"))
    );
    let back = api.get(&path)?;
    assert_eq!(back.status, 200);
    assert!(back.body == content, "another content came back");
    assert_eq!(back.header("etag"), format!("\"{}\"", sent.json()["blake3"].as_str().unwrap_or_default()));

    let replaced = api.put(&path, CSV)?;
    assert_eq!(replaced.status, 200);
    assert_eq!(api.get(&path)?.body, CSV);
    assert_eq!(system.num_objects(), 1, "the old object is still there");

    assert_eq!(api.delete(&path)?.status, 204);
    assert_eq!(api.get(&path)?.status, 404);
    assert_eq!(system.num_objects(), 0);
    Ok(())
}

#[test]
fn another_checksum_than_announced_keeps_nothing() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    let path = format!("{session}/files/points.csv");
    let answer = api.put_with(&path, CSV, &[("content-digest", &digest(b"something else"))])?;
    assert_eq!((answer.status, answer.problem().as_str()), (422, "checksum-mismatch"));
    for bad in ["sha-256=abc", "md5=:AAAA:", "sha-256=:AAAA:"] {
        assert_eq!(api.put_with(&path, CSV, &[("content-digest", bad)])?.status, 400, "{bad}");
    }
    assert!(names(&api, &session)?.is_empty());
    assert_eq!(system.num_objects(), 0);
    Ok(())
}

#[test]
fn a_file_over_the_limit_is_refused_whether_its_size_is_announced_or_not() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    let path = format!("{session}/files/points.csv");
    let content = vec![b'1'; MAX_UPLOAD_BYTES as usize + 1];
    let announced = api.put(&path, &content)?;
    assert_eq!((announced.status, announced.problem().as_str()), (413, "too-large"));
    let chunked = api.put_with(&path, &content, &[("transfer-encoding", "chunked")])?;
    assert_eq!((chunked.status, chunked.problem().as_str()), (413, "too-large"));
    assert!(names(&api, &session)?.is_empty());
    assert_eq!(system.num_objects(), 0);
    assert_eq!(api.put(&path, &content[1..])?.status, 201);
    Ok(())
}

#[test]
fn an_upload_that_breaks_off_never_becomes_a_file() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    let address = api.url().trim_start_matches("http://").to_owned();
    for framing in ["Content-Length: 7000000", "Transfer-Encoding: chunked"] {
        let mut stream = TcpStream::connect(&address)?;
        write!(
            stream,
            "PUT {session}/files/points.csv HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {}\r\n{framing}\r\n\r\n",
            api.key()
        )?;
        if framing.starts_with("Transfer") {
            write!(stream, "5b8d80\r\n")?;
        }
        stream.write_all(&vec![b'1'; 6_000_000 - 1])?;
        drop(stream);
    }
    // One that goes on sending nothing: it is answered when the patience is over.
    let mut stream = TcpStream::connect(&address)?;
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    write!(
        stream,
        "PUT {session}/files/points.csv HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {}\r\n\
         Content-Length: 100\r\nConnection: close\r\n\r\ntime",
        api.key()
    )?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
    assert!(answer.contains("urn:marey:problem:upload-broken"), "{answer}");

    assert!(names(&api, &session)?.is_empty());
    assert_eq!(system.num_objects(), 0);
    Ok(())
}

#[test]
fn a_session_goes_with_its_files() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[("points.csv", CSV), ("skeleton.asf", b"x"), ("truth.amc", b"x")])?;
    assert_eq!(names(&api, &session)?, ["points.csv", "skeleton.asf", "truth.amc"]);
    assert_eq!(api.delete(&session)?.status, 204);
    assert_eq!(api.get(&session)?.status, 404);
    assert_eq!(api.delete(&session)?.status, 404);
    assert_eq!(system.num_objects(), 0);
    Ok(())
}

#[test]
fn the_files_of_a_motion_database_are_fixed_once_it_is_being_built() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let database = "/v1/motion-databases/walks";
    assert_eq!(api.make("/v1/motion-databases", &json!({"name": "walks"}))?["state"], "open");
    assert_eq!(api.post(&format!("{database}/build"), &json!({}))?.status, 422, "nothing to build from");
    assert_eq!(api.put(&format!("{database}/files/points.csv"), CSV)?.status, 422, "no motion file");
    api.upload(&format!("{database}/files/walks.zip"), b"not a zip")?;
    let run = api.make(&format!("{database}/build"), &json!({}))?;
    assert_eq!(api.get(database)?.json()["state"], "building");
    assert_eq!(api.put(&format!("{database}/files/more.zip"), b"x")?.status, 409);
    assert_eq!(api.delete(&format!("{database}/files/walks.zip"))?.status, 409);
    assert_eq!(api.post(&format!("{database}/build"), &json!({}))?.status, 409);
    assert_eq!(api.delete(database)?.status, 409);
    let run = format!("/v1/runs/{}", run["id"].as_str().unwrap_or_default());
    assert_eq!(api.make(&format!("{run}/cancel"), &json!({}))?["state"], "cancelled");
    assert_eq!(api.get(database)?.json()["state"], "failed");
    assert_eq!(api.put(&format!("{database}/files/more.zip"), b"x")?.status, 201, "it collects files again");
    assert_eq!(api.make("/v1/motion-databases", &json!({"name": "walks"}))?["version"], 2);
    assert_eq!(api.get(&format!("{database}@1"))?.json()["version"], 1);
    assert_eq!(api.delete(&format!("{database}@1"))?.status, 204);
    assert_eq!(api.get(&run)?.status, 404, "its build is of no use without it");
    assert_eq!(system.num_objects(), 0);
    Ok(())
}

#[test]
fn a_file_that_no_session_has_is_refused_with_what_it_could_be() -> Result<()> {
    let system = System::start()?;
    let api = system.project("p")?;
    let session = api.session("s", &[])?;
    for (file, expected) in [
        ("notes.txt", "the type of \"notes.txt\" is not known; sessions take: "),
        ("points", "the type of \"points\" is not known"),
        ("walk.bvh?role=motion", "role motion belongs to motion databases, not to sessions"),
        ("scans.zip?role=scans", "role scans belongs to body models, not to sessions"),
    ] {
        let refused = api.put(&format!("{session}/files/{file}"), b"x")?;
        let detail = refused.json()["detail"].as_str().unwrap_or_default().to_owned();
        assert_eq!(refused.status, 422, "{file}: {detail}");
        assert!(detail.starts_with(expected), "{file}: {detail}");
    }
    assert_eq!(names(&api, &session)?, Vec::<String>::new());
    Ok(())
}
