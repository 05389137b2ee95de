//! Which reconstruction service follows a performer.

use std::{
    net::SocketAddr,
    str::FromStr,
    sync::{
        Arc, PoisonError, RwLock,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use proto::v1::{self, live_client::LiveClient, live_request};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status, Streaming, transport::Endpoint};

/// Requests on their way to the service.
const UNSENT: usize = 4;
/// Bytes of poses that may be under way to a reader who does not read: what HTTP/2 gives by itself.
const WINDOW_BYTES: u32 = 65_535;
const CONNECT_WAIT: Duration = Duration::from_secs(2);
const KEEP_ALIVE: Duration = Duration::from_secs(20);

/// The reconstruction services, all alike. Streams are dealt out in turn; one that has no room or can't be reached is
/// passed over. A name that stands for several addresses counts as all of them.
#[derive(Debug, Clone, Default)]
pub struct Replicas {
    /// `host:port`
    hosts: Arc<RwLock<Vec<String>>>,
    turn: Arc<AtomicUsize>,
}

/// A stream that was started.
pub(super) struct Following {
    pub requests: mpsc::Sender<v1::LiveRequest>,
    pub responses: Streaming<v1::LiveResponse>,
}

impl FromStr for Replicas {
    type Err = String;

    /// Reads `http://host:port`, several separated by commas.
    fn from_str(text: &str) -> Result<Self, String> {
        let host = |url: &str| {
            let host = url.trim().strip_prefix("http://").map(|host| host.trim_end_matches('/'));
            let host =
                host.filter(|h| h.rsplit_once(':').is_some_and(|(_, port)| port.parse::<u16>().is_ok()));
            host.map(str::to_owned)
                .ok_or_else(|| format!("{url:?}, expected http://host:port, several separated by commas"))
        };
        let hosts: Vec<String> = text.split(',').map(host).collect::<Result<_, _>>()?;
        Ok(Self { hosts: Arc::new(RwLock::new(hosts)), turn: Arc::default() })
    }
}

impl Replicas {
    /// Makes this address the only one: for those who start a service after the gateway.
    pub fn set(&self, address: SocketAddr) {
        *self.hosts.write().unwrap_or_else(PoisonError::into_inner) = vec![address.to_string()];
    }

    /// Starts a stream on the next service that takes it.
    pub(super) async fn follow(&self, start: &v1::LiveStart) -> Result<Following, Status> {
        let mut last = Status::unavailable("no reconstruction service can be reached");
        for address in self.addresses().await {
            match follow_on(address, start.clone()).await {
                Err(status) if matches!(status.code(), Code::ResourceExhausted | Code::Unavailable) => {
                    tracing::debug!(%address, %status, "a reconstruction service refuses the stream");
                    // "full" says more than "away"
                    if last.code() != Code::ResourceExhausted {
                        last = status;
                    }
                }
                result => return result,
            }
        }
        Err(last)
    }

    /// All addresses, the one whose turn it is first.
    async fn addresses(&self) -> Vec<SocketAddr> {
        let hosts = self.hosts.read().unwrap_or_else(PoisonError::into_inner).clone();
        let mut addresses = Vec::new();
        for host in hosts {
            match tokio::net::lookup_host(&host).await {
                Ok(found) => addresses.extend(found),
                Err(error) => tracing::warn!(host, %error, "a reconstruction service has no address"),
            }
        }
        addresses.sort_unstable();
        addresses.dedup();
        if !addresses.is_empty() {
            let turn = self.turn.fetch_add(1, Ordering::Relaxed) % addresses.len();
            addresses.rotate_left(turn);
        }
        addresses
    }
}

/// One connection a stream: who does not read holds up nobody else.
async fn follow_on(address: SocketAddr, start: v1::LiveStart) -> Result<Following, Status> {
    let endpoint =
        Endpoint::from_shared(format!("http://{address}")).map_err(|e| Status::internal(e.to_string()))?;
    let endpoint = endpoint
        .connect_timeout(CONNECT_WAIT)
        .tcp_nodelay(true)
        .initial_stream_window_size(WINDOW_BYTES)
        .initial_connection_window_size(WINDOW_BYTES)
        .http2_keep_alive_interval(KEEP_ALIVE);
    let channel = endpoint.connect().await.map_err(|e| Status::unavailable(e.to_string()))?;
    let (requests, receiver) = mpsc::channel(UNSENT);
    let first = v1::LiveRequest { message: Some(live_request::Message::Start(start)) };
    // There is room: nothing was sent yet.
    let _ = requests.try_send(first);
    let responses = LiveClient::new(channel).follow(ReceiverStream::new(receiver)).await?.into_inner();
    Ok(Following { requests, responses })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn streams_are_dealt_out_in_turn() {
        let replicas: Replicas =
            "http://127.0.0.1:1, http://127.0.0.1:2/,http://127.0.0.1:3".parse().unwrap();
        let mut firsts = Vec::new();
        for _ in 0..4 {
            firsts.push(replicas.addresses().await[0].port());
        }
        assert_eq!(firsts, [1, 2, 3, 1]);
    }

    #[test]
    fn an_address_without_port_is_refused() {
        for bad in ["http://a", "a:1", "https://a:1", "", "http://a:1,,"] {
            assert!(bad.parse::<Replicas>().is_err(), "{bad}");
        }
    }
}
