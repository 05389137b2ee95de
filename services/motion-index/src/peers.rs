//! The replicas of this service, and which of them answers for which shard.

use crate::config::PeersConfig;
use proto::v1::motion_index_client::MotionIndexClient;
use std::{
    sync::Mutex,
    time::{Duration, Instant},
};
use tonic::{
    Code, Status,
    transport::{Channel, Endpoint},
};
use uuid::Uuid;

/// A replica that does not take a connection in this time is down.
const CONNECT_WITHIN: Duration = Duration::from_secs(1);
/// Longest answer; a replica that is asked for a shard for the first time reads and indexes it.
const ANSWER_WITHIN: Duration = Duration::from_secs(60);
/// A replica that was down is not asked again for so long.
const REST: Duration = Duration::from_secs(5);

/// An address of a replica that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{found:?} is not the address of a motion-index replica, expected one such as http://10.0.0.7:50051: {reason}"
)]
pub struct BadPeer {
    /// What was configured.
    pub found: String,
    /// What is wrong with it.
    pub reason: String,
}

pub(crate) struct Peers {
    all: Vec<Peer>,
}

struct Peer {
    address: String,
    /// none for this replica
    client: Option<MotionIndexClient<Channel>>,
    down_since: Mutex<Option<Instant>>,
}

impl Peers {
    /// # Errors
    /// [`BadPeer`].
    pub fn new(config: &PeersConfig) -> Result<Self, BadPeer> {
        let peer = |address: &String| {
            let bad = |e: tonic::transport::Error| BadPeer { found: address.clone(), reason: e.to_string() };
            let endpoint = Endpoint::from_shared(address.clone()).map_err(bad)?;
            let channel = endpoint.connect_timeout(CONNECT_WITHIN).timeout(ANSWER_WITHIN).connect_lazy();
            let is_own = config.own.as_ref() == Some(address);
            let client = (!is_own).then(|| MotionIndexClient::new(channel));
            Ok(Peer { address: address.clone(), client, down_since: Mutex::new(None) })
        };
        Ok(Self { all: config.all.iter().map(peer).collect::<Result<_, _>>()? })
    }

    /// The replica that answers for a shard, unless it is this one, or down.
    pub fn for_shard(&self, database: Uuid, shard: usize) -> Option<AskedPeer<'_>> {
        let owner =
            self.all.iter().max_by_key(|peer| (weight(&peer.address, database, shard), &peer.address))?;
        let is_down = lock(&owner.down_since).is_some_and(|since| since.elapsed() < REST);
        let client = owner.client.clone().filter(|_| !is_down)?;
        Some(AskedPeer { peer: owner, client })
    }
}

/// A replica to be asked.
pub(crate) struct AskedPeer<'p> {
    peer: &'p Peer,
    pub client: MotionIndexClient<Channel>,
}

impl AskedPeer<'_> {
    /// Whether a refusal says that the replica is down, and not that the question is bad. It is left alone for a while
    /// then.
    pub fn is_down(&self, status: &Status) -> bool {
        let is_down = matches!(
            status.code(),
            Code::Unavailable
                | Code::DeadlineExceeded
                | Code::Cancelled
                | Code::Unknown
                | Code::Unimplemented
        );
        if is_down {
            tracing::warn!(peer = self.peer.address, %status, "a replica does not answer, its shard is opened here");
            *lock(&self.peer.down_since) = Some(Instant::now());
        }
        is_down
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // A panic of a holder leaves nothing half-done in an instant.
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Rendezvous hashing: the peer of the greatest weight has the shard. When one goes, only its shards move.
fn weight(address: &str, database: Uuid, shard: usize) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(address.as_bytes());
    hasher.update(database.as_bytes());
    hasher.update(&(shard as u64).to_le_bytes());
    *hasher.finalize().as_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner<'a>(peers: &[&'a str], shard: usize) -> &'a str {
        peers.iter().max_by_key(|peer| weight(peer, Uuid::nil(), shard)).unwrap()
    }

    #[test]
    fn when_a_replica_goes_only_its_shards_move() {
        let all = ["http://a", "http://b", "http://c"];
        let mut counts = [0; 3];
        for shard in 0..300 {
            let before = owner(&all, shard);
            counts[all.iter().position(|p| *p == before).unwrap()] += 1;
            let after = owner(&all[..2], shard);
            assert!(after == before || before == "http://c", "shard {shard}");
        }
        assert!(counts.iter().all(|count| (60..140).contains(count)), "{counts:?}");
    }

    #[tokio::test]
    async fn addresses_that_are_none_are_refused() {
        let config = PeersConfig { all: vec!["not an address".to_owned()], own: None };
        let error = Peers::new(&config).err().unwrap();
        assert!(error.to_string().contains("not an address"), "{error}");
    }
}
