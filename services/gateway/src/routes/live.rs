//! `/v1/live`: a WebSocket on which a performer is followed.

use axum::{
    extract::{
        FromRequestParts,
        ws::{WebSocketUpgrade, rejection::WebSocketUpgradeRejection},
    },
    http::{HeaderValue, header, request::Parts},
    response::Response,
};
use serde::Deserialize;
use utoipa::IntoParams;

use crate::{
    App,
    access::Writer,
    error::{Error, Result},
    extract::Query,
    live::{self, Chosen},
    versioned::{self, Latest, MotionDatabase},
};

/// Name of the messages' language, as a WebSocket subprotocol.
const PROTOCOL: &str = "marey.live.v1";
/// What the subprotocol that carries an API key begins with.
const KEY_PROTOCOL: &str = "marey.key.";
/// Largest message, bytes: a start with its skeleton and state.
const MAX_MESSAGE_BYTES: usize = 2 << 20;
/// What is written and not yet taken by the network, bytes.
const MAX_UNWRITTEN_BYTES: usize = 256 << 10;

/// What a stream is opened with.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct LiveQuery {
    /// the motion database to learn from: id, `name` (its latest version that is ready) or `name@version`
    #[param(example = "walks")]
    motion_database: String,
}

/// A caller who may follow performers. Browsers can't set headers of a WebSocket: they name the key as a subprotocol.
#[derive(Debug)]
pub(super) struct Follower(Writer);

impl FromRequestParts<App> for Follower {
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &App) -> Result<Self> {
        if !parts.headers.contains_key(header::AUTHORIZATION) {
            let protocols = parts.headers.get_all(header::SEC_WEBSOCKET_PROTOCOL).iter();
            let protocols = protocols.filter_map(|value| value.to_str().ok()).flat_map(|v| v.split(','));
            let key = protocols.filter_map(|p| p.trim().strip_prefix(KEY_PROTOCOL)).next();
            if let Some(Ok(bearer)) = key.map(|key| HeaderValue::from_str(&format!("Bearer {key}"))) {
                parts.headers.insert(header::AUTHORIZATION, bearer);
            }
        }
        Ok(Self(Writer::from_request_parts(parts, app).await?))
    }
}

/// Follow a performer
///
/// A WebSocket: frames of control points in, poses out, one frame of latency. The first message says what is measured:
/// `{"type": "start", "points": ["left_wrist", …], "joint_positions": true}`; then
/// `{"type": "frame", "frame": 1, "time": 0.0, "points": [[x, y, z], null, …]}`, 60 a second, metres, y up. The messages,
/// their binary form, back-pressure and how to go on after a broken connection are described in `docs/live.md`.
///
/// The key comes in the `Authorization` header or, from browsers, as the subprotocol `marey.key.mk_…` beside `marey.live.v1`.
#[utoipa::path(
    get, path = "/v1/live", tag = "live", params(LiveQuery),
    responses((status = 101, description = "the WebSocket is open")),
)]
pub(super) async fn follow(
    Follower(Writer(by)): Follower,
    Query(query): Query<LiveQuery>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response> {
    let database: MotionDatabase = versioned::look(&by, &query.motion_database, Latest::Ready).await?;
    let ready = database.ready()?;
    let chosen =
        Chosen { database_id: ready.id.to_string(), database: format!("{}@{}", ready.name, ready.version) };
    let upgrade = upgrade
        .map_err(|rejection| Error::BadRequest(format!("expected a WebSocket: {}", rejection.body_text())))?;
    let upgrade = upgrade
        .protocols([PROTOCOL])
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES)
        .max_write_buffer_size(MAX_UNWRITTEN_BYTES);
    let serving = by.app.live.tasks.clone();
    Ok(upgrade.on_upgrade(move |socket| serving.track_future(live::serve(by.app.live, socket, chosen))))
}
