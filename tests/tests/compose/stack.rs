//! The running stack: how many replicas of a service there are, and what happens to them.

use std::{env, process::Command};

use anyhow::{Context, Result, ensure};
use tests::Api;

pub struct Stack {
    /// `docker compose --project-name … --file …`, word by word
    compose: Vec<String>,
}

impl Stack {
    /// The stack that `scripts/test-compose.sh` brought up, and a caller of its gateway.
    pub fn from_environment() -> Option<(Self, Api)> {
        let url = env::var("MAREY_COMPOSE_URL").ok()?;
        let variable =
            |name: &str| env::var(name).unwrap_or_else(|_| panic!("{name} goes with MAREY_COMPOSE_URL"));
        let compose = variable("MAREY_COMPOSE_COMMAND").split_whitespace().map(str::to_owned).collect();
        Some((Self { compose }, Api::new(&url, &variable("MAREY_COMPOSE_KEY"))))
    }

    /// Brings `service` to so many replicas; ones that were killed are started again.
    pub fn scale(&self, service: &str, replicas: usize) -> Result<()> {
        let scale = format!("{service}={replicas}");
        let up = ["up", "--detach", "--no-build", "--no-deps", "--no-recreate", "--scale", &scale, service];
        run(Command::new(&self.compose[0]).args(&self.compose[1..]).args(up))
    }

    /// Runs a command of the Docker client.
    pub fn docker(&self, arguments: &[&str]) -> Result<()> {
        run(Command::new("docker").args(arguments))
    }
}

/// The container that a worker `service@host/pid` lives in: a container's host name is the start of its id.
pub fn container_of(worker: &str) -> Result<String> {
    let host = worker.split_once('@').and_then(|(_, rest)| rest.split_once('/')).map(|(host, _)| host);
    host.map(str::to_owned).with_context(|| format!("worker {worker:?} is not named service@host/pid"))
}

fn run(command: &mut Command) -> Result<()> {
    // the paths of the compose command are relative to the repository
    let command = command.current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let output = command.output().with_context(|| format!("{command:?}"))?;
    ensure!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}
