//! `run.json`: all that decided the results of a run, what was found, and what it took. Runs of all kinds have the same head;
//! what is a kind's own stands beside it.

mod timings;

use std::collections::BTreeSet;

use formats::FileRole;
use queue::JobError;
use serde::Serialize;
use serde_json::Value;
use uuid::Uuid;

pub use timings::Timings;

use crate::{
    InputFile,
    versions::{BodyModelFile, MotionDatabaseFile},
};

/// Name of the result.
pub const RUN_JSON: &str = "run.json";

/// What a run was asked for: all that decides its results.
pub trait Request {
    /// The kind of run.
    fn run_kind(&self) -> &'static str;

    /// What it is on, with its input files.
    fn subject(&self) -> Subject<'_>;

    /// What was learned before and is used.
    fn learned_from(&self) -> LearnedFrom<'_>;

    /// Parameters of the method, all resolved.
    ///
    /// # Errors
    /// If they are no JSON.
    fn parameters(&self) -> serde_json::Result<Value>;

    /// How the files were read, as far as a request may say: which points or cameras, axes and units. Null where nothing may be
    /// said.
    fn reading(&self) -> Value {
        Value::Null
    }

    /// What random numbers came from; empty where nothing is drawn at random.
    fn seeds(&self) -> Vec<u64> {
        Vec::new()
    }
}

/// What a run is on: what it reads, or what it makes.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject<'a> {
    /// a capture session that it reads
    Session(SessionReport<'a>),
    /// a motion database that it builds, or trains a model on
    MotionDatabase(VersionReport<'a>),
    /// a body model that it learns
    BodyModel(VersionReport<'a>),
}

/// A capture session.
#[derive(Debug, Clone, Default, Serialize)]
pub struct SessionReport<'a> {
    /// its id
    pub id: Uuid,
    /// its name
    pub name: &'a str,
    /// its files
    pub files: Vec<FileReport<'a>>,
    /// how its files were read
    #[serde(skip_serializing_if = "Value::is_null")]
    pub reading: Value,
    /// frames that were solved
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<usize>,
    /// of these
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_rate_hz: Option<f64>,
    /// measured points that were used, by name
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<&'a str>>,
}

/// One version of a database or model.
#[derive(Debug, Clone, Serialize)]
pub struct VersionReport<'a> {
    /// its id
    pub id: Uuid,
    /// its name
    pub name: &'a str,
    /// version of that name, from 1
    pub version: i32,
    /// of its file, where it was built before
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blake3: Option<&'a str>,
    /// the files that it is built from
    pub files: Vec<FileReport<'a>>,
}

/// An uploaded file.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FileReport<'a> {
    name: &'a str,
    role: FileRole,
    bytes: u64,
    blake3: &'a str,
}

impl<'a> FileReport<'a> {
    /// Of all of these files.
    pub fn all(files: &'a [InputFile]) -> Vec<Self> {
        let report = |file: &'a InputFile| Self {
            name: &file.name,
            role: file.role,
            bytes: file.bytes,
            blake3: &file.blake3,
        };
        files.iter().map(report).collect()
    }
}

/// Versions of what was learned before and is used.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct LearnedFrom<'a> {
    /// the motion database that serves as prior
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion_database: Option<&'a MotionDatabaseFile>,
    /// the bodies that people may have
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_model: Option<&'a BodyModelFile>,
    /// the motion database whose clips another begins with
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<&'a MotionDatabaseFile>,
}

/// The program that made a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Code {
    /// of the program
    pub version: &'static str,
    /// commit that it was built from, when the build knew it
    pub commit: Option<&'static str>,
}

impl Code {
    /// This version, built from that commit.
    pub const fn from_commit(commit: Option<&'static str>) -> Self {
        Self { version: env!("CARGO_PKG_VERSION"), commit }
    }
}

/// Where a report comes from: the run, and the program that made its results.
#[derive(Debug, Clone, Copy)]
pub struct Origin {
    /// the run
    pub run_id: Uuid,
    /// the program
    pub code: Code,
}

/// A run whose results are made.
#[derive(Debug, Clone)]
pub struct RunReport<'a> {
    /// the run, and the program
    pub origin: Origin,
    /// what was doubtful
    pub warnings: &'a [String],
    /// who did what, and how long it took
    pub timings: Timings<'a>,
    /// frames of a session that were solved, and how many there are a second
    pub frames: Option<(usize, f64)>,
    /// measured points of a session that were used, by name
    pub points: Option<Vec<&'a str>>,
}

#[derive(Serialize)]
struct Document<'a, Own> {
    run_id: Uuid,
    kind: &'static str,
    code: Code,
    #[serde(flatten)]
    subject: Subject<'a>,
    #[serde(flatten)]
    learned_from: LearnedFrom<'a>,
    parameters: Value,
    seeds: Vec<u64>,
    #[serde(flatten)]
    own: Own,
    warnings: &'a [String],
    workers: BTreeSet<&'a str>,
    timings: &'a Timings<'a>,
}

impl RunReport<'_> {
    /// The content of [`RUN_JSON`]; `own`: the parts that runs of this kind have beside the head, an object.
    ///
    /// # Errors
    /// To be tried again if it is no JSON.
    pub fn to_json(&self, request: &impl Request, own: impl Serialize) -> Result<Vec<u8>, JobError> {
        let mut subject = request.subject();
        if let Subject::Session(session) = &mut subject {
            (session.frames, session.frame_rate_hz) = self.frames.unzip();
            session.points = self.points.clone();
            session.reading = request.reading();
        }
        let document = Document {
            run_id: self.origin.run_id,
            kind: request.run_kind(),
            code: self.origin.code,
            subject,
            learned_from: request.learned_from(),
            parameters: request.parameters().map_err(JobError::retry)?,
            seeds: request.seeds(),
            own,
            warnings: self.warnings,
            workers: self.timings.workers(),
            timings: &self.timings,
        };
        serde_json::to_vec_pretty(&document).map_err(JobError::retry)
    }
}
