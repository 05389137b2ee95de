//! Forward kinematics and its analytic Jacobian, on flat arrays that are parents first.
//!
//! A pose of a file (Euler angles, [`model::Motion`]) is turned into *coordinates* of the same length, in which
//! every number moves smoothly and nothing jumps by 2π: see [`Parametrisation`]. The derivative of every point
//! comes from the world axis and pivot of each coordinate; no finite differences (docs/papers.md#notation).
//!
//! ```
//! use kinematics::{Kinematics, Parametrisation};
//! use model::{Axis, Channel, Joint, Skeleton};
//! use nalgebra::Vector3;
//! let mut arm = Joint::root("arm", vec![Channel::rotation(Axis::Z)]);
//! arm.tip = Vector3::x();
//! let arm = Skeleton::new("arm", vec![arm]).unwrap();
//! let kinematics = Kinematics::new(&arm, Parametrisation::channels(&arm));
//! let mut state = kinematics.state();
//! kinematics.update(&[std::f64::consts::FRAC_PI_2], &mut state);
//! assert!((state.point(0, &Vector3::x()) - Vector3::y()).norm() < 1e-12);
//! ```

mod error;
mod euler;
mod forward;
mod jacobian;
mod parametrisation;
mod points;
mod rotation_vector;

pub use error::Error;
pub use euler::{
    angles_from_rotation, can_flip, nearest_equivalent, nearest_flip, rotation_from_angles, unwrap_near,
};
pub use forward::{Kinematics, State};
pub use jacobian::check_jacobian;
pub use parametrisation::{HEADING, Parametrisation, ROOT_DOFS, References};
pub use points::{ControlPoint, PointSet, control_points};
pub use rotation_vector::{left_jacobian, nearest_rotation_vector, rotation_exp, rotation_log};

/// Result of the fallible functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;
