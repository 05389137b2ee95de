use model::{counted, shown};

/// Why a session cannot be reconstructed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter out of range.
    #[error("{name} is {found}, expected {expected}")]
    Parameter {
        /// name of the parameter
        name: &'static str,
        /// value found
        found: String,
        /// what is valid
        expected: &'static str,
    },
    /// A control point without a trajectory.
    #[error("control point {name} has no trajectory, expected one of: {found}")]
    NoTrajectory {
        /// the point
        name: String,
        /// trajectories there are
        found: String,
    },
    /// Too few or too many control points.
    #[error("{}{}; 2 to {max} are needed", if *found == 1 { "only " } else { "" }, counted(found, "control point"))]
    PointCount {
        /// number found
        found: usize,
        /// most points
        max: usize,
    },
    /// A control point asked for twice.
    #[error("control point {name} is given twice, expected every point once")]
    PointTwice {
        /// its name
        name: String,
    },
    /// Points too far apart to be on one body.
    #[error(
        "control points are {spread_m:.1} m apart in half of the frames, the skeleton's legs are {leg_m:.2} m long: \
         are the positions in millimetres or centimetres? They must be in metres"
    )]
    Unit {
        /// median over the frames of the widest distance, metres
        spread_m: f64,
        /// leg length of the skeleton, metres
        leg_m: f64,
    },
    /// Coordinates of another system, such as a map's.
    #[error(
        "{count} of {measured} measured samples are more than 100 km from the origin (the first: {point} in frame {frame} at \
         {} m): expected metres from an origin near the capture",
        position.map(|v| shown(v.round())).join(" ")
    )]
    FarFromOrigin {
        /// samples that far away
        count: usize,
        /// samples that were measured
        measured: usize,
        /// point of the first of them
        point: String,
        /// frame of the first of them
        frame: usize,
        /// where it is, metres
        position: [f64; 3],
    },
    /// Not enough was measured to begin with.
    #[error(
        "fewer than two control points are measured in any of {}, expected a frame with at least two",
        counted(frames, "frame")
    )]
    NothingMeasured {
        /// frames of the session
        frames: usize,
    },
    /// The session's skeleton is not the database's.
    #[error("session skeleton does not fit the motion database: {difference}")]
    Skeleton {
        /// the first difference
        difference: String,
    },
    /// A trial has fewer frames than asked for.
    #[error("frames {start} to {end} were asked for, session has {frames}")]
    Range {
        /// first frame
        start: usize,
        /// one past the last frame
        end: usize,
        /// frames of the session
        frames: usize,
    },
    /// No pose of the database fits the first frames.
    #[error("found no start pose at frame {frame}: no database pose has motion before and after it")]
    NoStart {
        /// the frame
        frame: usize,
    },
    /// The caller asked to stop.
    #[error("stopped at frame {frame}")]
    Stopped {
        /// frame at which it stopped
        frame: usize,
    },
    /// An artefact that cannot be read.
    #[error("not a {what}: {found}")]
    Bytes {
        /// kind of artefact
        what: &'static str,
        /// what was found
        found: String,
    },
    /// A live state that cannot be resumed.
    #[error("live state is {found}, expected {expected}")]
    LiveState {
        /// what was found
        found: String,
        /// what is valid
        expected: String,
    },
    /// Method gplvm without a model.
    #[error(
        "method gplvm needs a trained latent variable model, and the motion database has none; train it first"
    )]
    NoModel,
    /// A latent variable model of another database.
    #[error(
        "the latent variable model is of poses of {found} numbers, the motion database has poses of {expected}"
    )]
    OtherModel {
        /// numbers of a pose of the model
        found: usize,
        /// numbers of a pose of the database
        expected: usize,
    },
    /// Chunks that do not make up the session.
    #[error("chunks end at frame {found}, expected frame {expected}")]
    Chunks {
        /// first frame that is not covered
        found: usize,
        /// frame expected
        expected: usize,
    },
    /// The model refuses.
    #[error(transparent)]
    Regression(#[from] regression::Error),
    /// The database refuses.
    #[error(transparent)]
    Database(#[from] motion_db::Error),
    /// The skeleton refuses.
    #[error(transparent)]
    Kinematics(#[from] kinematics::Error),
    /// The vocabulary refuses.
    #[error(transparent)]
    Model(#[from] model::Error),
}
