use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use kinematics::{Kinematics, PointSet};
use motion_db::{ControlTable, MotionDatabase, StartPose, WindowIndex, start_poses};
use nalgebra::Vector3;
use regression::gplvm::Gplvm;
use serde::{Deserialize, Serialize};

use crate::bytes::{Reader, Writer};
use crate::tracker::{Observed, Track, Tracker};
use crate::uncertainty::Uncertainty;
use crate::{Error, FramePart, Parameters, Result, Session};

const MAGIC: &[u8; 8] = b"MAREYRE2";
/// Numbers a frame's quality is written as.
const QUALITY_NUMBERS: usize = 5;

/// Start poses that are run over all of the frames on which they are compared.
const FINALISTS: usize = 3;

/// Frames around a frame whose measured points join its search, if the future is known: 0.1 s and 0.2 s away.
const AROUND: [i32; 4] = [-12, -6, 6, 12];

/// Where a track begins.
pub(crate) struct Begun {
    pub track: Track,
    /// first frame that it is to be stepped through: before it nothing to start from was measured
    pub frame: usize,
    /// the database's pose in that frame, if it is one's
    pose: Option<StartPose>,
}

/// A start pose on trial.
struct Probe {
    start: Track,
    pose: Option<StartPose>,
    now: Track,
    /// minus the log of the probability it gave to what was measured since
    surprise: f64,
}

/// How well a frame is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrameQuality {
    /// root mean square distance between the control points and their measured positions, metres
    pub residual_m: f64,
    /// mean posterior standard deviation of the joint angles, radians
    pub sigma_rad: f64,
    /// energy per measured coordinate: about 1 when measurement and prediction agree
    pub energy: f64,
    /// distance of the nearest database window, degrees (root mean square over its numbers)
    pub neighbour_distance_deg: f64,
    /// number of measured control points
    pub measured_points: usize,
}

/// The poses of a range of frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// first frame of the session that was reconstructed
    pub first_frame: usize,
    /// smooth coordinates (see [`kinematics::Parametrisation::smooth`]), metres and radians, shape `[frames, dofs]`
    pub coordinates: Vec<f64>,
    /// standard deviations of `coordinates`, shape `[frames, dofs]`
    pub sigmas: Vec<f64>,
    /// shape `[frames]`
    pub quality: Vec<FrameQuality>,
}

#[derive(Serialize, Deserialize)]
struct Header {
    first_frame: usize,
    frames: usize,
    dofs: usize,
}

impl Reconstruction {
    /// The reconstruction as an artefact; read by [`Self::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let frames = self.quality.len();
        let dofs = self.coordinates.len().checked_div(frames).unwrap_or(0);
        let mut writer = Writer::new(MAGIC, &Header { first_frame: self.first_frame, frames, dofs });
        writer.numbers(&self.coordinates);
        writer.numbers(&self.sigmas);
        for q in &self.quality {
            writer.numbers(&[
                q.residual_m,
                q.sigma_rad,
                q.energy,
                q.neighbour_distance_deg,
                q.measured_points as f64,
            ]);
        }
        writer.finish()
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// If the bytes are something else, or contradict themselves.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (header, mut reader): (Header, _) = Reader::new(bytes, MAGIC, "reconstruction artefact")?;
        let coordinates = reader.numbers(header.frames.checked_mul(header.dofs))?;
        let sigmas = reader.numbers(header.frames.checked_mul(header.dofs))?;
        let numbers = reader.numbers(header.frames.checked_mul(QUALITY_NUMBERS))?;
        reader.end()?;
        let quality = numbers.as_chunks::<QUALITY_NUMBERS>().0.iter().map(|n| FrameQuality {
            residual_m: n[0],
            sigma_rad: n[1],
            energy: n[2],
            neighbour_distance_deg: n[3],
            measured_points: n[4] as usize,
        });
        Ok(Self { first_frame: header.first_frame, coordinates, sigmas, quality: quality.collect() })
    }
}

/// Reconstructs frames of one session with one database.
pub struct Reconstructor<'a> {
    pub(crate) database: &'a MotionDatabase,
    pub(crate) index: &'a WindowIndex,
    pub(crate) session: &'a Session,
    pub(crate) parameters: &'a Parameters,
    pub(crate) kinematics: Kinematics,
    pub(crate) points: PointSet,
    pub(crate) table: Arc<ControlTable>,
    /// the performer's zero pose, radians, shape `[dofs]`
    pub(crate) zero_pose: Vec<f64>,
    /// variance of what is not known of it, radians², shape `[dofs]`
    pub(crate) zero_pose_variance: Vec<f64>,
    /// frames around a frame that join its search
    pub(crate) around: &'static [i32],
    pub(crate) model: Option<&'a Gplvm>,
    pub(crate) watcher: Option<&'a (dyn Fn(FramePart) + Sync)>,
    /// windows and poses that may not be used, in rising order
    pub(crate) exclude_rows: Vec<Range<usize>>,
    pub(crate) exclude_poses: Vec<Range<usize>>,
}

impl<'a> Reconstructor<'a> {
    /// Prepares a session: where its control points would be in every pose of the database (about 3 µs a pose).
    ///
    /// `index` must have been made from `database` with the parameters' window.
    ///
    /// # Errors
    /// If a parameter is out of range or the session's skeleton has another structure than the database's.
    pub fn new(
        database: &'a MotionDatabase,
        index: &'a WindowIndex,
        session: &'a Session,
        parameters: &'a Parameters,
    ) -> Result<Self> {
        parameters.check()?;
        check_structure(database, session)?;
        let zero_pose = database.zero_pose_prior(&session.skeleton).mean;
        let around: &[i32] = if parameters.smooth { &AROUND } else { &[] };
        let table = control_table_of(database, index, session, &zero_pose, around)?.into();
        Ok(Self { around, ..Self::with_table(database, index, session, parameters, table)? })
    }

    /// As [`Self::new`], with the [`control_table`] of the same database, index and session made before, and without the
    /// frames around a frame ([`Parameters::smooth`]).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_table(
        database: &'a MotionDatabase,
        index: &'a WindowIndex,
        session: &'a Session,
        parameters: &'a Parameters,
        table: Arc<ControlTable>,
    ) -> Result<Self> {
        parameters.check()?;
        check_structure(database, session)?;
        if index.window() != parameters.window {
            return Err(Error::Parameter {
                name: "window",
                found: format!("{} with an index of windows of {}", parameters.window, index.window()),
                expected: "the same",
            });
        }
        let kinematics = database.kinematics(&session.skeleton);
        let points = PointSet::new(&kinematics, session.points.clone());
        let zero_pose = database.zero_pose_prior(&session.skeleton);
        Ok(Self {
            zero_pose_variance: zero_pose.variances(),
            zero_pose: zero_pose.mean,
            around: &[],
            database,
            index,
            session,
            parameters,
            kinematics,
            points,
            table,
            model: None,
            watcher: None,
            exclude_rows: Vec::new(),
            exclude_poses: Vec::new(),
        })
    }

    /// With the latent variable model of the database ([`crate::train_gplvm`]), which method `gplvm` needs.
    ///
    /// # Errors
    /// [`Error::OtherModel`] if its poses are not the database's.
    pub fn with_model(mut self, model: &'a Gplvm) -> Result<Self> {
        let (found, expected) = (model.dofs(), self.database.num_dofs());
        if found != expected {
            return Err(Error::OtherModel { found, expected });
        }
        self.model = Some(model);
        Ok(self)
    }

    /// With somebody told whenever a part of a frame begins, so that its time can be taken: this crate has no clock.
    pub fn watched(mut self, watcher: &'a (dyn Fn(FramePart) + Sync)) -> Self {
        self.watcher = Some(watcher);
        self
    }

    /// Leaves clips out of every search: `is_excluded` sees each clip of the database.
    pub fn exclude(&mut self, is_excluded: impl Fn(&motion_db::ClipInfo) -> bool) {
        self.exclude_rows.clear();
        self.exclude_poses.clear();
        for (i, clip) in self.database.clips().iter().enumerate().filter(|(_, c)| is_excluded(c)) {
            self.exclude_rows.push(self.index.clip_rows(i));
            self.exclude_poses.push(clip.first_pose..clip.first_pose + clip.num_poses);
        }
    }

    /// What was measured at a frame of the session.
    pub(crate) fn observed(&self, frame: usize) -> Observed<'_> {
        let trajectories = &self.session.trajectories;
        let session = (!self.around.is_empty()).then_some((trajectories, frame));
        Observed { now: trajectories.samples(frame), session }
    }

    /// Reconstructs `frames` of the session in order. `progress` is called after every frame with the number of frames
    /// done, and may stop it. The same arguments always give the same bits.
    ///
    /// # Errors
    /// If the range is not in the session, no start pose is found, the method's model is missing, or `progress` stops
    /// it.
    pub fn reconstruct(
        &self,
        frames: Range<usize>,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Reconstruction> {
        let total = self.session.num_frames();
        if frames.start >= frames.end || frames.end > total {
            return Err(Error::Range { start: frames.start, end: frames.end, frames: total });
        }
        let mut tracker = Tracker::new(self)?;
        let dofs = self.database.num_dofs();
        let mut reconstruction = Reconstruction {
            first_frame: frames.start,
            coordinates: Vec::with_capacity(frames.len() * dofs),
            sigmas: Vec::with_capacity(frames.len() * dofs),
            quality: Vec::with_capacity(frames.len()),
        };
        let mut sigmas = vec![0.0; dofs];
        let mut uncertainty = Uncertainty::new(&self.zero_pose_variance);
        let begun = self.start(&mut tracker, frames.start, None)?;
        if begun.frame > frames.start {
            self.play_back(&mut tracker, &begun, &frames, &mut reconstruction);
        }
        let mut track = begun.track;
        let mut before = track.clone();
        let mut lost = 0;
        for frame in begun.frame..frames.end {
            before.copy_from(&track);
            let mut step = tracker.step(&mut track, self.observed(frame));
            lost = if step.energy() > self.parameters.lost_energy { lost + 1 } else { 0 };
            if lost >= self.parameters.lost_frames {
                lost = 0;
                uncertainty.restart();
                track = self.start(&mut tracker, frame, Some(before.clone()))?.track;
                step = tracker.step(&mut track, self.observed(frame));
            }
            reconstruction.coordinates.extend_from_slice(track.newest());
            reconstruction.quality.push(FrameQuality {
                residual_m: step.solution.residual_m,
                sigma_rad: tracker.standard_deviations(&mut uncertainty, &mut sigmas),
                energy: step.energy(),
                neighbour_distance_deg: step.neighbour_distance,
                measured_points: step.measured / 3,
            });
            reconstruction.sigmas.extend_from_slice(&sigmas);
            if progress(frame - frames.start + 1).is_break() {
                return Err(Error::Stopped { frame });
            }
        }
        Ok(reconstruction)
    }

    /// Adds the frames before a start, in which nothing to start from was measured: the database's clip that the start was
    /// taken from, played backwards from there; less and less sure.
    fn play_back(
        &self,
        tracker: &mut Tracker<'_>,
        begun: &Begun,
        frames: &Range<usize>,
        reconstruction: &mut Reconstruction,
    ) {
        let mut track = begun.track.clone();
        let step = tracker.step(&mut track, self.observed(begun.frame));
        let mut uncertainty = Uncertainty::new(&self.zero_pose_variance);
        let mut sigmas = vec![0.0; self.database.num_dofs()];
        tracker.standard_deviations(&mut uncertainty, &mut sigmas);
        track.copy_from(&begun.track);
        let mut found = Vec::new();
        for frame in (frames.start..begun.frame).rev() {
            if let Some(start) = begun.pose {
                let clip = &self.database.clips()[self.database.clip_at(start.pose)];
                // The track of a start ends in the pose before it.
                let pose = (start.pose + 1 + frame).saturating_sub(begun.frame);
                tracker.place(
                    &StartPose { pose: pose.max(clip.first_pose + self.parameters.window), ..start },
                    &mut track,
                );
            }
            let quality = FrameQuality {
                residual_m: 0.0,
                sigma_rad: tracker.unmeasured_deviations(&mut uncertainty, &mut sigmas),
                energy: 0.0,
                neighbour_distance_deg: step.neighbour_distance,
                measured_points: 0,
            };
            if frame < frames.end {
                found.push((track.newest().to_vec(), sigmas.clone(), quality));
            }
        }
        for (pose, sigmas, quality) in found.into_iter().rev() {
            reconstruction.coordinates.extend(pose);
            reconstruction.sigmas.extend(sigmas);
            reconstruction.quality.push(quality);
        }
    }

    /// The best of several beginnings at `frame` (method §2, mend 8): database poses whose control points fit the
    /// coming frames, each run over these frames, and `current` among them if there is one. The one that makes the
    /// measurements most probable wins. If fewer than two points are measured at `frame`, it begins at the first frame in which
    /// two are.
    pub(crate) fn start(
        &self,
        tracker: &mut Tracker<'_>,
        frame: usize,
        current: Option<Track>,
    ) -> Result<Begun> {
        tracker.begin(FramePart::Start);
        let trajectories = &self.session.trajectories;
        // Without two measured points there is nothing to fit: look at the first frame that has them.
        let has_two = |f: &usize| trajectories.frame(*f).iter().filter(|p| p.x.is_finite()).count() >= 2;
        let after = (frame..trajectories.num_frames()).find(has_two);
        // Nothing comes any more: start as things stood when something was last measured.
        let first = after.or_else(|| (0..frame).rev().find(has_two)).unwrap_or(frame);
        let ahead = self.parameters.start_frames.min(trajectories.num_frames() - first);
        let offsets: Vec<usize> = (0..ahead).step_by(3).collect();
        let observed: Vec<Option<Vector3<f64>>> = offsets
            .iter()
            .flat_map(|o| (0..trajectories.num_points()).map(move |p| trajectories.position(first + o, p)))
            .collect();
        let starts = start_poses(
            self.database,
            tracker.table,
            &offsets,
            &observed,
            self.parameters.window,
            self.parameters.start_skeleton_weight,
            &self.exclude_poses,
            self.parameters.start_candidates,
        );
        let from_database = starts.iter().map(|s| (tracker.track_from(s), Some(*s)));
        let mut probes: Vec<Probe> = from_database
            .chain(current.map(|track| (track, None)))
            .map(|(start, pose)| Probe { now: start.clone(), start, pose, surprise: 0.0 })
            .collect();
        // All run a third of the way, the best few to the end.
        for (part, keep) in [(first..first + ahead / 3, FINALISTS), (first + ahead / 3..first + ahead, 1)] {
            for probe in &mut probes {
                for f in part.clone() {
                    probe.surprise += tracker.step(&mut probe.now, self.observed(f)).solution.surprise();
                }
            }
            probes.sort_by(|a, b| a.surprise.total_cmp(&b.surprise));
            probes.truncate(keep);
        }
        let best = probes.into_iter().next().ok_or(Error::NoStart { frame })?;
        // Where nothing comes any more, it goes on from here without measurements.
        Ok(Begun { track: best.start, frame: after.unwrap_or(frame), pose: best.pose })
    }
}

/// Where the control points of `session` would be in every pose of the database (about 3 µs a pose). Sessions of the same
/// skeleton and points may share it.
///
/// # Errors
/// If the session's skeleton has another structure than the database's.
pub fn control_table(
    database: &MotionDatabase,
    index: &WindowIndex,
    session: &Session,
) -> Result<ControlTable> {
    check_structure(database, session)?;
    let zero_pose = database.zero_pose_prior(&session.skeleton).mean;
    control_table_of(database, index, session, &zero_pose, &[])
}

/// The same for a performer whose zero pose is known, with what is measured in the frames `around` each.
pub(crate) fn control_table_of(
    database: &MotionDatabase,
    index: &WindowIndex,
    session: &Session,
    zero_pose: &[f64],
    around: &[i32],
) -> Result<ControlTable> {
    check_structure(database, session)?;
    let kinematics = database.kinematics(&session.skeleton);
    let points = PointSet::new(&kinematics, session.points.clone());
    Ok(ControlTable::new(database, index, &session.skeleton, &kinematics, &points, zero_pose, around))
}

fn check_structure(database: &MotionDatabase, session: &Session) -> Result<()> {
    match database.structure_difference(&session.skeleton) {
        Some(difference) => Err(Error::Skeleton { difference }),
        None => Ok(()),
    }
}
