use std::ops::Range;
use std::sync::Arc;

use kinematics::{Kinematics, PointSet};
use motion_db::{ControlTable, MotionDatabase, WindowIndex};
use regression::gplvm::Gplvm;

use crate::track::Observed;
use crate::{Error, FramePart, Parameters, Result, Session};

/// Frames around a frame whose measured points join its search, if the future is known: 0.1 s and 0.2 s away.
const AROUND: [i32; 4] = [-12, -6, 6, 12];

/// What is to be solved, frame after frame: a session, the motion that is known, and what is known of the performer.
pub(crate) struct Problem<'a> {
    pub database: &'a MotionDatabase,
    pub index: &'a WindowIndex,
    pub session: &'a Session,
    pub parameters: &'a Parameters,
    pub kinematics: Kinematics,
    pub points: PointSet,
    pub table: Arc<ControlTable>,
    /// the performer's zero pose, radians, shape `[dofs]`
    pub zero_pose: Vec<f64>,
    /// variance of what is not known of it, radians², shape `[dofs]`
    pub zero_pose_variance: Vec<f64>,
    /// frames around a frame that join its search
    pub around: &'static [i32],
    pub model: Option<&'a Gplvm>,
    pub watcher: Option<&'a (dyn Fn(FramePart) + Sync)>,
    /// windows and poses that may not be used, in rising order
    pub exclude_rows: Vec<Range<usize>>,
    pub exclude_poses: Vec<Range<usize>>,
}

impl<'a> Problem<'a> {
    /// Prepares a session, see [`crate::Reconstructor::new`].
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
        let table = table_around(database, index, session, &zero_pose, around)?.into();
        Ok(Self { around, ..Self::with_table(database, index, session, parameters, table)? })
    }

    /// The same with a control table made before, and without the frames around a frame.
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

    /// Numbers of a frame's control points in a query: three a point, in the frame and in those around it.
    pub fn num_controls(&self) -> usize {
        3 * self.points.len() * (1 + self.around.len())
    }

    /// What was measured at a frame of the session.
    pub fn observed(&self, frame: usize) -> Observed<'_> {
        let trajectories = &self.session.trajectories;
        let session = (!self.around.is_empty()).then_some((trajectories, frame));
        Observed { now: trajectories.samples(frame), session }
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
    table_around(database, index, session, &zero_pose, &[])
}

/// The same for a performer whose zero pose is known, with what is measured in the frames `around` each.
pub(crate) fn table_around(
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
