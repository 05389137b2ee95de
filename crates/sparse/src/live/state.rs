//! What is known of a performer between two frames, as bytes, so that a broken stream can resume elsewhere.

use std::fmt::Display;

use model::{SkeletonRecord, shown};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::contest::{CHALLENGERS, Phase};
use super::{Live, MAX_DISTANCE_M};
use crate::bytes::{Reader, Writer};
use crate::problem::Problem;
use crate::track::Track;
use crate::{Error, Result};

const MAGIC: &[u8; 8] = b"MAREYLV1";
const WHAT: &str = "live state";
/// BLAKE3, at the end.
const CHECKSUM_BYTES: usize = 32;
/// Largest state that is read, bytes: 16 points, windows of 16, 240 frames of 200 degrees of freedom take half of it.
pub const MAX_LIVE_STATE_BYTES: usize = 512 << 10;
/// Largest coordinate of a pose: headings run on.
const MAX_COORDINATE: f64 = 1e6;

#[derive(Serialize, Deserialize)]
struct Header {
    /// fingerprint of database, skeleton, points and window
    #[serde(rename = "of")]
    origin: String,
    window: usize,
    dofs: usize,
    points: usize,
    /// frames of recent measurements
    recent: usize,
    has_pose: bool,
    has_variances: bool,
    lost: usize,
    contest: ContestRecord,
    /// rows that matched last, of the leader and of the challengers
    matches: Vec<Vec<usize>>,
    leader_surprise: f64,
    surprises: Vec<f64>,
}

/// What a state says, checked.
struct Known {
    header: Header,
    /// the leader, if there is one, and the challengers
    tracks: Vec<Track>,
    /// the last pose in channels
    pose: Option<Vec<f64>>,
    variances: Option<Vec<f64>>,
    /// shape `[frames, points]`, oldest first
    recent: Vec<Vector3<f64>>,
}

#[derive(Serialize, Deserialize)]
struct ContestRecord {
    is_over: bool,
    /// frames left of a heat; 0: a search
    left: usize,
    tried: usize,
}

impl Live<'_> {
    /// All that is known of the performer; [`Self::resume`] continues from it. A few kilobytes.
    ///
    /// A stream that resumes from it gives the same poses, bit for bit, as one that was not interrupted; but a search of the
    /// database that was under way begins anew.
    pub fn state(&self) -> Vec<u8> {
        let tracks = self.tracks();
        let challengers = &self.contest.challengers[..self.contest.active];
        let header = Header {
            origin: fingerprint(self.problem),
            window: self.leader.history.len(),
            dofs: self.num_dofs(),
            points: self.positions.len(),
            recent: self.recent.len(),
            has_pose: self.has_pose,
            has_variances: self.uncertainty.variances().is_some(),
            lost: self.lost,
            contest: ContestRecord {
                is_over: self.contest.is_over(),
                left: if let Phase::Heat { left } = self.contest.phase { left } else { 0 },
                tried: if self.contest.is_over() { 0 } else { self.contest.tried },
            },
            matches: tracks.iter().map(|t| t.matches.clone()).collect(),
            leader_surprise: if challengers.is_empty() { 0.0 } else { self.contest.leader_surprise },
            surprises: challengers.iter().map(|c| c.surprise).collect(),
        };
        let mut writer = Writer::new(MAGIC, &header);
        for pose in tracks.iter().flat_map(|t| &t.history) {
            writer.numbers(pose);
        }
        if self.has_pose {
            writer.numbers(&self.pose);
        }
        writer.numbers(self.uncertainty.variances().unwrap_or_default());
        for age in (0..self.recent.len()).rev() {
            for position in self.recent.frame(age) {
                writer.numbers(position.as_slice());
            }
        }
        let mut bytes = writer.finish();
        let checksum = blake3::hash(&bytes);
        bytes.extend_from_slice(checksum.as_bytes());
        bytes
    }

    /// Goes on from a [`Self::state`] of the same database, skeleton, points and window, in place of what was known.
    ///
    /// # Errors
    /// If the bytes are something else, damaged, of another database or session, or hold impossible numbers. Nothing is
    /// changed then.
    pub fn resume(&mut self, state: &[u8]) -> Result<()> {
        let Known { header, tracks, pose, variances, recent } = self.read(state)?;
        self.forget();
        self.has_pose = header.has_pose;
        self.lost = header.lost;
        if let Some(pose) = pose {
            self.pose.copy_from_slice(&pose);
        }
        self.uncertainty.resume(variances.as_deref());
        for frame in recent.chunks_exact(self.positions.len()) {
            self.recent.push(frame);
        }
        let mut tracks = tracks.iter();
        let Some(leader) = tracks.next() else { return Ok(()) };
        self.leader.copy_from(leader);
        self.has_leader = true;
        let contest = &mut self.contest;
        contest.tried = header.contest.tried;
        if header.contest.is_over {
            return Ok(());
        }
        if header.contest.left == 0 {
            contest.begin_search(&self.recent);
            return Ok(());
        }
        contest.phase = Phase::Heat { left: header.contest.left };
        contest.leader_surprise = header.leader_surprise;
        for ((to, from), surprise) in contest.challengers.iter_mut().zip(tracks).zip(&header.surprises) {
            to.track.copy_from(from);
            to.surprise = *surprise;
            contest.active += 1;
        }
        Ok(())
    }

    /// The leader, if there is one, and the challengers.
    fn tracks(&self) -> Vec<&Track> {
        let challengers = self.contest.challengers[..self.contest.active].iter().map(|c| &c.track);
        self.has_leader.then_some(&self.leader).into_iter().chain(challengers).collect()
    }

    fn read(&self, state: &[u8]) -> Result<Known> {
        if state.len() > MAX_LIVE_STATE_BYTES {
            return Err(wrong(
                format!("{} bytes long", state.len()),
                format!("at most {MAX_LIVE_STATE_BYTES}"),
            ));
        }
        let content = state.len().checked_sub(CHECKSUM_BYTES).map(|at| state.split_at(at));
        let Some((content, _)) = content.filter(|(c, sum)| blake3::hash(c).as_bytes() == *sum) else {
            return Err(wrong("damaged: its checksum is another", "the bytes as they were given out"));
        };
        let (header, mut reader): (Header, _) = Reader::new(content, MAGIC, WHAT)?;
        self.check(&header)?;
        let Header { window, dofs, points, .. } = header;
        let mut tracks = Vec::with_capacity(header.matches.len());
        for matches in &header.matches {
            let poses = reader.numbers(window.checked_mul(dofs))?;
            check_numbers(&poses)?;
            let history = poses.chunks_exact(dofs).map(<[f64]>::to_vec).collect();
            tracks.push(Track { history, matches: matches.clone() });
        }
        let pose = header.has_pose.then(|| reader.numbers(Some(dofs))).transpose()?;
        check_numbers(pose.as_deref().unwrap_or_default())?;
        let variances = header.has_variances.then(|| reader.numbers(Some(dofs))).transpose()?;
        check_variances(variances.as_deref().unwrap_or_default())?;
        let numbers = reader.numbers(header.recent.checked_mul(3 * points))?;
        reader.end()?;
        let recent: Vec<_> = numbers.as_chunks::<3>().0.iter().map(|p| Vector3::from(*p)).collect();
        // NaN stands for what was not measured
        if let Some(far) = numbers.iter().find(|v| v.abs() > MAX_DISTANCE_M) {
            return Err(wrong(format!("with a measurement at {} m", shown(*far)), "at most 100 km"));
        }
        Ok(Known { header, tracks, pose, variances, recent })
    }

    fn check(&self, header: &Header) -> Result<()> {
        if header.origin != fingerprint(self.problem) {
            return Err(wrong(
                "of another motion database, skeleton, choice of points or window",
                "one of a stream that was started as this one is",
            ));
        }
        let parameters = self.problem.parameters;
        let found = [header.window, header.dofs, header.points];
        let expected = [self.leader.history.len(), self.num_dofs(), self.positions.len()];
        if found != expected {
            return Err(wrong(
                format!("of window, degrees of freedom, points {found:?}"),
                format!("{expected:?}"),
            ));
        }
        if header.recent > parameters.start_frames {
            return Err(wrong(
                format!("of {} measured frames", header.recent),
                format!("at most {}", parameters.start_frames),
            ));
        }
        if header.matches.len() != header.surprises.len() + usize::from(!header.matches.is_empty())
            || header.surprises.len() > CHALLENGERS
        {
            let found =
                format!("of {} tracks and {} surprises", header.matches.len(), header.surprises.len());
            return Err(wrong(found, format!("a leader and at most {CHALLENGERS} challengers")));
        }
        let rows = self.problem.index.num_rows();
        for matches in &header.matches {
            if matches.len() > 1024 || matches.iter().any(|row| *row >= rows) {
                let found =
                    format!("with {} matches, one of them at {:?}", matches.len(), matches.iter().max());
                return Err(wrong(found, format!("at most 1024 rows below {rows}")));
            }
        }
        if header.contest.left > self.contest.heat_frames {
            return Err(wrong(
                format!("in a heat of {} frames", header.contest.left),
                format!("at most {}", self.contest.heat_frames),
            ));
        }
        let surprises = header.surprises.iter().chain([&header.leader_surprise]);
        match surprises.into_iter().find(|s| !s.is_finite()) {
            Some(found) => Err(wrong(format!("with a surprise of {found}"), "a finite number")),
            None => Ok(()),
        }
    }
}

fn check_numbers(numbers: &[f64]) -> Result<()> {
    match numbers.iter().find(|v| v.is_nan() || v.abs() > MAX_COORDINATE) {
        Some(found) => Err(wrong(format!("with a coordinate of {found}"), "at most a million")),
        None => Ok(()),
    }
}

fn check_variances(variances: &[f64]) -> Result<()> {
    match variances.iter().find(|v| !(0.0..=MAX_COORDINATE).contains(*v)) {
        Some(found) => Err(wrong(format!("with a variance of {found}"), "0 to a million")),
        None => Ok(()),
    }
}

/// What a state is valid for: the clips, the skeleton, the points and the window.
fn fingerprint(problem: &Problem<'_>) -> String {
    let Problem { database, session, parameters, .. } = problem;
    let mut hasher = blake3::Hasher::new();
    for clip in database.clips() {
        hasher.update(&(clip.name.len() as u64).to_le_bytes());
        hasher.update(clip.name.as_bytes());
        hasher.update(&(clip.num_poses as u64).to_le_bytes());
    }
    for pose in [0, database.num_poses() / 2, database.num_poses().saturating_sub(1)] {
        database.pose(pose).iter().for_each(|v| _ = hasher.update(&v.to_le_bytes()));
    }
    let points = session.points.iter().map(|p| (&p.name, p.joint, <[f64; 3]>::from(p.offset)));
    let origin =
        (SkeletonRecord::from(session.skeleton.as_ref()), points.collect::<Vec<_>>(), parameters.window);
    // Strings and finite numbers always are JSON.
    hasher.update(&serde_json::to_vec(&origin).unwrap_or_default());
    hasher.finalize().to_hex().as_str().to_owned()
}

fn wrong(found: impl Display, expected: impl Display) -> Error {
    Error::LiveState { found: found.to_string(), expected: expected.to_string() }
}
