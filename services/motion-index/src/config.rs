//! What motion-index is told beside what every service is ([`service::config`]).
//!
//! | variable | default | meaning |
//! |---|---|---|
//! | `MAREY_MOTION_INDEX_PEERS` | none | addresses of all motion-index replicas, `http://a:50051,http://b:50051` |
//! | `MAREY_MOTION_INDEX_SELF` | none | which of them this one is |

use jobs::run_json::Code;
use service::config::Variables;

/// Everything that motion-index needs to know.
#[derive(Debug, Clone)]
pub struct Config {
    /// What every service needs to know.
    pub service: service::Config,
    /// Other replicas.
    pub peers: PeersConfig,
}

/// The replicas of motion-index that share the shards of large databases among themselves.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PeersConfig {
    /// Addresses of all of them, this one's too, such as `http://10.0.0.7:50051`; the same on each. None: this one
    /// answers alone.
    pub all: Vec<String>,
    /// Which of them this one is; without it, it asks itself over the network.
    pub own: Option<String>,
}

impl Config {
    /// Reads the variables.
    ///
    /// # Errors
    /// As [`service::Config::from_variables`].
    pub fn from_variables(variables: &Variables<'_>, code: Code) -> Result<Self, service::Error> {
        let service = service::Config::from_variables(variables, crate::DEFAULT_LISTEN, code)?;
        let peers = PeersConfig {
            all: variables.list("MAREY_MOTION_INDEX_PEERS"),
            own: variables.get("MAREY_MOTION_INDEX_SELF"),
        };
        Ok(Self { service, peers })
    }
}

impl From<service::Config> for Config {
    /// Without other replicas.
    fn from(service: service::Config) -> Self {
        Self { service, peers: PeersConfig::default() }
    }
}
