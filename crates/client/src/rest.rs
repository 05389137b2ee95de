//! A client of the REST interface.

use std::{
    fs::File,
    io::{Read, Seek, Write},
    path::Path,
    time::Duration,
};

use anyhow::{Context, anyhow, bail};
use base64::{Engine, prelude::BASE64_STANDARD};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;
use sha2::{Digest, Sha256};
use ureq::{Agent, Body, http::Response};

use crate::{Request, Server};

/// Talks to one server with one key.
#[derive(Debug, Clone)]
pub struct Client {
    agent: Agent,
    server: Server,
}

/// A session.
#[derive(Debug, Clone, Deserialize)]
pub struct Session {
    /// id
    pub id: String,
    /// name
    pub name: String,
}

/// A motion database.
#[derive(Debug, Clone, Deserialize)]
pub struct MotionDatabase {
    /// id
    pub id: String,
    /// name
    pub name: String,
    /// version of the name
    pub version: u32,
    /// open, building, ready, failed
    pub state: String,
    /// poses at 60 frames per second
    pub num_poses: Option<u64>,
    /// motion clips
    pub num_clips: Option<u64>,
    /// size of the index, bytes
    pub bytes: Option<u64>,
    /// the version that it was made from
    pub base: Option<String>,
}

/// A run.
#[derive(Debug, Clone, Deserialize)]
pub struct Run {
    /// id
    pub id: String,
    /// sparse, motion-database
    pub kind: String,
    /// queued, running, succeeded, failed, cancelled
    pub state: String,
    /// 0 to 1
    pub progress: f64,
    /// what is being done
    pub phrase: String,
    /// why it failed
    pub error: Option<String>,
    /// when it was asked for
    pub created_at: String,
    /// everything that was asked
    #[serde(default)]
    pub parameters: Value,
    /// its jobs, when one run is shown
    #[serde(default)]
    pub jobs: Vec<Jobs>,
}

/// Jobs of a run of one kind and state.
#[derive(Debug, Clone, Deserialize)]
pub struct Jobs {
    /// kind
    pub kind: String,
    /// state
    pub state: String,
    /// how many
    pub count: u64,
    /// who had them
    pub workers: Vec<String>,
}

/// A result of a run.
#[derive(Debug, Clone, Deserialize)]
pub struct ResultFile {
    /// name
    pub name: String,
    /// size, bytes
    pub bytes: u64,
    /// checksum, hexadecimal
    pub blake3: String,
}

/// A page of a list.
#[derive(Debug, Deserialize)]
pub struct Page<T> {
    /// newest first
    pub items: Vec<T>,
    /// cursor of the next page
    pub next: Option<String>,
}

#[derive(Deserialize)]
struct Problem {
    detail: String,
}

/// What the server has against a request.
#[derive(Debug)]
struct Refused(String);

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Refused {}

impl Client {
    /// A client of `server`.
    pub fn new(server: Server) -> Self {
        let agent = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_connect(Some(Duration::from_secs(10)))
            .timeout_recv_response(Some(Duration::from_secs(60)))
            .user_agent(concat!("marey/", env!("CARGO_PKG_VERSION")))
            .build()
            .new_agent();
        Self { agent, server }
    }

    /// Address of the server.
    pub fn url(&self) -> &str {
        self.server.url.trim_end_matches('/')
    }

    /// GET, as JSON.
    pub fn get<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<T> {
        self.read(self.open(path)?, path)
    }

    /// GET, as a stream.
    pub fn open(&self, path: &str) -> anyhow::Result<Response<Body>> {
        let request = self.agent.get(self.at(path)).header("Authorization", self.bearer());
        self.checked(request.call(), path)
    }

    /// POST of JSON. A key makes it safe to send again when the connection breaks.
    pub fn post<T: DeserializeOwned>(&self, path: &str, body: &Value) -> anyhow::Result<T> {
        let key = idempotency_key(path, body);
        let send = || {
            self.agent
                .post(self.at(path))
                .header("Authorization", self.bearer())
                .header("Idempotency-Key", &key)
                .send_json(body)
        };
        let response = match send() {
            Err(ureq::Error::Io(_)) => send(),
            other => other,
        };
        self.read(self.checked(response, path)?, path)
    }

    /// POST of what options say; a refusal names these.
    pub fn post_request<T: DeserializeOwned>(&self, path: &str, request: &Request) -> anyhow::Result<T> {
        self.post(path, &request.to_json()).map_err(|error| match error.downcast::<Refused>() {
            Ok(Refused(detail)) => Refused(request.in_options(&detail)).into(),
            Err(other) => other,
        })
    }

    /// DELETE.
    pub fn delete(&self, path: &str) -> anyhow::Result<()> {
        let request = self.agent.delete(self.at(path)).header("Authorization", self.bearer());
        self.checked(request.call(), path).map(|_| ())
    }

    /// PUT of a file, with its checksum.
    pub fn put_file(&self, path: &str, mut file: File) -> anyhow::Result<Value> {
        let mut hasher = Sha256::new();
        std::io::copy(&mut file, &mut hasher)?;
        file.rewind()?;
        let digest = format!("sha-256=:{}:", BASE64_STANDARD.encode(hasher.finalize()));
        let request = self
            .agent
            .put(self.at(path))
            .header("Authorization", self.bearer())
            .header("Content-Digest", digest)
            .header("Content-Type", "application/octet-stream");
        self.read(self.checked(request.send(file), path)?, path)
    }

    /// Downloads `path` to a file, which appears when it is whole and its checksum is right.
    pub fn download(&self, path: &str, blake3: &str, to: &Path) -> anyhow::Result<()> {
        let mut body = self.open(path)?.into_body().into_reader();
        let folder = to.parent().context("a file name has a folder")?;
        let mut part =
            tempfile::NamedTempFile::new_in(folder).with_context(|| folder.display().to_string())?;
        let mut hasher = blake3::Hasher::new();
        let mut buffer = vec![0; 64 << 10];
        loop {
            match body.read(&mut buffer).with_context(|| format!("GET {path}"))? {
                0 => break,
                n => {
                    hasher.update(&buffer[..n]);
                    part.write_all(&buffer[..n])?;
                }
            }
        }
        let found = hasher.finalize().to_hex();
        if found.as_str() != blake3 {
            bail!("{path} arrived damaged: its checksum is {found}, expected {blake3}");
        }
        part.persist(to).with_context(|| to.display().to_string())?;
        Ok(())
    }

    /// All items of a paged list.
    pub fn list_all<T: DeserializeOwned>(&self, path: &str) -> anyhow::Result<Vec<T>> {
        let mut items = Vec::new();
        let mut page: Page<T> = self.get(&format!("{path}?limit=200"))?;
        loop {
            items.append(&mut page.items);
            match &page.next {
                None => return Ok(items),
                Some(cursor) => page = self.get(&format!("{path}?limit=200&cursor={cursor}"))?,
            }
        }
    }

    /// The session of that id, or the newest of that name; says so on the terminal if others have the name too.
    pub fn find_session(&self, which: &str) -> anyhow::Result<Option<Session>> {
        let sessions: Vec<Session> = self.list_all("/v1/sessions")?;
        let mut found = sessions.into_iter().filter(|session| session.id == which || session.name == which);
        let newest = found.next();
        if let (Some(session), others @ 1..) = (&newest, found.count()) {
            eprintln!(
                "note: {} sessions are called {which:?}; the newest is meant, id {}",
                others + 1,
                session.id
            );
        }
        Ok(newest)
    }

    /// The id of a run: the one given, or that of the newest run of the session of that name.
    ///
    /// # Errors
    /// If it is neither an id nor the name of a session that has a run.
    pub fn find_run(&self, which: &str) -> anyhow::Result<String> {
        if is_id(which) {
            return Ok(which.to_owned());
        }
        let Some(session) = self.find_session(which)? else {
            bail!("there is no run and no session {which:?}; `marey status` lists the runs");
        };
        let runs: Page<Run> = self.get(&format!("/v1/sessions/{}/runs?limit=1", session.id))?;
        let newest = runs.items.into_iter().next().map(|run| run.id);
        newest.with_context(|| format!("session {which:?} has no run yet; start one: marey run {which:?}"))
    }

    /// Makes a session.
    pub fn create_session(&self, name: &str) -> anyhow::Result<Session> {
        let request = Request::default().with("name", "the session's name", Some(name));
        self.post_request("/v1/sessions", &request)
    }

    fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url())
    }

    fn bearer(&self) -> String {
        format!("Bearer {}", self.server.api_key)
    }

    fn checked(
        &self,
        response: Result<Response<Body>, ureq::Error>,
        path: &str,
    ) -> anyhow::Result<Response<Body>> {
        let mut response = response.map_err(|error| match error {
            ureq::Error::Io(error) => anyhow!("{} does not answer: {error}", self.url()),
            error => anyhow!("{}: {error}", self.url()),
        })?;
        if response.status().is_success() {
            return Ok(response);
        }
        let status = response.status();
        let text = response.body_mut().read_to_string().unwrap_or_default();
        match serde_json::from_str::<Problem>(&text) {
            Ok(problem) => Err(Refused(problem.detail).into()),
            Err(_) => bail!("{path}: the server answered {status}"),
        }
    }

    fn read<T: DeserializeOwned>(&self, mut response: Response<Body>, path: &str) -> anyhow::Result<T> {
        let text = response.body_mut().read_to_string().with_context(|| path.to_owned())?;
        serde_json::from_str(&text).with_context(|| format!("{path}: the answer is not what was expected"))
    }
}

/// New for every call, the same for its repetition.
fn idempotency_key(path: &str, body: &Value) -> String {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let text = format!("{path} {body} {} {}", now.as_nanos(), std::process::id());
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

/// Whether a word is an id, as the server gives them: hexadecimal digits in groups of 8, 4, 4, 4 and 12.
fn is_id(word: &str) -> bool {
    let groups: Vec<&str> = word.split('-').collect();
    let is_group = |(group, length): (&&str, usize)| {
        group.len() == length && group.bytes().all(|byte| byte.is_ascii_hexdigit())
    };
    groups.len() == 5 && groups.iter().zip([8, 4, 4, 4, 12]).all(is_group)
}

/// A part of a path.
pub fn encode(part: &str) -> String {
    part.bytes()
        .map(|b| match b {
            b if b.is_ascii_alphanumeric() || b"-._~@".contains(&b) => char::from(b).to_string(),
            b => format!("%{b:02X}"),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::is_id;

    #[test]
    fn ids_are_told_from_names() {
        assert!(is_id("0199a1b2-0c3d-7e4f-8a9b-0c1d2e3f4a5b"));
        for name in ["take 3", "", "0199a1b2", "0199a1b2-0c3d-7e4f-8a9b-0c1d2e3f4a5g", "a-b-c-d-e"] {
            assert!(!is_id(name), "{name:?}");
        }
    }
}
