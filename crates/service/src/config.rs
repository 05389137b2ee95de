//! Configuration: one struct per concern, read once at start.
//!
//! | variable | default | meaning |
//! |---|---|---|
//! | `MAREY_DATABASE_URL` | – | PostgreSQL, `postgres://user@host/name` |
//! | `MAREY_DATABASE_CONNECTIONS` | 8 | most connections of this process, beside three of the worker loop |
//! | `MAREY_STORE` | – | object store: a folder, `file://…` or `s3://bucket/prefix` |
//! | `MAREY_LISTEN` | by service | address of the gRPC server |
//! | `MAREY_WORKER_CONCURRENCY` | number of cores | jobs at once; 0 serves gRPC only |
//! | `MAREY_WORKER_NAME` | service, host, process id | how this process shows in the queue and in `run.json` |
//! | `MAREY_SHUTDOWN_GRACE_SECS` | 20 | how long calls and jobs may go on after a signal |
//! | `MAREY_DATABASE_CACHE_BYTES` | 2 GiB | what was learned and is kept in memory from one use to the next |
//! | `MAREY_MAX_OBJECT_BYTES` | 1 GiB | largest object read into memory |
//! | `MAREY_MAX_INPUT_BYTES` | 8 GiB | unpacked files of one build |
//! | `MAREY_MAX_BUILD_BYTES` | 2 GiB | what one job of a build keeps in memory: an archive unpacked, or what is built |
//! | `MAREY_MAX_SESSION_FRAMES` | 432000 | frames of one session at 60 a second: two hours |
//! | `MAREY_LOG` | `info,sqlx=warn` | filter: `info`, `warn,motion_index=debug`, … |
//! | `MAREY_LOG_FORMAT` | `pretty` | `pretty` or `json` |

use crate::{Error, log_format::LogFormat};
use jobs::run_json::Code;
use std::{net::SocketAddr, time::Duration};
use store::Location;

pub use crate::variables::{Variables, environment};

/// Everything a service with a gRPC server and a worker needs to know.
#[derive(Debug, Clone)]
pub struct Config {
    /// PostgreSQL.
    pub database: DatabaseConfig,
    /// Where objects are.
    pub store: Location,
    /// The gRPC server.
    pub grpc: GrpcConfig,
    /// The worker loop.
    pub worker: WorkerConfig,
    /// Bounds on memory.
    pub memory: MemoryConfig,
    /// This program, as `run.json` names it.
    pub code: Code,
}

/// How to reach PostgreSQL.
#[derive(Debug, Clone)]
pub struct DatabaseConfig {
    /// `postgres://user:password@host:port/name`; `?host=/path` for a socket.
    pub url: String,
    /// Most connections of this process. Default 8: jobs hold none while they work, so a few serve many.
    pub max_connections: u32,
    /// How long to wait for a free connection. 10 s: longer than any transaction of ours.
    pub acquire_timeout: Duration,
}

/// The gRPC server.
#[derive(Debug, Clone)]
pub struct GrpcConfig {
    /// Address to listen on; port 0 takes a free one. The default is this machine only.
    pub listen: SocketAddr,
    /// How long calls may go on after shutdown was asked for; default 20 s, below Kubernetes' 30.
    pub shutdown_grace: Duration,
}

/// The worker loop.
#[derive(Debug, Clone)]
pub struct WorkerConfig {
    /// How this process shows in the queue and in `run.json`; default is made of service, host and process id.
    pub name: Option<String>,
    /// Jobs at once. Default: number of cores, as jobs are computation. 0: claim none.
    pub concurrency: usize,
    /// How long running jobs may go on after shutdown was asked for, before they are handed back.
    pub shutdown_grace: Duration,
}

impl WorkerConfig {
    /// The configured name, or `service@host/pid`.
    pub fn name(&self, service: &str) -> String {
        self.name.clone().unwrap_or_else(|| {
            let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
            format!("{service}@{}/{}", host.trim(), std::process::id())
        })
    }
}

/// Bounds on memory.
#[derive(Debug, Clone)]
pub struct MemoryConfig {
    /// What was learned and is kept for queries and jobs, bytes as counted in memory. Default 2 GiB.
    pub cache_bytes: u64,
    /// Largest object that is read into memory, bytes. Default 1 GiB: two hours of 120 fps AMC are 400 MB.
    pub max_object_bytes: u64,
    /// Unpacked files of one build, bytes. Default 8 GiB: all of the CMU library is 5.
    pub max_input_bytes: u64,
    /// What one job of a build keeps in memory, bytes: an archive unpacked, or what is built. Default 2 GiB: 2 million poses of
    /// 62 numbers.
    pub max_build_bytes: u64,
    /// Frames of one session at 60 a second. Default 432 000, two hours: putting it together takes about 4 kB a frame.
    pub max_session_frames: usize,
}

const GIB: u64 = 1 << 30;

impl Config {
    /// The defaults of a program that doesn't know its commit, for a database, a store and an address.
    pub fn new(database_url: impl Into<String>, store: Location, listen: SocketAddr) -> Self {
        let grace = Duration::from_secs(20);
        Self {
            database: DatabaseConfig {
                url: database_url.into(),
                max_connections: 8,
                acquire_timeout: Duration::from_secs(10),
            },
            store,
            grpc: GrpcConfig { listen, shutdown_grace: grace },
            worker: WorkerConfig {
                name: None,
                concurrency: std::thread::available_parallelism().map_or(1, usize::from),
                shutdown_grace: grace,
            },
            memory: MemoryConfig {
                cache_bytes: 2 * GIB,
                max_object_bytes: GIB,
                max_input_bytes: 8 * GIB,
                max_build_bytes: 2 * GIB,
                max_session_frames: 2 * 60 * 60 * 60,
            },
            code: Code::from_commit(None),
        }
    }

    /// Reads the configuration of a service of this program from variables; `default_listen` is the service's own port.
    ///
    /// # Errors
    /// [`Error::NotSet`] or [`Error::BadValue`], naming the variable.
    pub fn from_variables(
        vars: &Variables<'_>,
        default_listen: SocketAddr,
        code: Code,
    ) -> Result<Self, Error> {
        let url = vars.required("MAREY_DATABASE_URL", "a PostgreSQL URL")?;
        let store = vars.required("MAREY_STORE", "a folder or URL for objects")?;
        let store = vars.parse("MAREY_STORE", &store)?;
        let mut config = Self { code, ..Self::new(url, store, default_listen) };
        vars.set_within("MAREY_DATABASE_CONNECTIONS", &mut config.database.max_connections, 1..=1000)?;
        vars.set("MAREY_LISTEN", &mut config.grpc.listen)?;
        vars.set_within("MAREY_WORKER_CONCURRENCY", &mut config.worker.concurrency, 0..=1024)?;
        config.worker.name = vars.get("MAREY_WORKER_NAME");
        let mut grace_secs = config.grpc.shutdown_grace.as_secs();
        vars.set_within("MAREY_SHUTDOWN_GRACE_SECS", &mut grace_secs, 0..=86_400)?;
        config.grpc.shutdown_grace = Duration::from_secs(grace_secs);
        config.worker.shutdown_grace = Duration::from_secs(grace_secs);
        vars.set("MAREY_DATABASE_CACHE_BYTES", &mut config.memory.cache_bytes)?;
        vars.set("MAREY_MAX_OBJECT_BYTES", &mut config.memory.max_object_bytes)?;
        vars.set("MAREY_MAX_INPUT_BYTES", &mut config.memory.max_input_bytes)?;
        vars.set("MAREY_MAX_BUILD_BYTES", &mut config.memory.max_build_bytes)?;
        vars.set("MAREY_MAX_SESSION_FRAMES", &mut config.memory.max_session_frames)?;
        Ok(config)
    }
}

/// What is logged, and how.
#[derive(Debug, Clone, Default)]
pub struct TelemetryConfig {
    /// Which spans and events, in the syntax of `tracing`; default `info,sqlx=warn`.
    pub filter: Option<String>,
    /// For people or for machines.
    pub format: LogFormat,
}

impl TelemetryConfig {
    /// Reads `MAREY_LOG` and `MAREY_LOG_FORMAT`.
    ///
    /// # Errors
    /// [`Error::BadValue`].
    pub fn from_variables(vars: &Variables<'_>) -> Result<Self, Error> {
        let mut config = Self { filter: vars.get("MAREY_LOG"), format: LogFormat::default() };
        vars.set("MAREY_LOG_FORMAT", &mut config.format)?;
        Ok(config)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pairs: &[(&str, &str)]) -> Result<Config, Error> {
        let get = |name: &str| pairs.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned());
        Config::from_variables(
            &Variables::new(&get),
            SocketAddr::from(([127, 0, 0, 1], 50051)),
            Code::from_commit(None),
        )
    }

    #[test]
    fn what_is_not_set_has_its_default() {
        let config = read(&[("MAREY_DATABASE_URL", "postgres:///m"), ("MAREY_STORE", "/o")]).unwrap();
        assert_eq!(config.grpc.listen.port(), 50051);
        assert_eq!(config.store, Location::folder("/o"));
        assert_eq!(config.database.max_connections, 8);
        assert_eq!(config.worker.name, None);
    }

    #[test]
    fn a_bad_value_is_refused_with_its_name() {
        let base = [("MAREY_DATABASE_URL", "postgres:///m"), ("MAREY_STORE", "/o")];
        for (name, bad) in [
            ("MAREY_LISTEN", "localhost"),
            ("MAREY_WORKER_CONCURRENCY", "-1"),
            ("MAREY_WORKER_CONCURRENCY", "1025"),
            ("MAREY_DATABASE_CONNECTIONS", "0"),
            ("MAREY_SHUTDOWN_GRACE_SECS", "soon"),
            ("MAREY_SHUTDOWN_GRACE_SECS", "18446744073709551615"),
            ("MAREY_STORE", "ftp://x"),
        ] {
            let mut pairs = vec![(name, bad)];
            pairs.extend(base);
            let message = read(&pairs).unwrap_err().to_string();
            assert!(message.contains(name) && message.contains(bad), "{message}");
        }
        let message = read(&[("MAREY_STORE", "/o"), ("MAREY_DATABASE_URL", "")]).unwrap_err().to_string();
        assert_eq!(message, "MAREY_DATABASE_URL is not set: expected a PostgreSQL URL");
    }
}
