use kinematics::{HEADING, Kinematics, Parametrisation, References, State};
use kinematics::{nearest_rotation_vector, rotation_exp, rotation_log};
use model::{Motion, Skeleton};
use nalgebra::{Matrix3, Vector3};

use crate::signal::{derivative, quantile, smooth};
use crate::{Error, Result};

/// Numbers per frame, independent of where the person is, where they look, and how long their legs are:
/// height of the root above the floor (leg lengths), forward and sideways speed (leg lengths/s), turning rate
/// (rad/s), tilt of the root (2 rad), the other joints' smooth coordinates (56 rad), and how firmly the left and
/// the right ball of the foot stand on the floor (0 to 1).
pub(crate) const CHANNELS: usize = CONTACT + 2;
pub(crate) const HEIGHT: usize = 0;
pub(crate) const FORWARD: usize = 1;
pub(crate) const SIDEWAYS: usize = 2;
pub(crate) const TURNING: usize = 3;
pub(crate) const TILT: usize = 4;
pub(crate) const JOINTS: usize = 6;
pub(crate) const CONTACT: usize = JOINTS + 56;

/// DOFs of the CMU skeleton.
pub(crate) const DOFS: usize = 62;

/// Indices of the joints that the features need.
#[derive(Debug, Clone)]
pub(crate) struct Landmarks {
    /// balls of the feet, left and right: the joint where the toes begin
    pub balls: [usize; 2],
    pub ankles: [usize; 2],
    pub wrists: [usize; 2],
    pub shoulders: [usize; 2],
    knees: [usize; 2],
    elbows: [usize; 2],
}

impl Landmarks {
    pub fn find(skeleton: &Skeleton) -> std::result::Result<Self, String> {
        let pair = |name: &str| -> std::result::Result<[usize; 2], String> {
            let find = |side: &str| {
                let name = format!("{side}{name}");
                skeleton.joint_index(&name).ok_or(format!("skeleton has no joint {name}"))
            };
            Ok([find("l")?, find("r")?])
        };
        if skeleton.num_dofs() != DOFS {
            return Err(format!("skeleton has {} DOFs, expected {DOFS}", skeleton.num_dofs()));
        }
        Ok(Self {
            balls: pair("toes")?,
            ankles: pair("foot")?,
            wrists: pair("wrist")?,
            shoulders: pair("humerus")?,
            knees: pair("tibia")?,
            elbows: pair("radius")?,
        })
    }

    /// Mean length of hip to ankle over both legs, metres.
    pub fn leg_m(&self, skeleton: &Skeleton) -> f64 {
        self.mean_length(skeleton, [self.knees, self.ankles])
    }

    /// Mean length of shoulder to wrist over both arms, metres.
    pub fn arm_m(&self, skeleton: &Skeleton) -> f64 {
        self.mean_length(skeleton, [self.elbows, self.wrists])
    }

    fn mean_length(&self, skeleton: &Skeleton, parts: [[usize; 2]; 2]) -> f64 {
        parts.iter().flatten().map(|&j| skeleton.joints()[j].offset.norm()).sum::<f64>() / 2.0
    }
}

/// Mean rotation of every joint over some motions: the references of the smooth coordinates.
pub(crate) fn mean_rotations(motions: &[&Motion]) -> Result<Vec<Vector3<f64>>> {
    let Some(first) = motions.first() else { return Err(Error::NoMotions) };
    let skeleton = first.skeleton();
    let smooth = Parametrisation::smooth(skeleton, &References::rest(skeleton))?;
    let mut sums = vec![Matrix3::zeros(); skeleton.num_joints()];
    let mut x = vec![0.0; skeleton.num_dofs()];
    for motion in motions {
        // One vote per motion, whatever its length.
        let weight = 1.0 / motion.num_frames().max(1) as f64;
        for pose in motion.poses() {
            smooth.coordinates_from_pose(motion.skeleton(), pose, 0.0, &mut x);
            for (j, sum) in sums.iter_mut().enumerate() {
                if let &[a, b, c] = &x[skeleton.dofs(j)] {
                    *sum += rotation_exp(&Vector3::new(a, b, c)) * weight;
                }
            }
        }
    }
    Ok(sums.iter().map(nearest_rotation).collect())
}

/// Rotation vector of the rotation nearest to a sum of rotations.
fn nearest_rotation(sum: &Matrix3<f64>) -> Vector3<f64> {
    let svd = sum.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) if sum.norm() > 1e-9 => {
            let sign = (u * v_t).determinant().signum();
            rotation_log(&(u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t))
        }
        _ => Vector3::zeros(),
    }
}

/// The smooth coordinates of a skeleton about stored reference rotations.
pub(crate) fn parametrisation(skeleton: &Skeleton, references: &[Vector3<f64>]) -> Result<Parametrisation> {
    let rotations = references.iter().map(rotation_exp).collect();
    Ok(Parametrisation::smooth(skeleton, &References { rotations, ..References::rest(skeleton) })?)
}

/// One recorded motion as features, with what segmentation looks at.
pub(crate) struct Track {
    pub frame_rate: f64,
    /// row-major, shape `[frames, CHANNELS]`
    pub rows: Vec<[f64; CHANNELS]>,
    /// world positions, metres: balls of the feet, left and right
    pub balls: [Vec<Vector3<f64>>; 2],
    /// how far the left foot is in front of the right, leg lengths
    pub stride: Vec<f64>,
    /// distance of shoulder and wrist over the arm's length, left and right
    pub reach: [Vec<f64>; 2],
    /// height of the balls of the feet when standing, metres
    pub floor_m: f64,
}

impl Track {
    pub fn new(motion: &Motion, landmarks: &Landmarks, references: &[Vector3<f64>]) -> Result<Self> {
        let skeleton = motion.skeleton();
        let parametrisation = parametrisation(skeleton, references)?;
        let coordinates = measured_coordinates(motion, &parametrisation);
        let kinematics = Kinematics::new(skeleton, parametrisation);
        let (leg_m, arm_m) = (landmarks.leg_m(skeleton), landmarks.arm_m(skeleton));
        let rate = motion.frame_rate();
        let mut track = Self {
            frame_rate: rate,
            rows: vec![[0.0; CHANNELS]; coordinates.len()],
            balls: Default::default(),
            stride: Vec::new(),
            reach: Default::default(),
            floor_m: 0.0,
        };
        let mut state = kinematics.state();
        for x in &coordinates {
            kinematics.update(x, &mut state);
            track.look(&state, landmarks, x[HEADING], leg_m, arm_m);
        }
        let lowest: Vec<f64> =
            std::iter::zip(&track.balls[0], &track.balls[1]).map(|(l, r)| l.y.min(r.y)).collect();
        track.floor_m = quantile(&lowest, 0.25);
        track.fill_rows(&coordinates, leg_m);
        track.fill_contacts();
        Ok(track)
    }

    fn look(&mut self, state: &State, landmarks: &Landmarks, heading: f64, leg_m: f64, arm_m: f64) {
        for side in 0..2 {
            self.balls[side].push(state.positions[landmarks.balls[side]]);
            let arm = state.positions[landmarks.wrists[side]] - state.positions[landmarks.shoulders[side]];
            self.reach[side].push(arm.norm() / arm_m);
        }
        let apart = state.positions[landmarks.ankles[0]] - state.positions[landmarks.ankles[1]];
        self.stride.push((apart.x * heading.sin() + apart.z * heading.cos()) / leg_m);
    }

    fn fill_rows(&mut self, coordinates: &[[f64; DOFS]], leg_m: f64) {
        let column = |dof: usize| -> Vec<f64> { coordinates.iter().map(|x| x[dof]).collect() };
        let speed = |dof: usize| smooth(&derivative(&column(dof), self.frame_rate), 0.02 * self.frame_rate);
        let (vx, vz, turning) = (speed(0), speed(2), speed(HEADING));
        for (frame, (row, x)) in self.rows.iter_mut().zip(coordinates).enumerate() {
            let (sin, cos) = x[HEADING].sin_cos();
            row[HEIGHT] = (x[1] - self.floor_m) / leg_m;
            row[FORWARD] = (vx[frame] * sin + vz[frame] * cos) / leg_m;
            row[SIDEWAYS] = (vx[frame] * cos - vz[frame] * sin) / leg_m;
            row[TURNING] = turning[frame];
            row[TILT..CONTACT].copy_from_slice(&x[HEADING + 1..]);
        }
    }

    /// A ball of the foot that is slow and low stands.
    fn fill_contacts(&mut self) {
        let rate = self.frame_rate;
        for side in 0..2 {
            let along = |axis: usize| -> Vec<f64> {
                let positions: Vec<f64> = self.balls[side].iter().map(|p| p[axis]).collect();
                derivative(&smooth(&positions, 0.012 * rate), rate)
            };
            let (vx, vy, vz) = (along(0), along(1), along(2));
            let firmness: Vec<f64> = (0..self.rows.len())
                .map(|i| {
                    let speed = (vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i]).sqrt();
                    let height_m = self.balls[side][i].y - self.floor_m;
                    (1.5 - speed / 0.5).clamp(0.0, 1.0) * (1.8 - height_m / 0.05).clamp(0.0, 1.0)
                })
                .collect();
            for (row, c) in self.rows.iter_mut().zip(smooth(&firmness, 0.012 * rate)) {
                row[CONTACT + side] = c;
            }
        }
    }
}

/// Smooth coordinates of every frame, continuous in time, with unmeasured joints filled in from their neighbours.
fn measured_coordinates(motion: &Motion, parametrisation: &Parametrisation) -> Vec<[f64; DOFS]> {
    let skeleton = motion.skeleton();
    let mut all: Vec<[f64; DOFS]> = Vec::with_capacity(motion.num_frames());
    for pose in motion.poses() {
        let mut x = [0.0; DOFS];
        let previous_heading = all.last().map_or(0.0, |p| p[HEADING]);
        parametrisation.coordinates_from_pose(skeleton, pose, previous_heading, &mut x);
        all.push(x);
    }
    fill_unmeasured(motion, &mut all);
    for j in 1..skeleton.num_joints() {
        if skeleton.dofs(j).len() == 3 {
            unwrap_vectors(&mut all, skeleton.dofs(j).start);
        }
    }
    for (j, joint) in skeleton.joints().iter().enumerate().skip(1) {
        for (dof, channel) in skeleton.dofs(j).zip(&joint.channels) {
            if joint.channels.len() < 3 {
                let middle = channel.limits.map_or(0.0, |(low, high)| 0.5 * (low + high));
                undo_flips(&mut all, dof, if middle.is_finite() { middle } else { 0.0 });
            }
        }
    }
    all
}

/// Makes the rotation vectors at three DOFs continuous in time.
fn unwrap_vectors(all: &mut [[f64; DOFS]], first_dof: usize) {
    let at = |x: &[f64; DOFS]| Vector3::from_column_slice(&x[first_dof..first_dof + 3]);
    for i in 1..all.len() {
        let v = nearest_rotation_vector(&at(&all[i]), &at(&all[i - 1]));
        all[i][first_dof..first_dof + 3].copy_from_slice(v.as_slice());
    }
}

/// Recordings of these joints flip by half a turn from one frame to the next (the thumbs above all): makes the
/// angle continuous, and puts the motion's mean within a quarter turn of the middle of the joint's limits.
fn undo_flips(all: &mut [[f64; DOFS]], dof: usize, middle: f64) {
    use std::f64::consts::PI;
    for i in 1..all.len() {
        let jump = all[i][dof] - all[i - 1][dof];
        all[i][dof] -= (jump / PI).round() * PI;
    }
    let mean = all.iter().map(|x| x[dof]).sum::<f64>() / all.len().max(1) as f64;
    let shift = ((mean - middle) / PI).round() * PI;
    all.iter_mut().for_each(|x| x[dof] -= shift);
}

/// Three angles of exactly 0 say that the joint was not measured in that frame, nor what hangs from it.
fn fill_unmeasured(motion: &Motion, all: &mut [[f64; DOFS]]) {
    let skeleton = motion.skeleton();
    let mut missing_of_joint: Vec<Vec<bool>> = vec![vec![false; all.len()]];
    for (j, joint) in skeleton.joints().iter().enumerate().skip(1) {
        let dofs = skeleton.dofs(j);
        let mut missing = joint.parent.map(|p| missing_of_joint[p].clone()).unwrap_or_default();
        if dofs.len() == 3 {
            for (frame, pose) in motion.poses().enumerate() {
                missing[frame] |= pose[dofs.clone()].iter().all(|&v| v == 0.0);
            }
        }
        if !missing.iter().all(|&m| m) {
            dofs.for_each(|dof| interpolate(all, dof, &missing));
        }
        missing_of_joint.push(missing);
    }
}

fn interpolate(all: &mut [[f64; DOFS]], dof: usize, missing: &[bool]) {
    for i in (0..all.len()).filter(|&i| missing[i]) {
        let before = (0..i).rev().find(|&b| !missing[b]);
        let after = (i + 1..all.len()).find(|&a| !missing[a]);
        all[i][dof] = match (before, after) {
            (Some(b), Some(a)) => {
                let share = (i - b) as f64 / (a - b) as f64;
                all[b][dof] * (1.0 - share) + all[a][dof] * share
            }
            (Some(k), None) | (None, Some(k)) => all[k][dof],
            (None, None) => all[i][dof],
        };
    }
}
