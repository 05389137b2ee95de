//! The REST interface, as far as these tests use it.

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use serde_json::Value;
use std::time::{Duration, Instant};
use ureq::{Agent, Body, http::Response};

/// Between two looks at a run.
pub const LOOK_EVERY: Duration = Duration::from_millis(50);

pub struct Client {
    agent: Agent,
    url: String,
    authorization: String,
}

/// A run as `GET /v1/runs/{id}` shows it.
#[derive(Debug, Deserialize)]
pub struct Run {
    pub id: String,
    pub state: String,
    pub error: Option<String>,
    #[serde(default)]
    pub jobs: Vec<Job>,
}

/// Its jobs of one kind in one state.
#[derive(Debug, Deserialize)]
pub struct Job {
    pub kind: String,
    pub state: String,
    pub count: u64,
    pub attempts: u64,
    pub workers: Vec<String>,
}

#[derive(Deserialize)]
struct ResultFile {
    name: String,
    blake3: String,
}

impl Run {
    pub fn is_finished(&self) -> bool {
        matches!(self.state.as_str(), "succeeded" | "failed" | "cancelled")
    }
}

impl Client {
    pub fn new(url: &str, key: &str) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(Duration::from_secs(60)))
            .build();
        Self {
            agent: config.into(),
            url: url.trim_end_matches('/').to_owned(),
            authorization: format!("Bearer {key}"),
        }
    }

    pub fn post(&self, path: &str, body: &Value) -> Result<Value> {
        let request = self.agent.post(self.at(path)).header("Authorization", &self.authorization);
        Ok(serde_json::from_slice(&bytes("POST", path, request.send_json(body)?)?)?)
    }

    pub fn put(&self, path: &str, content: &[u8]) -> Result<()> {
        let request = self.agent.put(self.at(path)).header("Authorization", &self.authorization);
        bytes("PUT", path, request.send(content)?)?;
        Ok(())
    }

    /// Posts what answers with a run.
    pub fn start(&self, path: &str, body: &Value) -> Result<Run> {
        Ok(serde_json::from_value(self.post(path, body)?)?)
    }

    pub fn run(&self, run: &Run) -> Result<Run> {
        Ok(serde_json::from_slice(&self.get(&format!("/v1/runs/{}", run.id))?)?)
    }

    pub fn wait_until_succeeded(&self, run: &Run, at_most: Duration) -> Result<Run> {
        let start = Instant::now();
        loop {
            let now = self.run(run)?;
            match now.state.as_str() {
                "succeeded" => return Ok(now),
                "failed" | "cancelled" => bail!("the run {}: {:?}", now.state, now.error),
                _ if start.elapsed() > at_most => bail!("the run is not done after {at_most:?}: {now:?}"),
                _ => std::thread::sleep(LOOK_EVERY),
            }
        }
    }

    /// Name and BLAKE3 of each result.
    pub fn results(&self, run: &Run) -> Result<Vec<(String, String)>> {
        let files: Vec<ResultFile> =
            serde_json::from_slice(&self.get(&format!("/v1/runs/{}/results", run.id))?)?;
        Ok(files.into_iter().map(|file| (file.name, file.blake3)).collect())
    }

    pub fn result(&self, run: &Run, name: &str) -> Result<Vec<u8>> {
        self.get(&format!("/v1/runs/{}/results/{name}", run.id))
    }

    fn get(&self, path: &str) -> Result<Vec<u8>> {
        bytes("GET", path, self.agent.get(self.at(path)).header("Authorization", &self.authorization).call()?)
    }

    fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }
}

/// The body; an answer that is no success shows its problem.
fn bytes(method: &str, path: &str, mut response: Response<Body>) -> Result<Vec<u8>> {
    let body = response.body_mut().with_config().limit(256 << 20).read_to_vec();
    let body = body.with_context(|| format!("{method} {path}"))?;
    if !response.status().is_success() {
        bail!("{method} {path}: {}: {}", response.status(), String::from_utf8_lossy(&body));
    }
    Ok(body)
}
