//! The messages of a WebSocket, as `docs/live.md` has them, from and to the wire of the services.

use axum::extract::ws::Message;
use base64::{Engine, prelude::BASE64_STANDARD};
use proto::v1::{self, LiveDelivery, live_response};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::{error::Error, json};

/// Bytes before the coordinates of a binary frame: number and time.
const FRAME_HEADER: usize = 16;
/// Bit of a binary pose's flags: there is a pose.
const HAS_POSE: u32 = 1;
/// Bit of a binary pose's flags: other poses are still being tried.
const IS_STARTING: u32 = 2;

/// What a client says. All but the first message are frames and, last, an end.
#[derive(Debug)]
pub(super) enum FromClient {
    Start(Start),
    Frame(Frame),
    End,
}

/// What every message begins with.
#[derive(Debug, Deserialize)]
struct Head {
    #[serde(rename = "type")]
    kind: Kind,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Start,
    Frame,
    End,
}

/// What a stream is to be.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Start {
    pub points: Vec<String>,
    #[serde(default)]
    pub skeleton_asf: String,
    #[serde(default)]
    pub parameters: Map<String, Value>,
    #[serde(default)]
    delivery: Delivery,
    #[serde(default)]
    joint_positions: bool,
    #[serde(default)]
    pub binary: bool,
    #[serde(default)]
    state: String,
    #[serde(default)]
    state_every: u32,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Delivery {
    #[default]
    Latest,
    Every,
}

impl Start {
    /// As the services have it; `parameters_json` are all resolved.
    pub fn to_wire(&self, database_id: &str, parameters_json: String) -> Result<v1::LiveStart, String> {
        let state = BASE64_STANDARD.decode(&self.state).map_err(|e| format!("state is not base64: {e}"))?;
        let delivery = match self.delivery {
            Delivery::Latest => LiveDelivery::Latest,
            Delivery::Every => LiveDelivery::Every,
        };
        Ok(v1::LiveStart {
            database_id: database_id.to_owned(),
            skeleton_asf: self.skeleton_asf.clone(),
            points: self.points.clone(),
            parameters_json,
            delivery: delivery.into(),
            joint_positions: self.joint_positions,
            state,
            state_every: self.state_every,
        })
    }
}

/// What was measured at one time.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Frame {
    frame: u64,
    #[serde(default)]
    time: f64,
    /// a point that lacks a coordinate was not measured
    points: Vec<Option<[Option<f64>; 3]>>,
    #[serde(default)]
    sigmas: Vec<Option<f64>>,
}

impl From<Frame> for v1::LiveFrame {
    fn from(frame: Frame) -> Self {
        Self {
            frame: frame.frame,
            time: frame.time,
            positions_m: frame.points.into_iter().flat_map(position).collect(),
            sigmas_m: frame.sigmas.into_iter().map(|s| s.unwrap_or(f64::NAN)).collect(),
        }
    }
}

/// NaN unless all three coordinates were measured.
fn position(point: Option<[Option<f64>; 3]>) -> [f64; 3] {
    match point {
        Some([Some(x), Some(y), Some(z)]) => [x, y, z],
        _ => [f64::NAN; 3],
    }
}

/// A message that makes no sense, and which frame it is, if it says so.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Nonsense {
    pub frame: Option<u64>,
    pub what: String,
}

/// Reads a text message.
pub(super) fn read_text(text: &str) -> Result<FromClient, Nonsense> {
    parse(text).map_err(|error| {
        let frame = serde_json::from_str::<Value>(text).ok().and_then(|value| value["frame"].as_u64());
        let what = match frame {
            Some(number) => format!("frame {number}: {error}"),
            None => error.to_string(),
        };
        Nonsense { frame, what }
    })
}

/// A message, in the words of requests where it is none.
fn parse(text: &str) -> Result<FromClient, Error> {
    let mut message = json::parse("the message", text.as_bytes())?;
    if !message.is_object() {
        return Err(Error::Unprocessable("the message is no object, expected {\"type\": …}".into()));
    }
    let head: Head = json::read(&message)?;
    if let Some(fields) = message.as_object_mut() {
        fields.remove("type");
    }
    Ok(match head.kind {
        Kind::Start => FromClient::Start(json::read(&message)?),
        Kind::Frame => FromClient::Frame(json::read(&message)?),
        Kind::End => FromClient::End,
    })
}

/// Reads a binary frame: number (u64), time (f64), x y z of every point (f32, NaN where not measured), little-endian.
pub(super) fn read_binary(bytes: &[u8]) -> Result<v1::LiveFrame, Nonsense> {
    let Some((number, rest)) = bytes.split_first_chunk::<8>() else {
        return Err(Nonsense {
            frame: None,
            what: format!("a binary frame of {} bytes, expected at least 16", bytes.len()),
        });
    };
    let number = u64::from_le_bytes(*number);
    let numbers = rest.split_first_chunk::<8>().map(|(time, rest)| (time, rest.as_chunks::<12>()));
    let Some((time, (points, []))) = numbers else {
        let what =
            format!("a binary frame of {} bytes, expected {FRAME_HEADER} and 12 for each point", bytes.len());
        return Err(Nonsense { frame: Some(number), what });
    };
    let coordinates = points.iter().flat_map(|p| p.as_chunks::<4>().0);
    Ok(v1::LiveFrame {
        frame: number,
        time: f64::from_le_bytes(*time),
        positions_m: coordinates.map(|c| f64::from(f32::from_le_bytes(*c))).collect(),
        sigmas_m: Vec::new(),
    })
}

/// What the server says.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum ToClient<'a> {
    Started {
        motion_database: &'a str,
        points: &'a [String],
        dofs: &'a [String],
        joints: &'a [String],
        parents: &'a [i32],
        resumed: bool,
        parameters: Value,
    },
    Pose {
        frame: u64,
        time: f64,
        dropped: u64,
        pose: Option<&'a [f64]>,
        #[serde(skip_serializing_if = "Option::is_none")]
        joints: Option<&'a [[f64; 3]]>,
        residual_m: f64,
        sigma_rad: f64,
        energy: f64,
        measured: u32,
        starting: bool,
    },
    State {
        frame: u64,
        state: String,
    },
    Error {
        frame: Option<u64>,
        message: &'a str,
    },
}

/// What answers are written with.
#[derive(Debug, Clone)]
pub(super) struct Writer {
    /// `name@version`
    pub motion_database: String,
    pub points: Vec<String>,
    pub is_binary: bool,
}

impl Writer {
    /// An answer of a service as a message; `None` for one of a kind that is not known yet.
    pub fn message(&self, response: &v1::LiveResponse) -> Option<Message> {
        Some(match response.message.as_ref()? {
            live_response::Message::Started(started) => text(&ToClient::Started {
                motion_database: &self.motion_database,
                points: &self.points,
                dofs: &started.dof_names,
                joints: &started.joint_names,
                parents: &started.joint_parents,
                resumed: started.is_resumed,
                parameters: serde_json::from_str(&started.parameters_json).unwrap_or_default(),
            }),
            live_response::Message::Pose(pose) if self.is_binary => Message::binary(binary_pose(pose)),
            live_response::Message::Pose(pose) => text(&ToClient::Pose {
                frame: pose.frame,
                time: pose.time,
                dropped: pose.dropped,
                pose: (!pose.pose.is_empty()).then_some(&pose.pose),
                joints: (!pose.joint_positions_m.is_empty())
                    .then_some(pose.joint_positions_m.as_chunks::<3>().0),
                residual_m: pose.residual_m,
                sigma_rad: pose.sigma_rad,
                energy: pose.energy,
                measured: pose.measured_points,
                starting: pose.is_starting,
            }),
            live_response::Message::State(state) => {
                text(&ToClient::State { frame: state.frame, state: BASE64_STANDARD.encode(&state.state) })
            }
        })
    }
}

/// Why a stream ends, before it does.
pub(super) fn error(frame: Option<u64>, message: &str) -> Message {
    text(&ToClient::Error { frame, message })
}

fn text(message: &ToClient<'_>) -> Message {
    // Strings and numbers always are JSON.
    Message::text(serde_json::to_string(message).unwrap_or_default())
}

/// Number (u64), time (f64), dropped (u64), measured points and flags (u32), residual, sigma, energy and a 0 (f32), then the
/// pose and the positions of the joints (f32), little-endian.
fn binary_pose(pose: &v1::LivePose) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(48 + 4 * (pose.pose.len() + pose.joint_positions_m.len()));
    bytes.extend_from_slice(&pose.frame.to_le_bytes());
    bytes.extend_from_slice(&pose.time.to_le_bytes());
    bytes.extend_from_slice(&pose.dropped.to_le_bytes());
    bytes.extend_from_slice(&pose.measured_points.to_le_bytes());
    let has_pose = if pose.pose.is_empty() { 0 } else { HAS_POSE };
    let is_starting = if pose.is_starting { IS_STARTING } else { 0 };
    bytes.extend_from_slice(&(has_pose | is_starting).to_le_bytes());
    let header = [pose.residual_m, pose.sigma_rad, pose.energy, 0.0];
    for number in header.iter().chain(&pose.pose).chain(&pose.joint_positions_m) {
        bytes.extend_from_slice(&(*number as f32).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_null_where_nothing_was_measured() {
        let text = r#"{"type":"frame","frame":7,"time":0.5,"points":[[1,2,3],null],"sigmas":[0.01,null]}"#;
        let Ok(FromClient::Frame(frame)) = read_text(text) else { panic!() };
        let frame = v1::LiveFrame::from(frame);
        assert_eq!((frame.frame, &frame.positions_m[..3]), (7, &[1.0, 2.0, 3.0][..]));
        assert!(frame.positions_m[3..].iter().all(|v| v.is_nan()) && frame.sigmas_m[1].is_nan());
    }

    #[test]
    fn a_point_that_lacks_a_coordinate_was_not_measured() {
        let text = r#"{"type":"frame","frame":8,"points":[[1,null,3],[4,5,6]]}"#;
        let Ok(FromClient::Frame(frame)) = read_text(text) else { panic!() };
        let positions = v1::LiveFrame::from(frame).positions_m;
        assert!(positions[..3].iter().all(|v| v.is_nan()));
        assert_eq!(positions[3..], [4.0, 5.0, 6.0]);
    }

    #[test]
    fn nonsense_is_named_with_its_frame() {
        for (text, frame) in [
            (r#"{"type":"frame","frame":12,"points":[[1,2]]}"#, Some(12)),
            (r#"{"type":"frame","frame":13,"points":[[1,2,"x"]]}"#, Some(13)),
            (r#"{"type":"frame","frame":-1,"points":[]}"#, None),
            (r#"{"type":"frame","frame":14,"points":[],"more":1}"#, Some(14)),
            (r#"{"type":"dance","frame":15}"#, Some(15)),
            ("{", None),
            ("", None),
        ] {
            assert_eq!(read_text(text).unwrap_err().frame, frame, "{text}");
        }
        for length in (0..60).filter(|n| *n < 16 || n % 12 != 4) {
            let frame = (length >= 8).then_some(0);
            assert_eq!(read_binary(&vec![0; length]).unwrap_err().frame, frame, "{length} bytes");
        }
        assert_eq!(read_binary(&[0; 40]).unwrap().positions_m, [0.0; 6]);
    }

    #[test]
    fn nonsense_is_named_by_field_in_plain_words() {
        for (text, expected) in [
            (r#"{"type":"dance","frame":15}"#, "frame 15: type is \"dance\", expected start, frame or end"),
            (r#"{"frame":15}"#, "frame 15: type is missing"),
            ("[1]", "the message is no object, expected {\"type\": …}"),
            (
                r#"{"type":"frame","frame":"a","points":[]}"#,
                "frame is \"a\", expected a whole number of 0 or more",
            ),
            (
                r#"{"type":"frame","frame":13,"points":[[1,2,"x"]]}"#,
                "frame 13: points[0][2] is \"x\", expected a number",
            ),
            (
                r#"{"type":"frame","frame":12,"points":[null,[1,2]]}"#,
                "frame 12: points[1] is an array of 2, expected one of 3",
            ),
            (
                r#"{"type":"frame","frame":14,"points":[],"more":1}"#,
                "frame 14: more is not known; there are: frame, time, points, sigmas",
            ),
            (r#"{"type":"start","points":"head"}"#, "points is \"head\", expected an array"),
            (
                r#"{"type":"start","points":[],"delivery":"all"}"#,
                "delivery is \"all\", expected latest or every",
            ),
            (r#"{"type":"start"}"#, "points is missing"),
        ] {
            assert_eq!(read_text(text).unwrap_err().what, expected, "{text}");
        }
        assert!(read_text("{").unwrap_err().what.starts_with("the message is not JSON: "));
        assert!(matches!(read_text(r#"{"type":"end","frame":1}"#), Ok(FromClient::End)));
    }

    #[test]
    fn a_binary_pose_has_its_numbers_where_they_are_documented() {
        let pose = v1::LivePose {
            frame: 3,
            dropped: 2,
            pose: vec![0.5; 4],
            joint_positions_m: vec![1.5; 6],
            ..Default::default()
        };
        let bytes = binary_pose(&pose);
        assert_eq!(bytes.len(), 48 + 4 * 10);
        assert_eq!(&bytes[..8], 3u64.to_le_bytes());
        assert_eq!(&bytes[16..24], 2u64.to_le_bytes());
        assert_eq!(&bytes[28..32], HAS_POSE.to_le_bytes());
        assert_eq!(&bytes[48..52], 0.5f32.to_le_bytes());
        assert_eq!(&bytes[64..68], 1.5f32.to_le_bytes());
    }
}
