//! One WebSocket and its stream to a reconstruction service.

use std::time::Duration;

use axum::extract::ws::{CloseFrame, Message, WebSocket, close_code};
use futures::{
    SinkExt, StreamExt,
    stream::{SplitSink, SplitStream},
};
use proto::v1::{self, live_request};
use tokio::{
    sync::mpsc,
    time::{MissedTickBehavior, timeout},
};
use tokio_util::sync::CancellationToken;
use tonic::{Code, Status, Streaming};

use super::{
    chosen::Chosen,
    messages::{self, FromClient, Nonsense, Start, Writer},
    replicas::Following,
    shared::Live,
};

/// The first message must come within this time.
const START_WAIT: Duration = Duration::from_secs(10);
/// From ping to ping.
const PING_EVERY: Duration = Duration::from_secs(15);
/// A client that does not even answer pings for so long is gone.
const SILENCE: Duration = Duration::from_secs(50);
/// A client that does not read for so long is gone.
const STANDSTILL: Duration = Duration::from_secs(60);
/// Longest reason of a closing, bytes: the protocol's limit.
const MAX_REASON: usize = 123;

/// Why a stream ends.
#[derive(Debug)]
struct End {
    code: u16,
    reason: String,
    /// which frame is to blame
    frame: Option<u64>,
}

impl End {
    fn new(code: u16, reason: impl Into<String>) -> Self {
        Self { code, reason: reason.into(), frame: None }
    }
}

impl From<Nonsense> for End {
    fn from(nonsense: Nonsense) -> Self {
        Self { code: close_code::POLICY, reason: nonsense.what, frame: nonsense.frame }
    }
}

impl From<Status> for End {
    fn from(status: Status) -> Self {
        let code = match status.code() {
            Code::Ok => close_code::NORMAL,
            Code::ResourceExhausted => close_code::AGAIN,
            Code::Unavailable => close_code::RESTART,
            Code::Internal | Code::Unknown => close_code::ERROR,
            _ => close_code::POLICY,
        };
        // Messages about a frame begin with it.
        let number = status.message().strip_prefix("frame ").and_then(|rest| {
            rest.split(|c: char| !c.is_ascii_digit()).next().and_then(|number| number.parse().ok())
        });
        Self { code, reason: status.message().to_owned(), frame: number }
    }
}

/// Serves one WebSocket to its end.
pub(crate) async fn serve(live: Live, socket: WebSocket, chosen: Chosen) {
    let (mut sink, mut stream) = socket.split();
    let end = match open(&live, &mut stream, chosen).await {
        Ok((following, writer)) => both_ways(&live, &mut sink, &mut stream, following, &writer).await,
        Err(end) => end,
    };
    if end.code != close_code::NORMAL && end.code != close_code::AWAY {
        let _ = timeout(STANDSTILL, sink.send(messages::error(end.frame, &end.reason))).await;
    }
    let mut reason = end.reason;
    reason.truncate(reason.floor_char_boundary(MAX_REASON));
    let close = Message::Close(Some(CloseFrame { code: end.code, reason: reason.into() }));
    let _ = timeout(STANDSTILL, sink.send(close)).await;
    // What the client still sends is read until it closes too, or its last words would be lost to it.
    let _ = timeout(START_WAIT, async { while let Some(Ok(_)) = stream.next().await {} }).await;
}

/// Reads the first message and starts a stream.
async fn open(
    live: &Live,
    stream: &mut SplitStream<WebSocket>,
    chosen: Chosen,
) -> Result<(Following, Writer), End> {
    let policy = |reason: String| End::new(close_code::POLICY, reason);
    let first = tokio::select! {
        first = timeout(START_WAIT, next_message(stream)) => first,
        () = live.shutdown.cancelled() => return Err(End::new(close_code::AWAY, "the server is shutting down")),
    };
    let first = first.map_err(|_| policy("no start message arrived within 10 seconds".to_owned()))?;
    let start: Start = match first {
        Some(Message::Text(text)) => match messages::read_text(&text)? {
            FromClient::Start(start) => start,
            _ => return Err(policy("the first message is not a start".to_owned())),
        },
        Some(_) => return Err(policy("the first message is not a start, as text".to_owned())),
        None => return Err(End::new(close_code::NORMAL, "")),
    };
    let parameters = chosen.parameters(start.parameters.clone(), !start.skeleton_asf.is_empty());
    let parameters = parameters.map_err(|error| policy(error.to_string()))?;
    let wire = start.to_wire(&chosen.database_id, parameters).map_err(policy)?;
    let following = live.replicas.follow(&wire).await?;
    let writer = Writer { motion_database: chosen.database, points: start.points, is_binary: start.binary };
    Ok((following, writer))
}

/// Frames in and answers out until one side ends.
async fn both_ways(
    live: &Live,
    sink: &mut SplitSink<WebSocket, Message>,
    stream: &mut SplitStream<WebSocket>,
    following: Following,
    writer: &Writer,
) -> End {
    let Following { requests, responses } = following;
    let written = CancellationToken::new();
    let reading = async {
        // Dropping the sender ends the frames: the service then sends its last state.
        let requests = requests;
        tokio::select! {
            end = read(stream, &requests) => Some(end),
            () = live.shutdown.cancelled() => {
                Some(End::new(close_code::AWAY, "the server is shutting down; go on with the last state"))
            }
            () = written.cancelled() => None,
        }
    };
    let writing = async {
        let end = write(sink, responses, writer).await;
        written.cancel();
        end
    };
    match tokio::join!(reading, writing) {
        // What the service has against it says more than that there is an end.
        (_, Some(end)) if end.code != close_code::NORMAL => end,
        (Some(end), _) => end,
        _ => End::new(close_code::NORMAL, ""),
    }
}

/// Passes frames on until there are no more.
async fn read(stream: &mut SplitStream<WebSocket>, requests: &mpsc::Sender<v1::LiveRequest>) -> End {
    loop {
        let Ok(message) = timeout(SILENCE, next_message(stream)).await else {
            return End::new(close_code::POLICY, "no message and no answer to a ping for 50 seconds");
        };
        let frame = match message {
            Some(Message::Binary(bytes)) => messages::read_binary(&bytes),
            Some(Message::Text(text)) => match messages::read_text(&text) {
                Ok(FromClient::Frame(frame)) => Ok(frame.into()),
                Ok(FromClient::End) => return End::new(close_code::NORMAL, ""),
                Ok(FromClient::Start(_)) => {
                    Err(Nonsense { frame: None, what: "a second start, expected frames".to_owned() })
                }
                Err(nonsense) => Err(nonsense),
            },
            // a ping or its answer: alive
            Some(_) => continue,
            None => return End::new(close_code::NORMAL, ""),
        };
        let frame = match frame {
            Ok(frame) => frame,
            Err(nonsense) => return nonsense.into(),
        };
        let request = v1::LiveRequest { message: Some(live_request::Message::Frame(frame)) };
        if requests.send(request).await.is_err() {
            // The service has ended the stream, and says why on its side.
            return End::new(close_code::NORMAL, "");
        }
    }
}

/// The next message; `None` when there will be none.
async fn next_message(stream: &mut SplitStream<WebSocket>) -> Option<Message> {
    match stream.next().await {
        Some(Ok(Message::Close(_)) | Err(_)) | None => None,
        Some(Ok(message)) => Some(message),
    }
}

/// Passes answers on until there are no more; why, if it was not the client who went.
async fn write(
    sink: &mut SplitSink<WebSocket, Message>,
    mut responses: Streaming<v1::LiveResponse>,
    writer: &Writer,
) -> Option<End> {
    let mut pings = tokio::time::interval(PING_EVERY);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let message = tokio::select! {
            response = responses.message() => match response {
                Ok(Some(response)) => writer.message(&response),
                Ok(None) => return Some(End::new(close_code::NORMAL, "")),
                Err(status) => return Some(status.into()),
            },
            _ = pings.tick() => Some(Message::Ping(Default::default())),
        };
        let Some(message) = message else { continue };
        match timeout(STANDSTILL, sink.send(message)).await {
            Ok(Ok(())) => {}
            Ok(Err(_)) => return None,
            Err(_) => return Some(End::new(close_code::POLICY, "nothing was read for 60 seconds")),
        }
    }
}
