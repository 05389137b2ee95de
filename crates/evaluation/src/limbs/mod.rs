//! The paper's test on limbs of recorded motion, seen by synthetic cameras instead of HumanEva's.
//!
//! Recorded motion drives the morphable body ([`Recording`]), which is drawn into the cameras. Every limb is a chain of two
//! joints of three rotations ([`limb`]); what it is told is where its base and its end are, and the
//! silhouettes of the whole body, in two cameras. Judged is where its elbow or knee is found. Every frame starts from
//! the solution of the one before; the first starts from a neutral posture.

use std::sync::Arc;

use body::{BodyModel, Posed, Shape};
use inverse_kinematics::{ImageView, Options, Support, SupportWidth};
use model::{Camera, Silhouette};
use nalgebra::Vector3;
use rayon::prelude::*;
use vision::{DistanceField, Rasteriser, Topology, View, scene::Ring};

use crate::recording::{LIMBS, rig_joints};
use crate::{Recording, Result};

mod followed;
pub mod limb;
mod still;

use followed::FollowedLimb;
pub use still::Still;

/// Two arms or two legs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limbs {
    /// shoulders, elbows, wrists
    Arms,
    /// hips, knees, ankles
    Legs,
}

impl Limbs {
    fn indices(self) -> [usize; 2] {
        match self {
            Self::Arms => [0, 1],
            Self::Legs => [2, 3],
        }
    }

    /// How far the inner joint is bent in a neutral posture, radians from the rest pose.
    fn neutral_bend(self) -> f64 {
        match self {
            Self::Arms => 0.8,
            Self::Legs => 0.3,
        }
    }

    /// Depth of the image support: a little more than half the width of the limb.
    fn width(self) -> SupportWidth {
        let inside_m = match self {
            Self::Arms => 0.06,
            Self::Legs => 0.09,
        };
        SupportWidth { inside_m, ..SupportWidth::default() }
    }
}

/// Two cameras a quarter of a turn apart, with the field of view and the resolution of HumanEva's (a pixel is 9 mm wide).
pub fn cameras() -> Vec<Camera> {
    let ring = Ring {
        cameras: 4,
        distance_m: 5.0,
        heights_m: [1.5, 1.8],
        target: Vector3::new(0.0, 1.0, 0.0),
        start: 0.6,
        size: 640,
        focal: 560.0,
    };
    ring.cameras().into_iter().take(2).collect()
}

/// Heading of the line between both shoulders or hips, radians.
fn heading(model: &BodyModel, limbs: Limbs, posed: &Posed) -> Result<f64> {
    let [left, right] = limbs.indices().map(|index| rig_joints(model, LIMBS[index].1));
    let across = posed.joints[left?[0]] - posed.joints[right?[0]];
    Ok((-across.z).atan2(across.x))
}

/// How a limb is found.
#[derive(Debug, Clone, PartialEq)]
pub struct Method {
    /// what it is called in tables
    pub name: String,
    /// tasks and steps
    pub options: Options,
    /// cameras used, by number
    pub cameras: Vec<usize>,
    /// whether the inner joint is a hinge and turns are limited; otherwise both joints are balls
    pub has_limits: bool,
    /// slopes of the image support; inside, the flesh's own width counts
    pub width: SupportWidth,
    /// turns of the last frame's inner joint about the line from base to end that every frame is started from, radians;
    /// what agrees best with images and posture is taken, the first in doubt
    pub swivels: Vec<f64>,
}

impl Method {
    /// Plain inverse kinematics as printed: two ball joints.
    pub fn plain() -> Self {
        Self { name: "IK".into(), has_limits: false, ..Self::limited() }
    }

    /// Plain inverse kinematics of a limb that bends as limbs do.
    pub fn limited() -> Self {
        Self {
            name: "IK + limits".into(),
            options: Options::reach(&[limb::END]),
            cameras: Vec::new(),
            has_limits: true,
            width: SupportWidth::default(),
            swivels: vec![0.0],
        }
    }

    /// Priority inverse kinematics: a neutral posture second.
    pub fn priority() -> Self {
        let options = Options::reach_then_posture(&[limb::END]);
        Self {
            name: "priority IK".into(),
            options,
            cameras: Vec::new(),
            has_limits: true,
            width: SupportWidth::default(),
            swivels: vec![0.0],
        }
    }

    /// Image constraints from some cameras, with a neutral posture where the images say nothing.
    pub fn image(limbs: Limbs, cameras: &[usize]) -> Self {
        let options = inverse_kinematics::Method::ImageConstrained.options(&[limb::END]);
        let names: Vec<_> = cameras.iter().map(|camera| format!("{}", camera + 1)).collect();
        Self {
            name: format!("IK + view {}", names.join(" and ")),
            options,
            cameras: cameras.to_vec(),
            has_limits: true,
            width: limbs.width(),
            swivels: vec![0.0, SWIVEL, -SWIVEL],
        }
    }

    /// What the paper compares, and what joint limits and a posture do without images: no view, the first, the second, both.
    pub fn all(limbs: Limbs) -> Vec<Self> {
        let images = [&[0][..], &[1], &[0, 1]].map(|cameras| Self::image(limbs, cameras));
        [Self::plain(), Self::limited(), Self::priority()].into_iter().chain(images).collect()
    }
}

/// How far to either side the last frame's elbow or knee is tried, radians. Tuned on trials 13_17 and 07_01 of the CMU database,
/// as the widths of the support.
const SWIVEL: f64 = 0.5;

/// How far the inner joints were from the truth, millimetres, and the ends from their targets.
#[derive(Debug, Clone, PartialEq)]
pub struct LimbErrors {
    /// the method's name
    pub method: String,
    /// one distance a frame and limb, millimetres
    pub inner_mm: Vec<f64>,
    /// mean distance of the end effectors from their targets, millimetres
    pub residual_mm: f64,
}

impl LimbErrors {
    /// Mean distance of the inner joints, millimetres (docs/papers.md#image-constrained-inverse-kinematics, eq. 9).
    pub fn mean_mm(&self) -> f64 {
        self.inner_mm.iter().sum::<f64>() / self.inner_mm.len().max(1) as f64
    }
}

/// Solves both limbs through a recording with every method. `see` makes of a silhouette (frame, camera) what the computer
/// is shown: itself, or a noisy one.
///
/// # Errors
/// If a method's options don't fit a limb.
pub fn run(
    model: &BodyModel,
    shape: &Shape,
    recording: &Recording,
    limbs: Limbs,
    methods: &[Method],
    see: &(dyn Fn(Silhouette, usize, usize) -> Silhouette + Sync),
) -> Result<Vec<LimbErrors>> {
    let cameras = cameras();
    let views: Vec<_> = cameras.iter().map(View::new).collect();
    let topology = Topology::new(model.faces(), model.num_vertices());
    let mut rasteriser = Rasteriser::new();
    let mut posed = Posed::default();
    let mut followed = Vec::new();
    let mut errors = Vec::new();
    for method in methods {
        for index in limbs.indices() {
            followed.push(FollowedLimb::new(model, shape, limbs, index, method)?);
        }
        errors.push(LimbErrors { method: method.name.clone(), inner_mm: Vec::new(), residual_mm: 0.0 });
    }
    for (frame, pose) in recording.poses.iter().enumerate() {
        shape.pose(model, pose, &mut posed);
        let fields = views.iter().enumerate().map(|(camera, view)| {
            let mut silhouette = Silhouette::empty(view.size[0], view.size[1]);
            rasteriser.silhouette(view, &posed.vertices, &topology, &mut silhouette);
            Arc::new(DistanceField::new(&see(silhouette, frame, camera), 1))
        });
        let fields: Vec<_> = fields.collect();
        let heading = heading(model, limbs, &posed)?;
        for (index, limb) in followed.iter_mut().enumerate() {
            let [base, inner, end] = limb.bones.map(|joint| posed.joints[joint]);
            let seen: Vec<_> = limb
                .views
                .iter()
                .map(|&camera| ImageView {
                    camera: cameras[camera].clone(),
                    support: Support::seen_at(fields[camera].clone(), &cameras[camera], &base, limb.width),
                })
                .collect();
            let residual_m = limb.solve(&base, &end, heading, &seen)?;
            let errors = &mut errors[index / 2];
            errors.inner_mm.push(1000.0 * (limb.found - inner).norm());
            errors.residual_mm += 1000.0 * residual_m / (2 * recording.poses.len()) as f64;
        }
    }
    Ok(errors)
}

/// As [`run`], for several recordings at once; the results are in their order.
///
/// # Errors
/// If a method's options don't fit a limb.
pub fn run_all(
    model: &BodyModel,
    shape: &Shape,
    recordings: &[(Recording, Limbs)],
    methods: impl Fn(Limbs) -> Vec<Method> + Sync,
    see: &(dyn Fn(Silhouette, usize, usize) -> Silhouette + Sync),
) -> Result<Vec<Vec<LimbErrors>>> {
    let one =
        |(recording, limbs): &(Recording, Limbs)| run(model, shape, recording, *limbs, &methods(*limbs), see);
    recordings.par_iter().map(one).collect()
}
