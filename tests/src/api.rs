//! Plain HTTP with a key: answers as they come, successes or not.

use std::{
    io::{BufRead, BufReader},
    time::{Duration, Instant},
};

use anyhow::{Context, ensure};
use serde_json::{Value, json};
use ureq::{Agent, Body, RequestBuilder, http::Response};

/// Longest that any run of these tests takes on a slow machine.
pub const LONGEST_RUN: Duration = Duration::from_secs(120);

/// A caller with a key.
#[derive(Debug, Clone)]
pub struct Api {
    agent: Agent,
    url: String,
    key: String,
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    /// HTTP status
    pub status: u16,
    /// header values by lower-case name
    pub headers: Vec<(String, String)>,
    /// the body as bytes
    pub body: Vec<u8>,
}

impl Answer {
    /// The body as JSON; null if it is none.
    pub fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_default()
    }

    /// A header's value; empty if there is none.
    pub fn header(&self, name: &str) -> &str {
        self.headers.iter().find(|(n, _)| n == name).map_or("", |(_, value)| value)
    }

    /// The last part of the problem's type; empty if it is none.
    pub fn problem(&self) -> String {
        if self.header("content-type") != "application/problem+json" {
            return String::new();
        }
        let kind = self.json()["type"].as_str().unwrap_or_default().to_owned();
        kind.strip_prefix("urn:marey:problem:").unwrap_or_default().to_owned()
    }
}

impl Api {
    /// A caller of `url` with `key`; without one if it is empty.
    pub fn new(url: &str, key: &str) -> Self {
        let agent = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(Duration::from_secs(60)))
            .build()
            .new_agent();
        Self { agent, url: url.to_owned(), key: key.to_owned() }
    }

    /// The key.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Address of the gateway.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// GET.
    pub fn get(&self, path: &str) -> anyhow::Result<Answer> {
        self.get_with(path, &[])
    }

    /// GET with headers.
    pub fn get_with(&self, path: &str, headers: &[(&str, &str)]) -> anyhow::Result<Answer> {
        answer(self.prepared(self.agent.get(self.at(path)), headers).call()?)
    }

    /// DELETE.
    pub fn delete(&self, path: &str) -> anyhow::Result<Answer> {
        answer(self.prepared(self.agent.delete(self.at(path)), &[]).call()?)
    }

    /// POST of JSON.
    pub fn post(&self, path: &str, body: &Value) -> anyhow::Result<Answer> {
        self.post_with(path, body, &[])
    }

    /// POST of JSON with headers.
    pub fn post_with(&self, path: &str, body: &Value, headers: &[(&str, &str)]) -> anyhow::Result<Answer> {
        answer(self.prepared(self.agent.post(self.at(path)), headers).send_json(body)?)
    }

    /// POST of anything.
    pub fn post_raw(&self, path: &str, body: &[u8], media_type: &str) -> anyhow::Result<Answer> {
        let request = self.prepared(self.agent.post(self.at(path)), &[("content-type", media_type)]);
        answer(request.send(body)?)
    }

    /// PUT.
    pub fn put(&self, path: &str, body: &[u8]) -> anyhow::Result<Answer> {
        self.put_with(path, body, &[])
    }

    /// PUT with headers.
    pub fn put_with(&self, path: &str, body: &[u8], headers: &[(&str, &str)]) -> anyhow::Result<Answer> {
        answer(self.prepared(self.agent.put(self.at(path)), headers).send(body)?)
    }

    /// POST that must succeed.
    pub fn make(&self, path: &str, body: &Value) -> anyhow::Result<Value> {
        let answer = self.post(path, body)?;
        ensure!(
            answer.status < 300,
            "POST {path}: {} {}",
            answer.status,
            String::from_utf8_lossy(&answer.body)
        );
        Ok(answer.json())
    }

    /// PUT that must succeed.
    pub fn upload(&self, path: &str, body: &[u8]) -> anyhow::Result<Value> {
        let answer = self.put(path, body)?;
        ensure!(
            answer.status < 300,
            "PUT {path}: {} {}",
            answer.status,
            String::from_utf8_lossy(&answer.body)
        );
        Ok(answer.json())
    }

    /// Makes a session and uploads files to it; its path.
    pub fn session(&self, name: &str, files: &[(&str, &[u8])]) -> anyhow::Result<String> {
        let session = self.make("/v1/sessions", &json!({ "name": name }))?;
        let path = format!("/v1/sessions/{}", session["id"].as_str().context("no id")?);
        for (name, content) in files {
            self.upload(&format!("{path}/files/{name}"), content)?;
        }
        Ok(path)
    }

    /// Starts a run; its path.
    pub fn start_run(&self, session: &str, request: &Value) -> anyhow::Result<String> {
        let run = self.make(&format!("{session}/runs"), request)?;
        Ok(format!("/v1/runs/{}", run["id"].as_str().context("no id")?))
    }

    /// Waits until a run has ended, in whatever way, by its events.
    pub fn wait(&self, run: &str) -> anyhow::Result<Value> {
        self.wait_until(run, |_| false)
    }

    /// Waits until a run has ended or `enough` of it is done; the last event.
    pub fn wait_until(&self, run: &str, enough: impl Fn(&Value) -> bool) -> anyhow::Result<Value> {
        let begin = Instant::now();
        while begin.elapsed() < LONGEST_RUN {
            let request = self.prepared(self.agent.get(self.at(&format!("{run}/events"))), &[]);
            let response = request.config().timeout_global(Some(LONGEST_RUN)).build().call()?;
            ensure!(response.status() == 200, "events of {run}: {}", response.status());
            for line in BufReader::new(response.into_body().into_reader()).lines() {
                // a broken stream: connect again
                let Ok(line) = line else { break };
                let Some(data) = line.strip_prefix("data:") else { continue };
                let event: Value = serde_json::from_str(data)?;
                if has_ended(&event) || enough(&event) {
                    return Ok(event);
                }
            }
        }
        anyhow::bail!("{run} has not ended after {LONGEST_RUN:?}")
    }

    /// Name and content of a run's results, but for `run.json`, which says when and by whom.
    pub fn motion_files(&self, run: &str) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
        let list = self.get(&format!("{run}/results"))?.json();
        let names = list.as_array().context("no list")?.iter().filter_map(|file| file["name"].as_str());
        names
            .filter(|name| *name != "run.json")
            .map(|name| Ok((name.to_owned(), self.get(&format!("{run}/results/{name}"))?.body)))
            .collect()
    }

    fn at(&self, path: &str) -> String {
        format!("{}{path}", self.url)
    }

    fn prepared<B>(&self, mut request: RequestBuilder<B>, headers: &[(&str, &str)]) -> RequestBuilder<B> {
        if !self.key.is_empty() {
            request = request.header("authorization", format!("Bearer {}", self.key));
        }
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        request
    }
}

/// Whether an event says that the run has ended.
pub fn has_ended(event: &Value) -> bool {
    matches!(event["state"].as_str(), Some("succeeded" | "failed" | "cancelled"))
}

fn answer(mut response: Response<Body>) -> anyhow::Result<Answer> {
    let headers = response.headers().iter().map(|(name, value)| {
        (name.as_str().to_owned(), String::from_utf8_lossy(value.as_bytes()).into_owned())
    });
    Ok(Answer {
        status: response.status().as_u16(),
        headers: headers.collect(),
        body: response.body_mut().with_config().limit(256 << 20).read_to_vec()?,
    })
}
