use std::f64::consts::PI;

use model::{Axis, Channel, ChannelKind, Skeleton};
use nalgebra::{Matrix3, Vector3};

use crate::euler::{angles_from_rotation, can_flip, nearest_flip, rotation_from_angles, unwrap_near};
use crate::rotation_vector::{nearest_rotation_vector, rotation_exp, rotation_log};
use crate::{Error, Result};

/// Number of coordinates of a free root: x, y, z (metres), heading, and the two numbers of its tilt (radians).
pub const ROOT_DOFS: usize = 6;
/// Index of the heading among the coordinates of a free root.
pub const HEADING: usize = 3;

/// How the rotation of a joint depends on its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum JointRotation {
    /// Euler angles: (DOF, axis), leftmost first. Also joints that do not rotate.
    Angles(Vec<(usize, Axis)>),
    /// `reference · exp(v)`, v at three DOFs in x, y, z order
    Vector { first_dof: usize, reference: Matrix3<f64> },
    /// `R_y(heading) · exp((s_x, 0, s_z))`: heading and tilt of a free root. Singular only upside down.
    HeadingTilt { first_dof: usize },
}

/// What smooth coordinates are measured from: the middle of each joint's range, so that what is far from it is rare.
#[derive(Debug, Clone, PartialEq)]
pub struct References {
    /// product of each joint's channel rotations, shape `[num_joints]`; used for joints with three rotations
    pub rotations: Vec<Matrix3<f64>>,
    /// angle (radians) of each DOF, shape `[dofs]`; used for joints with one or two rotations
    pub angles: Vec<f64>,
}

impl References {
    /// The rest pose.
    pub fn rest(skeleton: &Skeleton) -> Self {
        Self {
            rotations: vec![Matrix3::identity(); skeleton.num_joints()],
            angles: vec![0.0; skeleton.num_dofs()],
        }
    }
}

/// The meaning of the D coordinates that stand for a pose.
///
/// *Channels* are the file's own numbers. *Smooth* coordinates have the same length, but a free root is `x y z
/// heading tilt_x tilt_z` with heading taken out as the leftmost rotation about y (docs/papers.md#heading-frame,
/// docs/papers.md#smooth-angles: Acclaim's order is singular at headings of ±90°), and every joint with three
/// rotations has a rotation vector about a reference rotation, which has no gimbal pole. Joints with one or two
/// rotations keep their angles. Angles lie within half a turn of their reference (recorded thumbs run on for several
/// turns); only the heading runs on.
#[derive(Debug, Clone, PartialEq)]
pub struct Parametrisation {
    pub(crate) joints: Vec<JointRotation>,
    pub(crate) translations: Vec<Vec<(usize, Axis)>>,
    /// middle of each angle's range, shape `[dofs]`
    centres: Vec<f64>,
    /// DOFs (leftmost first) of the joints whose bones may be flipped, see [`can_flip`]
    flips: Vec<[usize; 2]>,
}

impl Parametrisation {
    /// The file's own channels.
    pub fn channels(skeleton: &Skeleton) -> Self {
        let joints = (0..skeleton.num_joints()).map(|j| channel_angles(skeleton, j)).collect();
        Self {
            joints,
            translations: translations(skeleton),
            centres: vec![0.0; skeleton.num_dofs()],
            flips: Vec::new(),
        }
    }

    /// Smooth coordinates about `references`.
    ///
    /// # Errors
    /// If the root does not have three translations and three rotations.
    pub fn smooth(skeleton: &Skeleton, references: &References) -> Result<Self> {
        let root = &skeleton.joints()[0];
        if root.channels.len() != ROOT_DOFS || root.num_rotations() != 3 {
            let channels = root.channels.iter().map(Channel::to_string).collect::<Vec<_>>().join(" ");
            return Err(Error::RootNotFree { joint: root.name.clone(), channels });
        }
        let mut translations = translations(skeleton);
        translations[0] = vec![(0, Axis::X), (1, Axis::Y), (2, Axis::Z)];
        let joints = skeleton.joints().iter().enumerate().map(|(j, joint)| {
            if j == 0 {
                JointRotation::HeadingTilt { first_dof: HEADING }
            } else if joint.num_rotations() == 3 {
                // The joint's translations, if any, come first among its coordinates.
                let first_dof = skeleton.dofs(j).end - 3;
                JointRotation::Vector { first_dof, reference: references.rotations[j] }
            } else {
                channel_angles(skeleton, j)
            }
        });
        let joints: Vec<_> = joints.collect();
        for (j, joint) in skeleton.joints().iter().enumerate().skip(1) {
            if matches!(joints[j], JointRotation::Vector { .. }) {
                let first = skeleton.dofs(j).start;
                for (slot, t) in translations[j].iter_mut().enumerate() {
                    t.0 = first + slot;
                }
            }
            debug_assert!(joint.channels.len() == skeleton.dofs(j).len());
        }
        let flips = joints.iter().enumerate().filter_map(|(j, rotation)| match rotation {
            JointRotation::Angles(angles) if can_flip(skeleton, j) => Some([angles[0].0, angles[1].0]),
            _ => None,
        });
        let flips = flips.collect();
        Ok(Self { joints, translations, centres: references.angles.clone(), flips })
    }

    /// Whether the coordinate is an angle in radians (otherwise a translation in metres).
    pub fn is_angle(&self, dof: usize) -> bool {
        !self.translations.iter().flatten().any(|(d, _)| *d == dof)
    }

    /// Smooth coordinates of a pose. `pose`: channel values, metres and radians, shape `[dofs]`; `previous_heading`
    /// (radians): the heading is unwrapped to it; `out`: coordinates, shape `[dofs]`.
    pub fn coordinates_from_pose(
        &self,
        skeleton: &Skeleton,
        pose: &[f64],
        previous_heading: f64,
        out: &mut [f64],
    ) {
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let base = skeleton.dofs(j).start;
            for (dof, axis) in &self.translations[j] {
                out[*dof] = base_value(&joint.channels, base, ChannelKind::Translation, *axis, pose);
            }
            match &self.joints[j] {
                JointRotation::Angles(angles) => {
                    for (dof, axis) in angles {
                        out[*dof] = base_value(&joint.channels, base, ChannelKind::Rotation, *axis, pose);
                    }
                }
                JointRotation::Vector { first_dof, reference } => {
                    let rotation = channel_rotation(skeleton, j, pose);
                    let v = rotation_log(&(reference.transpose() * rotation));
                    out[*first_dof..first_dof + 3].copy_from_slice(v.as_slice());
                }
                JointRotation::HeadingTilt { first_dof } => {
                    let axes = joint.axes.matrix();
                    let world = axes * channel_rotation(skeleton, j, pose) * axes.transpose();
                    let (heading, tilt) = heading_and_tilt(&world);
                    out[*first_dof] = unwrap_near(heading, previous_heading);
                    out[first_dof + 1] = tilt.x;
                    out[first_dof + 2] = tilt.z;
                }
            }
        }
        self.wrap(out);
    }

    /// Brings every angle but the heading back to within half a turn of its reference, in place: the same pose.
    pub fn wrap(&self, x: &mut [f64]) {
        for joint in &self.joints {
            match joint {
                JointRotation::Angles(angles) => {
                    for (dof, _) in angles {
                        x[*dof] = unwrap_near(x[*dof], self.centres[*dof]);
                    }
                }
                JointRotation::Vector { first_dof, .. } => {
                    let v = Vector3::new(x[*first_dof], x[first_dof + 1], x[first_dof + 2]);
                    if v.norm() > PI {
                        let v = nearest_rotation_vector(&v, &Vector3::zeros());
                        x[*first_dof..first_dof + 3].copy_from_slice(v.as_slice());
                    }
                }
                JointRotation::HeadingTilt { .. } => {}
            }
        }
        for &[a, b] in &self.flips {
            [x[a], x[b]] = nearest_flip([x[a], x[b]], [self.centres[a], self.centres[b]]);
        }
    }

    /// Of all coordinates that stand for the same pose as `x`, takes those nearest to `near`, in place: what lies between the
    /// two then is a pose between the two.
    pub fn unwrap_near(&self, x: &mut [f64], near: &[f64]) {
        for joint in &self.joints {
            match joint {
                JointRotation::Angles(angles) => {
                    for (dof, _) in angles {
                        x[*dof] = unwrap_near(x[*dof], near[*dof]);
                    }
                }
                JointRotation::Vector { first_dof, .. } => {
                    let vector = |x: &[f64]| Vector3::from_column_slice(&x[*first_dof..first_dof + 3]);
                    let v = nearest_rotation_vector(&vector(x), &vector(near));
                    x[*first_dof..first_dof + 3].copy_from_slice(v.as_slice());
                }
                JointRotation::HeadingTilt { first_dof } => {
                    x[*first_dof] = unwrap_near(x[*first_dof], near[*first_dof]);
                }
            }
        }
        for &[a, b] in &self.flips {
            [x[a], x[b]] = nearest_flip([x[a], x[b]], [near[a], near[b]]);
        }
    }

    /// Channel values of smooth coordinates: the inverse of [`Self::coordinates_from_pose`]. Euler angles are taken
    /// nearest to those of `previous` (a pose in channels), or to 0.
    pub fn pose_from_coordinates(
        &self,
        skeleton: &Skeleton,
        x: &[f64],
        previous: Option<&[f64]>,
        out: &mut [f64],
    ) {
        for (j, joint) in skeleton.joints().iter().enumerate() {
            let base = skeleton.dofs(j).start;
            for (dof, axis) in &self.translations[j] {
                if let Some(slot) = channel_slot(&joint.channels, ChannelKind::Translation, *axis) {
                    out[base + slot] = x[*dof];
                }
            }
            let rotation = match &self.joints[j] {
                JointRotation::Angles(angles) => {
                    for (dof, axis) in angles {
                        if let Some(slot) = channel_slot(&joint.channels, ChannelKind::Rotation, *axis) {
                            out[base + slot] =
                                previous.map_or(x[*dof], |p| unwrap_near(x[*dof], p[base + slot]));
                        }
                    }
                    continue;
                }
                JointRotation::Vector { first_dof, reference } => {
                    reference * rotation_exp(&Vector3::new(x[*first_dof], x[first_dof + 1], x[first_dof + 2]))
                }
                JointRotation::HeadingTilt { first_dof } => {
                    let world = rotation_exp(&Vector3::new(0.0, x[*first_dof], 0.0))
                        * rotation_exp(&Vector3::new(x[first_dof + 1], 0.0, x[first_dof + 2]));
                    let axes = joint.axes.matrix();
                    axes.transpose() * world * axes
                }
            };
            let [a, b, c] = joint.rotation_order[..] else { continue };
            let slots =
                [a, b, c].map(|axis| channel_slot(&joint.channels, ChannelKind::Rotation, axis).unwrap_or(0));
            let near = slots.map(|slot| previous.map_or(0.0, |p| p[base + slot]));
            for (slot, angle) in slots.into_iter().zip(angles_from_rotation([a, b, c], &rotation, near)) {
                out[base + slot] = angle;
            }
        }
    }
}

/// Heading (radians) and tilt vector (radians, y = 0) with `rotation = R_y(heading) · exp(tilt)`.
fn heading_and_tilt(rotation: &Matrix3<f64>) -> (f64, Vector3<f64>) {
    // Twist of the quaternion about y.
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(
        *rotation,
    ));
    let heading = 2.0 * q.j.atan2(q.w);
    let tilt = rotation_log(&(rotation_exp(&Vector3::new(0.0, -heading, 0.0)) * rotation));
    (heading, tilt)
}

fn translations(skeleton: &Skeleton) -> Vec<Vec<(usize, Axis)>> {
    let joint_translations = |j: usize| {
        let channels = skeleton.dofs(j).zip(&skeleton.joints()[j].channels);
        channels.filter(|(_, c)| c.kind == ChannelKind::Translation).map(|(dof, c)| (dof, c.axis)).collect()
    };
    (0..skeleton.num_joints()).map(joint_translations).collect()
}

fn channel_angles(skeleton: &Skeleton, j: usize) -> JointRotation {
    let joint = &skeleton.joints()[j];
    let base = skeleton.dofs(j).start;
    let angles = joint.rotation_order.iter().filter_map(|&axis| {
        channel_slot(&joint.channels, ChannelKind::Rotation, axis).map(|slot| (base + slot, axis))
    });
    JointRotation::Angles(angles.collect())
}

fn channel_slot(channels: &[Channel], kind: ChannelKind, axis: Axis) -> Option<usize> {
    channels.iter().position(|c| c.kind == kind && c.axis == axis)
}

fn base_value(channels: &[Channel], base: usize, kind: ChannelKind, axis: Axis, pose: &[f64]) -> f64 {
    channel_slot(channels, kind, axis).map_or(0.0, |slot| pose[base + slot])
}

/// The product of a joint's channel rotations, in the frame of its `axes`.
pub(crate) fn channel_rotation(skeleton: &Skeleton, j: usize, pose: &[f64]) -> Matrix3<f64> {
    let joint = &skeleton.joints()[j];
    let base = skeleton.dofs(j).start;
    let mut angles = [0.0; 3];
    for (angle, &axis) in angles.iter_mut().zip(&joint.rotation_order) {
        *angle = base_value(&joint.channels, base, ChannelKind::Rotation, axis, pose);
    }
    rotation_from_angles(&joint.rotation_order, &angles)
}
