use crate::{counted, shown};

/// What is wrong with a skeleton, a motion or a set of trajectories.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A skeleton needs a root.
    #[error("skeleton has no joints, expected at least a root")]
    NoJoints,
    /// Joints are stored parents first.
    #[error(
        "joint {joint} ({name}) has parent {parent:?}, expected an earlier joint (only joint 0 is the root)"
    )]
    ParentOrder {
        /// index of the joint
        joint: usize,
        /// its name
        name: String,
        /// the parent found
        parent: Option<usize>,
    },
    /// Two joints may not share a name.
    #[error("two joints are named {name}, expected names to be unique")]
    DuplicateName {
        /// the name
        name: String,
    },
    /// A joint has the same channel twice.
    #[error("joint {name} has channel {channel} twice")]
    DuplicateChannel {
        /// name of the joint
        name: String,
        /// the channel
        channel: String,
    },
    /// A length, angle or limit is not a finite number.
    #[error("{what} of joint {name} is not finite")]
    NotFinite {
        /// which quantity
        what: &'static str,
        /// name of the joint
        name: String,
    },
    /// The number of values is not a multiple of the number of DOFs.
    #[error("motion has {}, expected a multiple of the skeleton's {dofs} DOFs", counted(values, "value"))]
    ValueCount {
        /// values found
        values: usize,
        /// DOFs of the skeleton
        dofs: usize,
    },
    /// A frame rate that is not positive and finite.
    #[error("frame rate is {}, expected a positive number", shown(*found))]
    FrameRate {
        /// the rate found
        found: f64,
    },
    /// A value of a motion is not a finite number.
    #[error("frame {frame}, channel {channel} of joint {joint} is {found}, expected a finite number")]
    NotFiniteValue {
        /// frame, from 0
        frame: usize,
        /// name of the joint
        joint: String,
        /// name of the channel
        channel: String,
        /// the value found
        found: f64,
    },
    /// The number of positions is not frames times points.
    #[error("found {}, expected a multiple of {points} points", counted(positions, "position"))]
    PositionCount {
        /// positions found
        positions: usize,
        /// number of points
        points: usize,
    },
    /// The number of standard deviations is not that of the positions.
    #[error("found {sigmas} standard deviations, expected one for each of {positions} positions")]
    SigmaCount {
        /// standard deviations found
        sigmas: usize,
        /// number of positions
        positions: usize,
    },
    /// A standard deviation that is not positive and finite.
    #[error(
        "frame {frame}, point {point} has a standard deviation of {} m, expected a positive number",
        shown(*found)
    )]
    Sigma {
        /// frame, from 0
        frame: usize,
        /// name of the point
        point: String,
        /// the value found
        found: f64,
    },
    /// An invalid camera.
    #[error("camera {name}: {what}")]
    Camera {
        /// name of the camera
        name: String,
        /// what is wrong
        what: String,
    },
    /// A vertex of a mesh is not finite.
    #[error("vertex {vertex} is not finite")]
    Vertex {
        /// index of the vertex
        vertex: usize,
    },
    /// A face names a vertex that isn't there.
    #[error("face {face} has corners {found:?}, expected indices below {vertices}, the number of vertices")]
    Face {
        /// index of the face
        face: usize,
        /// its corners
        found: [u32; 3],
        /// vertices of the mesh
        vertices: usize,
    },
    /// An image whose number of pixels is not its size.
    #[error("found {found} pixels, expected {width} x {height}")]
    PixelCount {
        /// pixels found
        found: usize,
        /// pixels in a row
        width: usize,
        /// rows
        height: usize,
    },
}
