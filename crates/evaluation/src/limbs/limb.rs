//! An arm or a leg as the paper has them: two joints of three rotations each, hung from a place that is given.

use inverse_kinematics::{Chain, Result, flesh::Flesh};
use kinematics::{ControlPoint, HEADING, Parametrisation, ROOT_DOFS, References, rotation_exp, rotation_log};
use model::{Axis, Channel, Joint, Skeleton};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// Index of the chain's point at the shoulder or hip.
pub const BASE: usize = 0;
/// Index of the point at the elbow or knee.
pub const INNER: usize = 1;
/// Index of the point at the wrist or ankle.
pub const END: usize = 2;
/// Index of the first of the three numbers of the upper joint's rotation vector, radians.
pub const UPPER: usize = ROOT_DOFS;
/// Index of the first of the three numbers of the lower joint's rotation vector, radians.
pub const LOWER: usize = ROOT_DOFS + 3;
/// Number of coordinates.
pub const DOFS: usize = ROOT_DOFS + 6;

/// Bones and limits of a limb.
#[derive(Debug, Clone, PartialEq)]
pub struct Build {
    /// from shoulder or hip to elbow or knee, at rest, metres
    pub upper: Vector3<f64>,
    /// from there to wrist or ankle, at rest, metres
    pub lower: Vector3<f64>,
    /// axis about which the inner joint bends, at rest, any length
    pub hinge: Vector3<f64>,
    /// least and greatest bend from rest, radians
    pub bend: [f64; 2],
    /// least and greatest turn of the upper bone about itself, radians; it decides on which side the inner joint can be
    pub twist: [f64; 2],
    /// how far the inner joint gives way about other axes than its hinge, radians
    pub play: f64,
    /// half width of the flesh for which the slopes of image supports are made, metres
    pub half_width_m: f64,
    /// flesh along the upper bone, from shoulder or hip; with none at all, images show the bones
    pub upper_flesh: Vec<Flesh>,
    /// flesh along the lower bone, from elbow or knee
    pub lower_flesh: Vec<Flesh>,
}

/// A limb as a chain. Its rotation vectors have their first axis along the hinge and their second along the upper bone.
#[derive(Debug, Clone)]
pub struct Limb {
    /// the chain
    pub chain: Chain,
    /// takes the axes of the rotation vectors to those of rest
    rest_from_axes: Rotation3<f64>,
}

impl Limb {
    /// The chain of a limb. The first three coordinates are the place of the base, the fourth is the heading of what it hangs
    /// from; these are set by the caller ([`place`]) and locked, and so is the tilt.
    ///
    /// # Errors
    /// If a bone or a limit isn't finite.
    pub fn new(build: &Build) -> Result<Self> {
        let rotations = || [Axis::X, Axis::Y, Axis::Z].map(Channel::rotation);
        let translations = [Axis::X, Axis::Y, Axis::Z].map(Channel::translation);
        let along = build.hinge.normalize();
        let across = along.cross(&build.upper).normalize();
        let rest_from_axes =
            Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along, across.cross(&along), across]));
        let mut joints = vec![
            Joint::root("base", translations.into_iter().chain(rotations()).collect()),
            Joint::child("upper", 0, Vector3::zeros(), rotations().to_vec()),
            Joint::child("lower", 1, build.upper, rotations().to_vec()),
        ];
        joints[1].axes = rest_from_axes;
        joints[2].axes = rest_from_axes;
        let skeleton = Skeleton::new("limb", joints)?;
        let point = |name: &str, joint, offset| ControlPoint { name: name.into(), joint, offset };
        let mut points = vec![
            point("base", 0, Vector3::zeros()),
            point("inner", 2, Vector3::zeros()),
            point("end", 2, build.lower),
        ];
        let mut widths = vec![1.0; points.len()];
        for (joint, name, flesh) in [(1, "upper", &build.upper_flesh), (2, "lower", &build.lower_flesh)] {
            points.extend(flesh.iter().map(|flesh| point(name, joint, flesh.middle)));
            widths.extend(flesh.iter().map(|flesh| (flesh.half_width_m / build.half_width_m).max(0.1)));
        }
        let segments = if points.len() > 4 {
            (END + 1..points.len() - 1).map(|from| [from, from + 1]).collect()
        } else {
            vec![[BASE, INNER], [INNER, END]]
        };
        let parametrisation = Parametrisation::smooth(&skeleton, &References::rest(&skeleton))?;
        let mut limits = vec![[0.0; 2]; DOFS];
        limits[UPPER..LOWER].fill([f64::NEG_INFINITY, f64::INFINITY]);
        limits[UPPER + 1] = build.twist;
        limits[LOWER] = build.bend;
        limits[LOWER + 1..].fill([-build.play, build.play]);
        let chain = Chain::new(&skeleton, parametrisation, points)?
            .with_segments(segments)?
            .with_widths(widths)?
            .with_limits(limits)?;
        Ok(Self { chain, rest_from_axes })
    }

    /// Turns the whole limb, in place, by `angle` (radians) about an axis through its base, given in the world: about the
    /// line from base to end, only the inner joint moves.
    pub fn swivel(&self, x: &mut [f64], axis: &Vector3<f64>, angle: f64) {
        let rest_from_world = Rotation3::from_axis_angle(&Vector3::y_axis(), -x[HEADING]);
        let axis = Unit::new_normalize(self.rest_from_axes.inverse() * (rest_from_world * axis));
        let upper = rotation_exp(&Vector3::from_column_slice(&x[UPPER..LOWER]));
        let turned = Rotation3::from_axis_angle(&axis, angle).into_inner() * upper;
        x[UPPER..LOWER].copy_from_slice(rotation_log(&turned).as_slice());
    }
}

/// Puts the base of a limb somewhere (metres) with a heading (radians about y), in place.
pub fn place(x: &mut [f64], base: &Vector3<f64>, heading: f64) {
    x[..3].copy_from_slice(base.as_slice());
    x[HEADING] = heading;
}
