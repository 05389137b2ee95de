//! The client's side of `/v1/live`.

use anyhow::{Context, anyhow, bail};
use futures::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use model::Samples;
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::{
    MaybeTlsStream, WebSocketStream, connect_async_with_config,
    tungstenite::{
        self, Message,
        client::IntoClientRequest,
        http::{HeaderValue, Uri, header},
    },
};

use crate::{client::encode, connection::Server};

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
pub struct Receiver(SplitStream<Socket>);

impl Connection {
    /// Opens a WebSocket to `server` and sends `start`.
    ///
    /// # Errors
    /// Whatever the server has against it.
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
        let (mut sender, mut receiver) = (Sender(sink), Receiver(stream));
        sender.send(start.to_string()).await?;
        let started = receiver.next().await?.context("the server closed the stream before it began")?;
        if started["type"] != "started" {
            bail!("{}", started["message"].as_str().unwrap_or("the server started nothing"));
        }
        Ok(Self { sender, receiver, started })
    }
}

impl Sender {
    /// Sends a text message.
    ///
    /// # Errors
    /// If the connection is gone.
    pub async fn send(&mut self, text: String) -> anyhow::Result<()> {
        Ok(self.0.send(Message::text(text)).await?)
    }
}

impl Receiver {
    /// The next answer; `None` when the stream is at its end.
    ///
    /// # Errors
    /// If the connection breaks.
    pub async fn next(&mut self) -> anyhow::Result<Option<Value>> {
        while let Some(message) = self.0.next().await {
            match message? {
                Message::Text(text) => return Ok(Some(serde_json::from_str(&text)?)),
                Message::Close(_) => return Ok(None),
                _ => {}
            }
        }
        Ok(None)
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
    let tungstenite::Error::Http(response) = error else { return error.into() };
    let problem = response.body().as_deref().and_then(|body| serde_json::from_slice::<Value>(body).ok());
    match problem.as_ref().and_then(|problem| problem["detail"].as_str()) {
        Some(detail) => anyhow!("{detail}"),
        None => anyhow!("the server answered {}", response.status()),
    }
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
}
