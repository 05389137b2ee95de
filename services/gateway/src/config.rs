use std::{net::SocketAddr, time::Duration};

use store::Location;

use crate::Replicas;

/// What the gateway needs to know, read once at the start.
#[derive(Debug, Clone)]
pub struct Config {
    /// PostgreSQL connection URL (`MAREY_DATABASE_URL`)
    pub database_url: String,
    /// the object store (`MAREY_STORE`)
    pub store: Location,
    /// address to listen on (`MAREY_LISTEN`, default 127.0.0.1:8080: not reachable from outside unless asked for)
    pub listen: SocketAddr,
    /// largest upload, bytes (`MAREY_MAX_UPLOAD_BYTES`, default 512 MiB: a subject's trials as an archive are some
    /// tens of megabytes)
    pub max_upload_bytes: u64,
    /// longest wait for the next bytes of an upload (default 60 s, so that a dead client frees its connection)
    pub upload_stall: Duration,
    /// longest time for any other request (default 30 s; uploads, downloads and event streams excepted)
    pub request_timeout: Duration,
    /// PostgreSQL connections to hold at most (default 16)
    pub max_connections: u32,
    /// the reconstruction services that live streams go to (`MAREY_RECONSTRUCTION`, default `http://127.0.0.1:50052`;
    /// several separated by commas)
    pub reconstruction: Replicas,
    /// an API key to be valid from the start, with all scopes on project `default` (`MAREY_BOOTSTRAP_KEY`); for
    /// deployments that make their keys elsewhere
    pub bootstrap_key: Option<String>,
}

/// Default for [`Config::max_upload_bytes`], bytes.
pub const DEFAULT_MAX_UPLOAD_BYTES: u64 = 512 << 20;

/// Default for [`Config::reconstruction`]: the service's own.
const DEFAULT_RECONSTRUCTION: &str = "http://127.0.0.1:50052";

impl Config {
    /// The defaults, with a database and a store.
    pub fn new(database_url: impl Into<String>, store: Location) -> Self {
        Self {
            database_url: database_url.into(),
            store,
            listen: SocketAddr::from(([127, 0, 0, 1], 8080)),
            max_upload_bytes: DEFAULT_MAX_UPLOAD_BYTES,
            upload_stall: Duration::from_secs(60),
            request_timeout: Duration::from_secs(30),
            max_connections: 16,
            reconstruction: Replicas::default(),
            bootstrap_key: None,
        }
    }

    /// Reads the configuration from `MAREY_…` variables; `variable` is `std::env::var(name).ok()` outside tests.
    ///
    /// # Errors
    /// If one is missing or can't be read, naming it.
    pub fn from_variables(variable: impl Fn(&str) -> Option<String>) -> anyhow::Result<Self> {
        // as for all services: what is empty is not set
        let variable = |name: &str| variable(name).filter(|value| !value.is_empty());
        let required = |name: &str| variable(name).ok_or_else(|| anyhow::anyhow!("{name} is not set"));
        let store = required("MAREY_STORE")?;
        let mut config = Self::new(
            required("MAREY_DATABASE_URL")?,
            store.parse().map_err(|e| anyhow::anyhow!("MAREY_STORE: {e}"))?,
        );
        if let Some(listen) = variable("MAREY_LISTEN") {
            config.listen = listen.parse().map_err(|_| {
                anyhow::anyhow!("MAREY_LISTEN is {listen:?}, expected an address like 0.0.0.0:8080")
            })?;
        }
        if let Some(bytes) = variable("MAREY_MAX_UPLOAD_BYTES") {
            config.max_upload_bytes = bytes.parse().ok().filter(|bytes| *bytes > 0).ok_or_else(|| {
                anyhow::anyhow!("MAREY_MAX_UPLOAD_BYTES is {bytes:?}, expected a number of bytes above 0")
            })?;
        }
        let replicas = variable("MAREY_RECONSTRUCTION");
        let replicas = replicas.unwrap_or_else(|| DEFAULT_RECONSTRUCTION.to_owned());
        config.reconstruction =
            replicas.parse().map_err(|e| anyhow::anyhow!("MAREY_RECONSTRUCTION has {e}"))?;
        config.bootstrap_key = variable("MAREY_BOOTSTRAP_KEY");
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables<'a>(set: &'a [(&'a str, &'a str)]) -> impl Fn(&str) -> Option<String> + 'a {
        |name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| v.to_string())
    }

    #[test]
    fn a_missing_variable_is_named() {
        let error = Config::from_variables(variables(&[("MAREY_STORE", "/x")])).unwrap_err();
        assert_eq!(error.to_string(), "MAREY_DATABASE_URL is not set");
    }

    #[test]
    fn a_bad_number_is_named() {
        let set =
            [("MAREY_STORE", "/x"), ("MAREY_DATABASE_URL", "postgres://"), ("MAREY_MAX_UPLOAD_BYTES", "1GB")];
        let error = Config::from_variables(variables(&set)).unwrap_err();
        assert!(error.to_string().starts_with("MAREY_MAX_UPLOAD_BYTES is \"1GB\""), "{error}");
    }
}
