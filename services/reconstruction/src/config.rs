//! What reconstruction is told beside what every service is ([`service::config`]).
//!
//! | variable | default | meaning |
//! |---|---|---|
//! | `MAREY_LIVE_STREAMS` | 8 a core | live streams at once |
//! | `MAREY_LIVE_IDLE_SECS` | 60 | a live stream without frames, or whose poses nobody reads, ends after so long |

use jobs::run_json::Code;
use service::config::Variables;
use std::time::Duration;

/// Everything that reconstruction needs to know.
#[derive(Debug, Clone)]
pub struct Config {
    /// What every service needs to know.
    pub service: service::Config,
    /// Live streams.
    pub live: LiveConfig,
}

/// Live streams of one process.
#[derive(Debug, Clone)]
pub struct LiveConfig {
    /// Most streams at once; one has a thread. Default 8 a core: at 60 frames a second and half a millisecond a frame, a
    /// quarter of it.
    pub max_streams: usize,
    /// How long a stream may be without a frame, or its poses without a reader. Default 60 s.
    pub idle_timeout: Duration,
}

impl Default for LiveConfig {
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { max_streams: 8 * cores, idle_timeout: Duration::from_secs(60) }
    }
}

impl Config {
    /// Reads the variables.
    ///
    /// # Errors
    /// As [`service::Config::from_variables`].
    pub fn from_variables(variables: &Variables<'_>, code: Code) -> Result<Self, service::Error> {
        let service = service::Config::from_variables(variables, crate::DEFAULT_LISTEN, code)?;
        let mut config = Self::from(service);
        variables.set_within("MAREY_LIVE_STREAMS", &mut config.live.max_streams, 0..=100_000)?;
        let mut idle_secs = config.live.idle_timeout.as_secs();
        variables.set_within("MAREY_LIVE_IDLE_SECS", &mut idle_secs, 1..=86_400)?;
        config.live.idle_timeout = Duration::from_secs(idle_secs);
        Ok(config)
    }
}

impl From<service::Config> for Config {
    /// With the defaults.
    fn from(service: service::Config) -> Self {
        Self { service, live: LiveConfig::default() }
    }
}
