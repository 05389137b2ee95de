//! Performers followed live: real WebSockets through the gateway.

use std::net::TcpStream;

use anyhow::{Context, Result, bail};
use gateway::access::Scope;
use serde_json::{Value, json};
use tests::{Api, system, trials};
use tokio_tungstenite::tungstenite::{
    self, ClientRequestBuilder, Message, WebSocket, connect, protocol::frame::coding::CloseCode,
    stream::MaybeTlsStream,
};

type Socket = WebSocket<MaybeTlsStream<TcpStream>>;

/// A WebSocket of `api` to `database`.
fn open(api: &Api, database: &str) -> tungstenite::Result<Socket> {
    let host = api.url().trim_start_matches("http://");
    let uri = format!("ws://{host}/v1/live?motion_database={database}").parse().expect("an address");
    let request =
        ClientRequestBuilder::new(uri).with_header("Authorization", format!("Bearer {}", api.key()));
    Ok(connect(request)?.0)
}

fn start(extra: Value) -> Value {
    let mut start = json!({ "type": "start", "points": crate::POINTS, "skeleton_asf": trials::skeleton() });
    for (name, value) in extra.as_object().into_iter().flatten() {
        start[name] = value.clone();
    }
    start
}

/// A WebSocket that has started.
fn started(api: &Api, extra: Value) -> Result<Socket> {
    let mut socket = open(api, "walks")?;
    say(&mut socket, &start(extra))?;
    let answer = hear(&mut socket)?;
    anyhow::ensure!(answer["type"] == "started", "{answer}");
    Ok(socket)
}

fn say(socket: &mut Socket, message: &Value) -> Result<()> {
    Ok(socket.send(Message::text(message.to_string()))?)
}

/// The next message in words.
fn hear(socket: &mut Socket) -> Result<Value> {
    loop {
        match socket.read()? {
            Message::Text(text) => return Ok(serde_json::from_str(&text)?),
            Message::Close(frame) => bail!("closed: {frame:?}"),
            _ => {}
        }
    }
}

/// All messages until it closes, and with which code.
fn until_closed(socket: &mut Socket) -> Result<(Vec<Value>, CloseCode)> {
    let mut messages = Vec::new();
    loop {
        match socket.read()? {
            Message::Text(text) => messages.push(serde_json::from_str(&text)?),
            Message::Close(frame) => return Ok((messages, frame.context("no code")?.code)),
            _ => {}
        }
    }
}

/// Frames of a trial that is not in the database, 60 a second.
fn frames(seed: u32, count: usize) -> Result<Vec<Value>> {
    let paths = evaluation::control_trajectories(&crate::motion(seed, 2 * count)?, &crate::POINTS)?;
    let frame = |i: usize| {
        let points: Vec<_> = paths.frame(2 * i).iter().map(|p| [p.x, p.y, p.z]).collect();
        json!({ "type": "frame", "frame": i + 1, "time": i as f64 / 60.0, "points": points })
    };
    Ok((0..count).map(frame).collect())
}

/// Sends frames one by one; the poses, and the last state.
fn follow(socket: &mut Socket, frames: &[Value]) -> Result<(Vec<Value>, Option<Value>)> {
    let (mut poses, mut state) = (Vec::new(), None);
    for frame in frames {
        say(socket, frame)?;
        loop {
            let answer = hear(socket)?;
            match answer["type"].as_str() {
                Some("pose") => {
                    poses.push(answer);
                    break;
                }
                Some("state") => state = Some(answer),
                _ => bail!("{answer}"),
            }
        }
    }
    Ok((poses, state))
}

#[test]
fn every_frame_has_a_pose_with_its_number_and_time() -> Result<()> {
    let mut socket = started(crate::with_database(), json!({ "joint_positions": true }))?;
    let (poses, _) = follow(&mut socket, &frames(9, 30)?)?;
    for (i, pose) in poses.iter().enumerate() {
        assert_eq!(
            (pose["frame"].as_u64(), pose["time"].as_f64()),
            (Some(i as u64 + 1), Some(i as f64 / 60.0))
        );
        assert_eq!(pose["dropped"], 0);
        assert_eq!(pose["pose"].as_array().map(Vec::len), Some(45));
        assert_eq!(pose["joints"].as_array().map(Vec::len), Some(14));
        assert!(pose["residual_m"].as_f64().context("a number")? < 0.05, "{pose}");
    }
    say(&mut socket, &json!({ "type": "end" }))?;
    let (last, code) = until_closed(&mut socket)?;
    assert_eq!(last.iter().map(|m| &m["type"]).collect::<Vec<_>>(), ["state"]);
    assert_eq!((last[0]["frame"].as_u64(), code), (Some(30), CloseCode::Normal));
    Ok(())
}

#[test]
fn a_new_connection_goes_on_from_the_state_with_the_same_poses() -> Result<()> {
    let api = crate::with_database();
    let frames = frames(9, 100)?;
    let (whole, _) = follow(&mut started(api, json!({}))?, &frames)?;
    // The connection breaks without a word; the last state is of frame 60.
    let mut broken = started(api, json!({}))?;
    let (_, state) = follow(&mut broken, &frames[..75])?;
    drop(broken);
    let state = state.context("a state after 60 frames")?;
    let known = state["frame"].as_u64().context("a number")? as usize;
    assert_eq!(known, 60);
    let mut again = started(api, json!({ "state": state["state"] }))?;
    let (rest, _) = follow(&mut again, &frames[known..])?;
    for (found, expected) in rest.iter().zip(&whole[known..]) {
        assert_eq!(found, expected);
    }
    Ok(())
}

#[test]
fn a_client_that_does_not_read_has_only_the_latest_poses_and_the_rest_is_counted() -> Result<()> {
    let mut socket =
        started(crate::with_database(), json!({ "joint_positions": true, "state_every": 100_000 }))?;
    let frames = frames(9, 50)?;
    let count = 5_000_u64;
    for number in 1..=count {
        let mut frame = frames[number as usize % 50].clone();
        frame["frame"] = number.into();
        say(&mut socket, &frame)?;
    }
    say(&mut socket, &json!({ "type": "end" }))?;
    let (answers, code) = until_closed(&mut socket)?;
    assert_eq!(code, CloseCode::Normal);
    let poses: Vec<&Value> = answers.iter().filter(|a| a["type"] == "pose").collect();
    let last = poses.last().context("a pose")?;
    assert_eq!(last["frame"], count);
    let dropped = last["dropped"].as_u64().context("a number")?;
    assert_eq!(dropped + poses.len() as u64, count);
    assert!(dropped > 0 && poses.is_sorted_by_key(|pose| pose["frame"].as_u64()));
    Ok(())
}

#[test]
fn a_client_that_wants_every_pose_gets_every_pose() -> Result<()> {
    let mut socket = started(crate::with_database(), json!({ "delivery": "every", "state_every": 100_000 }))?;
    let frames = frames(9, 200)?;
    for frame in &frames {
        say(&mut socket, frame)?;
    }
    say(&mut socket, &json!({ "type": "end" }))?;
    let (answers, _) = until_closed(&mut socket)?;
    let numbers: Vec<_> =
        answers.iter().filter(|a| a["type"] == "pose").map(|a| a["frame"].as_u64()).collect();
    assert_eq!(numbers, (1..=200).map(Some).collect::<Vec<_>>());
    Ok(())
}

#[test]
fn binary_frames_have_binary_poses() -> Result<()> {
    let mut socket = started(crate::with_database(), json!({ "binary": true }))?;
    let frame = &frames(9, 1)?[0];
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&7_u64.to_le_bytes());
    bytes.extend_from_slice(&1.5_f64.to_le_bytes());
    for coordinate in frame["points"].as_array().into_iter().flatten().flat_map(|p| p.as_array()).flatten() {
        bytes.extend_from_slice(&(coordinate.as_f64().context("a number")? as f32).to_le_bytes());
    }
    socket.send(Message::binary(bytes))?;
    let pose = loop {
        if let Message::Binary(pose) = socket.read()? {
            break pose;
        }
    };
    assert_eq!(pose.len(), 48 + 4 * 45);
    assert_eq!(pose[..16], [7_u64.to_le_bytes(), 1.5_f64.to_le_bytes()].concat()[..]);
    Ok(())
}

/// Status and problem of an answer that is no WebSocket.
fn refusal(opened: tungstenite::Result<Socket>) -> (u16, String) {
    match opened {
        Err(tungstenite::Error::Http(response)) => {
            let body = response.body().as_deref().unwrap_or_default();
            let problem: Value = serde_json::from_slice(body).unwrap_or_default();
            (response.status().as_u16(), problem["type"].as_str().unwrap_or_default().to_owned())
        }
        Err(error) => panic!("{error}"),
        Ok(_) => panic!("opened"),
    }
}

#[test]
fn who_may_not_gets_a_problem_and_no_socket() -> Result<()> {
    let owner = crate::with_database();
    let system = system::shared();
    let forger = Api::new(owner.url(), "mk_0");
    assert_eq!(refusal(open(&forger, "walks")), (401, "urn:marey:problem:unauthorized".to_owned()));
    let reader = system.caller("walks", &[Scope::Read])?;
    assert_eq!(refusal(open(&reader, "walks")), (403, "urn:marey:problem:forbidden".to_owned()));
    let other = system.project("other")?;
    let missing = (404, "urn:marey:problem:not-found".to_owned());
    assert_eq!(refusal(open(&other, "walks")), missing);
    let id = owner.get("/v1/motion-databases/walks")?.json()["id"].as_str().context("an id")?.to_owned();
    assert_eq!(refusal(open(&other, &id)), missing);
    assert_eq!(refusal(open(owner, "walks@99")), missing);
    assert_eq!(owner.get("/v1/live?motion_database=walks")?.status, 400, "no WebSocket");
    Ok(())
}

#[test]
fn a_browser_names_its_key_as_a_subprotocol() -> Result<()> {
    let api = crate::with_database();
    let host = api.url().trim_start_matches("http://");
    let uri = format!("ws://{host}/v1/live?motion_database=walks").parse()?;
    let request = ClientRequestBuilder::new(uri)
        .with_sub_protocol("marey.live.v1")
        .with_sub_protocol(format!("marey.key.{}", api.key()));
    let (mut socket, response) = connect(request)?;
    assert_eq!(response.headers()["sec-websocket-protocol"], "marey.live.v1");
    say(&mut socket, &start(json!({})))?;
    assert_eq!(hear(&mut socket)?["type"], "started");
    Ok(())
}

#[test]
fn nonsense_is_answered_with_an_error_that_names_the_frame() -> Result<()> {
    let api = crate::with_database();
    let good = frames(9, 3)?;
    let mut short = good[2].clone();
    short["points"].as_array_mut().context("points")?.pop();
    let mut repeated = good[2].clone();
    repeated["frame"] = 2.into();
    let cases = [
        (Message::text(short.to_string()), json!(3), "frame 3 has 15 coordinates, expected 18"),
        (Message::text(repeated.to_string()), json!(2), "frame 2 came after frame 2"),
        (
            Message::text(r#"{"type":"frame","frame":3,"points":[[1,"x",2]]}"#),
            json!(3),
            "frame 3: points[0][1] is \"x\", expected a number",
        ),
        (Message::text("{}"), Value::Null, "type is missing"),
        (Message::binary(vec![1, 2, 3]), Value::Null, "binary frame of 3 bytes"),
        (Message::binary(3_u64.to_le_bytes().to_vec()), json!(3), "binary frame of 8 bytes"),
        (Message::text(start(json!({})).to_string()), Value::Null, "a second start"),
    ];
    for (nonsense, frame, expected) in cases {
        let mut socket = started(api, json!({}))?;
        follow(&mut socket, &good[..2])?;
        socket.send(nonsense)?;
        let (last, code) = until_closed(&mut socket)?;
        let [state, error] = &last[..] else { bail!("{last:?}") };
        assert_eq!((&state["type"], state["frame"].as_u64()), (&json!("state"), Some(2)));
        let message = error["message"].as_str().context("a message")?;
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
        assert_eq!((&error["frame"], code), (&frame, CloseCode::Policy), "{message}");
    }
    Ok(())
}

#[test]
fn a_start_that_makes_no_sense_is_refused() -> Result<()> {
    let api = crate::with_database();
    let cases = [
        (json!({ "points": ["left_wrist"] }), "only 1 control point; 2 to 16 are needed"),
        (json!({ "points": ["left_wrist", "tail"] }), "tail"),
        (json!({ "parameters": { "neighbours": 1 } }), "neighbours is 1"),
        (json!({ "parameters": { "colour": 1 } }), "colour"),
        (json!({ "skeleton_asf": ":nonsense" }), "skeleton_asf"),
        (json!({ "state": "????" }), "base64"),
        (json!({ "state": "TUFSRVk=" }), "live state is damaged"),
        (json!({ "more": 1 }), "more"),
        (json!({ "type": "end" }), "not a start"),
    ];
    for (extra, expected) in cases {
        let mut socket = open(api, "walks")?;
        say(&mut socket, &start(extra))?;
        let (last, code) = until_closed(&mut socket)?;
        let message = last.last().context("an error")?["message"].as_str().context("a message")?;
        assert!(message.contains(expected), "{message:?} does not say {expected:?}");
        assert_eq!(code, CloseCode::Policy, "{message}");
    }
    Ok(())
}
