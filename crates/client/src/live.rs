//! The client's side of `/v1/live`.

use std::time::Duration;

use anyhow::{anyhow, bail};
use futures::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use model::Samples;
use serde_json::{Value, json};
use tokio::{net::TcpStream, time::timeout};
use tokio_tungstenite::{
    MaybeTlsStream, WebSocketStream, connect_async_with_config,
    tungstenite::{
        self, Message,
        client::IntoClientRequest,
        http::{HeaderValue, Uri, header},
    },
};

use crate::{Server, encode};

/// The server pings every 15 s: when nothing comes for so long it is gone.
const SILENCE: Duration = Duration::from_secs(50);

// Codes with which a WebSocket is closed.
const NORMAL: u16 = 1000;
const GOING_AWAY: u16 = 1001;
const NOTHING_SAID: u16 = 1005;
const ABNORMAL: u16 = 1006;
const RESTART: u16 = 1012;
const TRY_AGAIN: u16 = 1013;

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// A stream that was started.
pub struct Connection {
    /// takes frames
    pub sender: Sender,
    /// gives answers
    pub receiver: Receiver,
    /// what was started
    pub started: Value,
}

/// The half that takes messages.
pub struct Sender(SplitSink<Socket, Message>);

/// The half that gives answers.
pub struct Receiver {
    answers: SplitStream<Socket>,
    /// what the server had against the stream
    said: Option<String>,
    /// code and reason with which it closed
    closed: (u16, String),
}

/// The connection is gone, which may pass: another one can go on.
#[derive(Debug)]
pub struct Lost(String);

impl std::fmt::Display for Lost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Lost {}

impl Connection {
    /// Opens a WebSocket to `server` and sends `start`.
    ///
    /// # Errors
    /// Whatever the server has against it; [`Lost`] if that may pass.
    pub async fn open(server: &Server, database: &str, start: &Value) -> anyhow::Result<Self> {
        let url = server.url.trim_end_matches('/');
        let Some(host) = url.strip_prefix("http://") else {
            bail!("{url}: live streams need an http:// address, encryption is not built in");
        };
        let uri: Uri = format!("ws://{host}/v1/live?motion_database={}", encode(database)).parse()?;
        let mut request = uri.into_client_request()?;
        let bearer = HeaderValue::from_str(&format!("Bearer {}", server.api_key))?;
        request.headers_mut().insert(header::AUTHORIZATION, bearer);
        // Small frames must not wait for the acknowledgement of the last one.
        let connected = connect_async_with_config(request, None, true).await;
        let (socket, _) = connected.map_err(|error| refusal(error).context(url.to_owned()))?;
        let (sink, stream) = socket.split();
        let mut sender = Sender(sink);
        let mut receiver = Receiver { answers: stream, said: None, closed: (NOTHING_SAID, String::new()) };
        sender.send(start.to_string()).await?;
        while let Some(started) = receiver.next().await? {
            if started["type"] == "started" {
                return Ok(Self { sender, receiver, started });
            }
        }
        receiver.end()?;
        bail!("the server closed the stream before it began")
    }
}

impl Sender {
    /// Sends a text message.
    ///
    /// # Errors
    /// [`Lost`] if the connection is gone.
    pub async fn send(&mut self, text: String) -> anyhow::Result<()> {
        Ok(self.0.send(Message::text(text)).await.map_err(|error| Lost(error.to_string()))?)
    }
}

impl Receiver {
    /// The next answer; `None` when the stream is at its end.
    ///
    /// # Errors
    /// [`Lost`] if the connection breaks, or what the server said before it did.
    pub async fn next(&mut self) -> anyhow::Result<Option<Value>> {
        loop {
            let Ok(next) = timeout(SILENCE, self.answers.next()).await else {
                return Err(self.broken(format!("the server was silent for {} s", SILENCE.as_secs())));
            };
            match next {
                Some(Ok(Message::Text(text))) => {
                    let message: Value = serde_json::from_str(&text)?;
                    if message["type"] == "error" {
                        self.said = Some(message["message"].as_str().unwrap_or("an error").to_owned());
                    }
                    return Ok(Some(message));
                }
                Some(Ok(Message::Close(frame))) => {
                    if let Some(frame) = frame {
                        self.closed = (frame.code.into(), frame.reason.to_string());
                    }
                    return Ok(None);
                }
                Some(Ok(_)) => {}
                Some(Err(error)) => return Err(self.broken(error.to_string())),
                None => return Err(self.broken("the connection broke".to_owned())),
            }
        }
    }

    /// Why there are no more answers.
    ///
    /// # Errors
    /// What the server has against the stream; [`Lost`] if that may pass.
    pub fn end(self) -> anyhow::Result<()> {
        let (code, reason) = self.closed;
        end_with(code, self.said.or((!reason.is_empty()).then_some(reason)))
    }

    fn broken(&mut self, why: String) -> anyhow::Error {
        match self.said.take() {
            Some(said) => anyhow!(said),
            None => Lost(why).into(),
        }
    }
}

/// What it means that the server closed with this code.
fn end_with(code: u16, said: Option<String>) -> anyhow::Result<()> {
    match (code, said) {
        (GOING_AWAY | ABNORMAL | RESTART | TRY_AGAIN, said) => {
            Err(Lost(said.unwrap_or_else(|| format!("the server closed with code {code}"))).into())
        }
        (NORMAL, _) | (NOTHING_SAID, None) => Ok(()),
        (_, Some(said)) => Err(anyhow!(said)),
        (_, None) => Err(anyhow!("the server closed the stream with code {code}")),
    }
}

/// A frame's message. `time`: seconds, comes back with the pose. A point with a coordinate that is not finite was not
/// measured.
pub fn frame_message(frame: u64, time: f64, samples: Samples<'_>) -> String {
    let positions = samples.positions.iter();
    let points: Vec<_> =
        positions.map(|p| p.iter().all(|v| v.is_finite()).then_some([p.x, p.y, p.z])).collect();
    let mut message = json!({ "type": "frame", "frame": frame, "time": time, "points": points });
    if !samples.sigmas.is_empty() {
        let sigmas = (0..samples.positions.len()).map(|point| samples.sigma(point));
        message["sigmas"] = sigmas.collect::<Vec<_>>().into();
    }
    message.to_string()
}

/// What the server answered instead of opening a WebSocket.
fn refusal(error: tungstenite::Error) -> anyhow::Error {
    let response = match error {
        tungstenite::Error::Http(response) => response,
        error => return Lost(error.to_string()).into(),
    };
    let problem = response.body().as_deref().and_then(|body| serde_json::from_slice::<Value>(body).ok());
    let detail = match problem.as_ref().and_then(|problem| problem["detail"].as_str()) {
        Some(detail) => detail.to_owned(),
        None => format!("the server answered {}", response.status()),
    };
    if response.status().is_server_error() { Lost(detail).into() } else { anyhow!(detail) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn a_point_that_lacks_a_coordinate_is_null() {
        let positions = [
            Vector3::new(1.0, 2.0, 3.0),
            Vector3::new(1.0, f64::NAN, 3.0),
            Vector3::new(1.0, 2.0, f64::INFINITY),
        ];
        let message: Value = serde_json::from_str(&frame_message(7, 0.5, (&positions[..]).into())).unwrap();
        assert_eq!(message["points"], json!([[1.0, 2.0, 3.0], null, null]));
        assert!(message.get("sigmas").is_none());
    }

    #[test]
    fn standard_deviations_go_with_their_points() {
        let positions = [Vector3::zeros(); 2];
        let samples = Samples { positions: &positions, sigmas: &[0.01, f64::NAN] };
        let message: Value = serde_json::from_str(&frame_message(1, 0.0, samples)).unwrap();
        assert_eq!(message["sigmas"], json!([0.01, null]));
    }

    #[test]
    fn what_may_pass_is_lost_and_the_rest_is_over() {
        assert!(end_with(NORMAL, None).is_ok());
        for code in [1001, 1006, 1012, 1013] {
            assert!(end_with(code, None).unwrap_err().is::<Lost>(), "{code}");
        }
        let refused = end_with(1008, Some("frame 3 has 2 coordinates".to_owned())).unwrap_err();
        assert!(!refused.is::<Lost>() && refused.to_string().starts_with("frame 3"));
        assert!(!end_with(1011, None).unwrap_err().is::<Lost>());
        // An address or the like is said beside it.
        assert!(end_with(1013, None).unwrap_err().context("http://server").is::<Lost>());
    }
}
