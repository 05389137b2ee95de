use std::{fmt, sync::Arc};

use kinematics::ControlPoint;
use model::{PointTrajectories, Skeleton, SkeletonRecord};
use motion_db::FRAME_RATE;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::bytes::{Reader, Writer};
use crate::{Error, Result};

/// Most control points of a session.
const MAX_POINTS: usize = 16;
/// What is said to be farther from the origin than this (metres, in any direction) was not measured.
const MAX_DISTANCE: f64 = 1e5;
/// Where a larger share of the samples is that far away, their origin is elsewhere.
const MOST_FAR: f64 = 0.5;
const MAGIC: &[u8; 8] = b"MAREYSE2";

/// A sparse capture session: the performer's skeleton and what was measured of them, at 60 frames a second.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// the performer's skeleton
    pub skeleton: Arc<Skeleton>,
    /// the control points
    pub points: Vec<ControlPoint>,
    /// one trajectory for each of `points`, in their order, 60 frames a second, metres, y up
    pub trajectories: PointTrajectories,
}

/// Samples more than 100 km from the origin: they count as not measured.
#[derive(Debug, Clone, PartialEq)]
pub struct FarSamples {
    /// how many
    pub count: usize,
    /// samples that were measured, these among them
    pub measured: usize,
    /// point of the first of them
    pub point: String,
    /// frame of the first of them, in the frames of the trajectories
    pub frame: usize,
    /// where that is, metres
    pub position: [f64; 3],
}

impl FarSamples {
    /// Those of `points`, if there are any.
    ///
    /// # Errors
    /// If they are most of what was measured.
    pub fn find(trajectories: &PointTrajectories, points: &[ControlPoint]) -> Result<Option<Self>> {
        let columns: Vec<usize> =
            points.iter().filter_map(|point| trajectories.point_index(&point.name)).collect();
        let mut measured = 0;
        let mut found: Option<Self> = None;
        for frame in 0..trajectories.num_frames() {
            let row = trajectories.frame(frame);
            for (&column, position) in columns.iter().map(|column| (column, &row[*column])) {
                measured += usize::from(position.iter().all(|v| v.is_finite()));
                if position.amax() > MAX_DISTANCE {
                    let first = found.get_or_insert_with(|| Self {
                        count: 0,
                        measured: 0,
                        point: trajectories.names()[column].clone(),
                        frame,
                        position: (*position).into(),
                    });
                    first.count += 1;
                }
            }
        }
        let Some(found) = found.map(|found| Self { measured, ..found }) else { return Ok(None) };
        if found.count as f64 > MOST_FAR * measured as f64 {
            let Self { count, measured, point, frame, position } = found;
            return Err(Error::FarFromOrigin { count, measured, point, frame, position });
        }
        Ok(Some(found))
    }
}

impl fmt::Display for FarSamples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, measured, point, frame, .. } = self;
        write!(
            f,
            "{count} of {measured} measured samples {} more than 100 km from the origin and are ignored; the \
             first: {point} in frame {frame}",
            if *count == 1 { "is" } else { "are" }
        )
    }
}

#[derive(Serialize, Deserialize)]
struct Header {
    skeleton: SkeletonRecord,
    points: Vec<PointRecord>,
    frames: usize,
    /// whether the samples' standard deviations follow their positions
    has_sigmas: bool,
}

#[derive(Serialize, Deserialize)]
struct PointRecord {
    name: String,
    joint: usize,
    offset_m: [f64; 3],
}

impl Session {
    /// Picks the trajectories of `points` by name and brings them to 60 frames a second: whole ratios take every
    /// n-th sample, others interpolate linearly between two measured samples. What is more than 100 km away was not
    /// measured.
    ///
    /// # Errors
    /// If a point has no trajectory, there are fewer than 2 or more than 16 points, most samples are more than 100 km away, or
    /// no frame has two measured ones.
    pub fn new(
        skeleton: Arc<Skeleton>,
        points: Vec<ControlPoint>,
        trajectories: &PointTrajectories,
    ) -> Result<Self> {
        check_points(&points)?;
        let columns = points.iter().map(|point| {
            trajectories.point_index(&point.name).ok_or_else(|| Error::NoTrajectory {
                name: point.name.clone(),
                found: trajectories.names().join(", "),
            })
        });
        let columns = columns.collect::<Result<Vec<_>>>()?;
        FarSamples::find(trajectories, &points)?;
        let (mut positions, sigmas) = resample(trajectories, &columns);
        forget_absurd(&mut positions);
        let names = points.iter().map(|p| p.name.clone()).collect();
        let trajectories = PointTrajectories::new(names, FRAME_RATE, positions)?.with_sigmas(sigmas)?;
        let has_enough = |frame| trajectories.frame(frame).iter().filter(|p| p.x.is_finite()).count() >= 2;
        if !(0..trajectories.num_frames()).any(has_enough) {
            return Err(Error::NothingMeasured { frames: trajectories.num_frames() });
        }
        check_unit(&skeleton, &trajectories)?;
        Ok(Self { skeleton, points, trajectories })
    }

    /// A session whose frames are yet to come: skeleton and points of a live stream.
    ///
    /// # Errors
    /// If there are fewer than 2 or more than 16 points, or one of them twice.
    pub fn without_frames(skeleton: Arc<Skeleton>, points: Vec<ControlPoint>) -> Result<Self> {
        check_points(&points)?;
        let names = points.iter().map(|p| p.name.clone()).collect();
        let trajectories = PointTrajectories::new(names, FRAME_RATE, Vec::new())?;
        Ok(Self { skeleton, points, trajectories })
    }

    /// Number of frames at 60 a second.
    pub fn num_frames(&self) -> usize {
        self.trajectories.num_frames()
    }

    /// The session as an artefact; read by [`Self::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header {
            skeleton: SkeletonRecord::from(self.skeleton.as_ref()),
            points: self
                .points
                .iter()
                .map(|p| PointRecord { name: p.name.clone(), joint: p.joint, offset_m: p.offset.into() })
                .collect(),
            frames: self.num_frames(),
            has_sigmas: self.trajectories.has_sigmas(),
        };
        let mut writer = Writer::new(MAGIC, &header);
        for frame in 0..self.num_frames() {
            for position in self.trajectories.frame(frame) {
                writer.numbers(position.as_slice());
            }
        }
        writer.numbers(self.trajectories.sigmas());
        writer.finish()
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// If the bytes are something else, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let what = "session artefact";
        let (header, mut reader): (Header, _) = Reader::new(bytes, MAGIC, what)?;
        let skeleton = Skeleton::try_from(header.skeleton)?;
        let points: Vec<_> = header
            .points
            .into_iter()
            .map(|p| ControlPoint { name: p.name, joint: p.joint, offset: Vector3::from(p.offset_m) })
            .collect();
        if let Some(bad) = points.iter().find(|p| p.joint >= skeleton.num_joints()) {
            return Err(Error::Bytes { what, found: format!("point {} on joint {}", bad.name, bad.joint) });
        }
        check_points(&points)?;
        let count = header.frames.checked_mul(points.len());
        let numbers = reader.numbers(count.and_then(|n| n.checked_mul(3)))?;
        let sigmas = if header.has_sigmas { reader.numbers(count)? } else { Vec::new() };
        reader.end()?;
        let mut positions: Vec<_> = numbers.as_chunks::<3>().0.iter().map(|p| Vector3::from(*p)).collect();
        forget_absurd(&mut positions);
        let names = points.iter().map(|p| p.name.clone()).collect();
        let trajectories = PointTrajectories::new(names, FRAME_RATE, positions)?.with_sigmas(sigmas)?;
        Ok(Self { skeleton: skeleton.into(), points, trajectories })
    }
}

fn check_points(points: &[ControlPoint]) -> Result<()> {
    if !(2..=MAX_POINTS).contains(&points.len()) {
        return Err(Error::PointCount { found: points.len(), max: MAX_POINTS });
    }
    let is_second = |(i, p): &(usize, &ControlPoint)| points[..*i].iter().any(|q| q.name == p.name);
    match points.iter().enumerate().find(is_second) {
        Some((_, twice)) => Err(Error::PointTwice { name: twice.name.clone() }),
        None => Ok(()),
    }
}

/// Numbers of broken files, whose squares would swallow everything else.
fn forget_absurd(positions: &mut [Vector3<f64>]) {
    for p in positions.iter_mut().filter(|p| p.amax() > MAX_DISTANCE) {
        *p = Vector3::repeat(f64::NAN);
    }
}

/// Points of one body are never much further apart than the body is long: if they are, their unit is wrong. Looks at
/// the widest pair of every frame and takes the median over the frames, so that single wild samples do not count.
fn check_unit(skeleton: &Skeleton, trajectories: &PointTrajectories) -> Result<()> {
    let spread = |frame| {
        let measured: Vec<_> = trajectories.frame(frame).iter().filter(|p| p.x.is_finite()).collect();
        let pairs = measured
            .iter()
            .enumerate()
            .flat_map(|(i, p)| measured[..i].iter().map(move |q| (*p - *q).norm()));
        pairs.max_by(f64::total_cmp)
    };
    let mut spreads: Vec<f64> = (0..trajectories.num_frames()).filter_map(spread).collect();
    spreads.sort_by(f64::total_cmp);
    let Some(&spread_m) = spreads.get(spreads.len() / 2) else { return Ok(()) };
    let leg_m = motion_db::SkeletonSize::leg_length(skeleton);
    if spread_m > 10.0 * leg_m {
        return Err(Error::Unit { spread_m, leg_m });
    }
    Ok(())
}

/// Positions and standard deviations of `columns` at 60 frames a second; no standard deviations where none is known.
fn resample(trajectories: &PointTrajectories, columns: &[usize]) -> (Vec<Vector3<f64>>, Vec<f64>) {
    let ratio = trajectories.frame_rate() / FRAME_RATE;
    let whole = ratio.round();
    let is_whole = whole >= 1.0 && (ratio - whole).abs() < 0.01 * whole;
    let step = if is_whole { whole } else { ratio };
    let frames = trajectories.num_frames();
    let Some(last) = frames.checked_sub(1) else { return (Vec::new(), Vec::new()) };
    let count = (last as f64 / step + 1e-9).floor() as usize + 1;
    let mut positions = Vec::with_capacity(count * columns.len());
    let mut sigmas = Vec::with_capacity(if trajectories.has_sigmas() { positions.capacity() } else { 0 });
    for frame in 0..count {
        let at = frame as f64 * step;
        let low = (at.floor() as usize).min(last);
        let share = at - low as f64;
        // A sample that falls on a measured frame does not need the next one.
        let (high, share) = if share < 1e-6 { (low, 0.0) } else { ((low + 1).min(last), share) };
        let (a, b) = (trajectories.samples(low), trajectories.samples(high));
        for &c in columns {
            positions.push(a.positions[c] + (b.positions[c] - a.positions[c]) * share);
            if trajectories.has_sigmas() {
                sigmas.push(between(a.sigma(c), b.sigma(c), share));
            }
        }
    }
    (positions, sigmas)
}

/// Errors of neighbouring samples are alike, so their standard deviations are not averaged down. A known one stands for
/// an unknown neighbour; NaN where both are unknown.
fn between(a: Option<f64>, b: Option<f64>, share: f64) -> f64 {
    match (a, b) {
        (Some(a), Some(b)) => a + (b - a) * share,
        (known, other) => known.or(other).unwrap_or(f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two points in ten frames, some of them so far along x.
    fn far(count: usize, x: f64) -> (PointTrajectories, Vec<ControlPoint>) {
        let names = ["head", "root"].map(str::to_owned);
        let point = |name: &String| ControlPoint { name: name.clone(), joint: 0, offset: Vector3::zeros() };
        let at =
            |sample: usize| Vector3::new(if sample < 4 + count && sample >= 4 { x } else { 0.0 }, 1.0, 0.0);
        let trajectories = PointTrajectories::new(names.to_vec(), 60.0, (0..20).map(at).collect()).unwrap();
        (trajectories, names.iter().map(point).collect())
    }

    #[test]
    fn samples_of_another_origin_are_counted_and_most_of_them_refused() {
        let (trajectories, points) = far(0, 5e5);
        assert_eq!(FarSamples::find(&trajectories, &points).unwrap(), None);
        let (trajectories, points) = far(3, 5e5);
        let found = FarSamples::find(&trajectories, &points).unwrap().unwrap();
        assert_eq!((found.count, found.measured, found.frame, found.point.as_str()), (3, 20, 2, "head"));
        let (trajectories, points) = far(16, 5e5);
        let error = FarSamples::find(&trajectories, &points).unwrap_err().to_string();
        assert!(
            error.starts_with("16 of 20 measured samples are more than 100 km from the origin"),
            "{error}"
        );
        assert!(error.contains("head in frame 2 at 500000 1 0 m"), "{error}");
    }
}
