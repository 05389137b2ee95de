//! Bringing scans to one place and one pose. People don't stand exactly the same: what their joints do is taken out before
//! their shapes are compared.

use nalgebra::{Matrix3, Rotation3, Vector3};
use rayon::prelude::*;

use super::check::check_scan;
use super::options::{Alignment, LearnOptions, Scan};
use super::principal::principal;
use crate::procrustes::rigid;
use crate::subject::Subject;
use crate::{BodyModel, Posed, RegisteredOptions, Result, Template, fit_registered};

/// Components of the model of every round, and how far its vertices may be off, metres. The first components are size and
/// build; later ones, before the poses are out, are poses. What few components can't show must not be taken for pose, so
/// vertices count for little at first.
const ROUNDS: [(usize, f64); 4] = [(5, 0.1), (10, 0.07), (20, 0.05), (20, 0.035)];
/// By how much people miss the base pose at every joint, radians.
const STANCE_SIGMA: f64 = 0.1;

/// Scans in the template's pose, turned to face +z, the pelvis over the origin and the lowest vertex on the floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Aligned {
    /// metres, shape `[scans, vertices]`
    pub shapes: Vec<Vec<Vector3<f64>>>,
    /// the pose that each scan stood in, shape `[scans, dofs]`; zeros where the scans were not unposed
    pub poses: Vec<Vec<f64>>,
    /// what is known of the people
    pub subjects: Vec<Subject>,
}

impl Aligned {
    /// Checks the scans and takes their poses out.
    ///
    /// A first model is learned from the scans as they stand, with few components. Each round fits pose and shape of the last
    /// model to every scan ([`fit_registered`]), undoes the pose ([`unpose`]), and learns the next model, of more components.
    ///
    /// # Errors
    /// [`crate::Error::Scan`] names the first scan that is wrong.
    pub fn new(scans: &[Scan<'_>], template: &Template, options: &LearnOptions) -> Result<Self> {
        scans.par_iter().map(|scan| check_scan(scan, template)).collect::<Result<Vec<()>>>()?;
        let stands = |scan: &Scan<'_>| match options.alignment {
            Alignment::AsTheyStand => scan.vertices.to_vec(),
            Alignment::Turned | Alignment::Unposed => face_forward(scan.vertices, template),
        };
        let standing: Vec<Vec<_>> = scans.iter().map(stands).collect();
        let mut aligned = Self {
            shapes: standing.clone(),
            poses: vec![vec![0.0; template.rig.num_dofs()]; scans.len()],
            subjects: scans.iter().map(|scan| scan.subject).collect(),
        };
        if scans.len() < 2 || options.alignment != Alignment::Unposed {
            return Ok(aligned);
        }
        for (components, sigma_m) in ROUNDS {
            let shapes: Vec<_> = aligned.shapes.iter().map(Vec::as_slice).collect();
            let model = principal(&shapes, template, components, "")?.model;
            let found: Vec<_> = standing.par_iter().map(|scan| straighten(&model, scan, sigma_m)).collect();
            (aligned.poses, aligned.shapes) = found.into_iter().unzip();
        }
        Ok(aligned)
    }
}

/// Pose of a scan by a model, and its shape without that pose.
fn straighten(model: &BodyModel, scan: &[Vector3<f64>], sigma_m: f64) -> (Vec<f64>, Vec<Vector3<f64>>) {
    let options = RegisteredOptions {
        stride: 10,
        sigma_m,
        angle_sigma: Some(STANCE_SIGMA),
        components: model.num_components(),
        iterations: 6,
    };
    let fit = fit_registered(model, &model.shape(&[]), scan, &options);
    let mut shape = unpose(model, &fit.pose, scan);
    let joints = model.regressor().joints(&shape);
    set_down(&mut shape, &joints);
    (fit.pose, shape)
}

/// The body in its rest pose that skinning brings to `posed`: every vertex by the inverse of its blended transform. The
/// bones are those between the regressor's joints of the posed mesh, turned back.
pub fn unpose(model: &BodyModel, pose: &[f64], posed: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let joints = model.regressor().joints(posed);
    let mut turned = Posed::default();
    model.shape(&[]).pose_joints(model, pose, &mut turned);
    let rotations: Vec<Rotation3<f64>> = turned.world_from_rest.iter().map(|a| a.rotation).collect();
    let mut rest: Vec<Vector3<f64>> = Vec::new();
    for (joint, position) in joints.iter().enumerate() {
        rest.push(match model.rig().joints()[joint].parent {
            None => position - Vector3::new(pose[0], pose[1], pose[2]),
            Some(parent) => rest[parent] + rotations[parent].inverse() * (position - joints[parent]),
        });
    }
    let undo = |(vertex, position): (usize, &Vector3<f64>)| {
        let (mut turn, mut shift) = (Matrix3::zeros(), Vector3::zeros());
        for (joint, weight) in model.skin().influences(vertex) {
            turn += rotations[joint].matrix() * weight;
            shift += (joints[joint] - rotations[joint] * rest[joint]) * weight;
        }
        // Blends of turns that differ by half a turn have no inverse; such a vertex stays.
        turn.try_inverse().map_or(*position, |inverse| inverse * (position - shift))
    };
    posed.iter().enumerate().map(undo).collect()
}

/// The scan turned about the vertical to face as the template does, and set down.
fn face_forward(scan: &[Vector3<f64>], template: &Template) -> Vec<Vector3<f64>> {
    let yaw = rigid(template.rest.iter().zip(scan)).yaw;
    let back = Rotation3::from_axis_angle(&Vector3::y_axis(), -yaw);
    let mut turned: Vec<_> = scan.iter().map(|vertex| back * vertex).collect();
    let joints = template.regressor.joints(&turned);
    set_down(&mut turned, &joints);
    turned
}

/// Shifts a body so that its root is over the origin and its lowest vertex on the floor.
fn set_down(vertices: &mut [Vector3<f64>], joints: &[Vector3<f64>]) {
    let floor = vertices.iter().fold(f64::INFINITY, |low, vertex| low.min(vertex.y));
    let shift = Vector3::new(joints[0].x, floor, joints[0].z);
    vertices.iter_mut().for_each(|vertex| *vertex -= shift);
}
