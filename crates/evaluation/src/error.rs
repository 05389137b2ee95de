use model::counted;

/// Why an evaluation cannot run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number of control points without a set.
    #[error("{} asked for, expected 2 to 6", counted(found, "control point"))]
    Points {
        /// number asked for
        found: usize,
    },
    /// Noise that is none.
    #[error("noise of control points is {} mm, expected 0 to 1000 mm", .found_m * 1e3)]
    Noise {
        /// standard deviation, metres
        found_m: f64,
    },
    /// A gap that is none.
    #[error(
        "occlusion is {found:?}, expected what is hidden and how long, one:0.5s or all:0.5s (up to 600 s)"
    )]
    Occlusion {
        /// what was found
        found: String,
    },
    /// A parameter out of range.
    #[error(transparent)]
    Parameters {
        /// which, and what is wrong with it
        source: sparse::Error,
    },
    /// The threads do not start.
    #[error("cannot start {wanted} threads: {problem}")]
    Threads {
        /// number of threads
        wanted: usize,
        /// what the system says
        problem: String,
    },
    /// A model cannot be trained.
    #[error("training the latent variable model: {source}")]
    Training {
        /// what is wrong
        source: sparse::Error,
    },
    /// A trial cannot be reconstructed.
    #[error("trial {trial}: {source}")]
    Trial {
        /// name of the trial
        trial: String,
        /// what is wrong
        source: sparse::Error,
    },
    /// The database cannot be built.
    #[error(transparent)]
    Database(#[from] motion_db::Error),
    /// A recording that the body can't follow.
    #[error("{name}: {source}")]
    Recording {
        /// name of the recording
        name: String,
        /// what is wrong
        source: Box<Self>,
    },
    /// A recorded skeleton, or a body's rig, without a joint that is needed.
    #[error("the skeleton has no joint {name}, expected one of the CMU skeleton")]
    MissingJoint {
        /// name of the joint
        name: &'static str,
    },
    /// A chain that cannot be made or solved.
    #[error(transparent)]
    InverseKinematics(#[from] inverse_kinematics::Error),
    /// There is no surface to measure to.
    #[error("the mesh has {faces} faces and an area of {area_m2} m², expected a surface")]
    NoSurface {
        /// faces of the mesh
        faces: usize,
        /// their area, square metres
        area_m2: f64,
    },
    /// Poses of a database that make no motion.
    #[error("{name}: {source}")]
    Motion {
        /// name of the clip
        name: String,
        /// what is wrong
        source: model::Error,
    },
    /// Fewer training poses than were asked for.
    #[error(
        "the recordings have {}, {every} seconds apart, expected at least {expected}",
        counted(found, "pose")
    )]
    TooFewPoses {
        /// poses found
        found: usize,
        /// seconds from one to the next
        every: f64,
        /// poses asked for
        expected: usize,
    },
}
