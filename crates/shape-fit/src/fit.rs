use std::f64::consts::PI;

use body::{BodyModel, Posed};
use kinematics::{rotation_exp, rotation_log};
use model::{Camera, Mesh, Silhouette};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use vision::{Rasteriser, Topology, View};

use crate::{
    Error, Options, Result,
    confidence::confidence,
    contour_term::Weighting,
    observation::Observation,
    place::{Place, locate},
    solver::{Pass, Problem, State},
    start_poses::limb_dofs,
    starts::{Setting, Start, find_starts, sizes},
};

/// Starts that are fitted coarsely.
const FITTED: usize = 6;
/// Those that are fitted further, beside the best one's twin that faces the other way.
const CONTENDERS: usize = 2;

/// From far away: pose and size.
const COARSE: [Pass; 3] =
    [pass(0, 0.25, 0.5, 0.15, 1, 8), pass(0, 0.12, 0.3, 0.10, 3, 8), pass(0, 0.06, 0.1, 0.06, 6, 6)];
/// To tell which start is right.
const MIDDLE: [Pass; 2] = [pass(0, 0.04, 0.05, 0.05, 10, 12), pass(0, 0.03, 0.02, 0.04, 20, 10)];
/// To the end.
const FINE: [Pass; 2] = [pass(1, 0.03, 0.02, 0.04, 20, 12), pass(1, 0.02, 0.01, 0.04, 20, 12)];

const fn pass(
    level: usize,
    scale_m: f64,
    tangential: f64,
    normal_m: f64,
    components: usize,
    evaluations: usize,
) -> Pass {
    Pass { level, weighting: Weighting { scale_m, tangential, normal_m }, components, evaluations }
}

/// A body found in the silhouettes of one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// root translation (metres), rotation vector and angles (radians), shape `[dofs]`
    pub pose: Vec<f64>,
    /// coefficients of the shape, standard deviations, shape `[components]`
    pub alpha: Vec<f64>,
    /// the body in its pose, metres, of the model's topology
    pub mesh: Mesh,
    /// joints in their pose, metres, in the order of the model's rig
    pub joints: Vec<Vector3<f64>>,
    /// how the body covers each silhouette, in the order of the views given
    pub views: Vec<ViewFit>,
    /// how far to trust the result, in [0, 1]
    pub confidence: f64,
}

/// How a fitted body covers one silhouette.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewFit {
    /// name of the camera
    pub camera: String,
    /// intersection over union of the drawn body and the cleaned silhouette
    pub iou: f64,
    /// false for a view that nobody is in, and one that was left out
    pub is_used: bool,
}

/// Finds pose and shape of the person in calibrated silhouettes of one moment.
///
/// # Errors
/// What the person who recorded can do something about; see [`Error`].
pub fn fit(model: &BodyModel, views: &[(Camera, Silhouette)], options: &Options) -> Result<Fit> {
    let mut fits = fit_frames(model, &[views], options)?;
    fits.pop().ok_or(Error::Nobody)
}

/// Finds the shape of one person and a pose for each of several frames, which sharpen the shape. Shape of `frames`:
/// `[frames][views]`; cameras may differ from frame to frame.
///
/// # Errors
/// As [`fit`], for the first frame that fails.
pub fn fit_frames(
    model: &BodyModel,
    frames: &[&[(Camera, Silhouette)]],
    options: &Options,
) -> Result<Vec<Fit>> {
    check_model(model)?;
    let topology = Topology::new(model.faces(), model.num_vertices());
    let mut observed = Vec::new();
    for views in frames {
        observed.push(Frame::new(views, options)?);
    }
    let mut found = Vec::new();
    for frame in &observed {
        found.push(frame.search(model, &topology, Wanted::All, options));
    }
    if found.is_empty() {
        return Err(Error::Nobody);
    }
    let count = found.len() as f64;
    let alpha =
        (0..model.num_components()).map(|i| found.iter().map(|f| f.state.alpha[i]).sum::<f64>() / count);
    let state =
        State { alpha: alpha.collect(), poses: found.iter().map(|f| f.state.poses[0].clone()).collect() };
    let views = observed.iter().map(Frame::kept).collect();
    let problem = Problem { model, topology: &topology, frames: views, options: *options };
    let (state, _) = problem.solve(state, &FINE);
    let frames = observed.iter().zip(&state.poses).zip(&found);
    frames
        .map(|((frame, pose), found)| {
            frame.result(model, &topology, (pose, &state.alpha), found.runner_up, options)
        })
        .collect()
}

/// Finds the pose of a person whose shape is known: [`fit`] with the shape (coefficients, standard deviations; missing ones
/// are 0) held.
///
/// # Errors
/// As [`fit`], and [`Error::Model`] if the shape is none of the model.
pub fn fit_pose(
    model: &BodyModel,
    alpha: &[f64],
    views: &[(Camera, Silhouette)],
    options: &Options,
) -> Result<Fit> {
    check_model(model)?;
    let components = model.num_components();
    if alpha.len() > components || alpha.iter().any(|x| !x.is_finite()) {
        return Err(Error::Model {
            found: format!("{components} components and a shape of {} coefficients", alpha.len()),
            expected: "a shape of at most as many, all finite".into(),
        });
    }
    let mut known = alpha.to_vec();
    known.resize(components, 0.0);
    let topology = Topology::new(model.faces(), model.num_vertices());
    let frame = Frame::new(views, options)?;
    let wanted = Wanted::Pose(&known);
    let found = frame.search(model, &topology, wanted, options);
    let problem = Problem { model, topology: &topology, frames: vec![frame.kept()], options: *options };
    let (state, _) = problem.solve(found.state, &wanted.passes(&FINE));
    frame.result(model, &topology, (&state.poses[0], &state.alpha), found.runner_up, options)
}

/// What is to be found.
#[derive(Clone, Copy)]
enum Wanted<'a> {
    /// pose and shape
    All,
    /// the pose of a body of these coefficients, shape `[components]`
    Pose(&'a [f64]),
}

impl Wanted<'_> {
    /// Passes in which nothing moves but what is wanted.
    fn passes(self, passes: &[Pass]) -> Vec<Pass> {
        let components = |pass: &Pass| if matches!(self, Self::All) { pass.components } else { 0 };
        passes.iter().map(|pass| Pass { components: components(pass), ..*pass }).collect()
    }

    /// Shapes that starts are tried with.
    fn alphas(self, model: &BodyModel) -> Vec<Vec<f64>> {
        match self {
            Self::All => sizes(model),
            Self::Pose(alpha) => vec![alpha.to_vec()],
        }
    }
}

fn check_model(model: &BodyModel) -> Result<()> {
    if limb_dofs(model).as_flattened().iter().any(Option::is_none) {
        return Err(Error::Model {
            found: "no angles of shoulders, elbows, hips and knees by the names of the shipped rig".into(),
            expected: "l_shoulder_flex, …, r_knee".into(),
        });
    }
    Ok(())
}

/// The views of one frame.
struct Frame {
    /// names of all cameras
    cameras: Vec<Camera>,
    /// of the cameras that see somebody
    observations: Vec<Observation>,
    /// index of each observation's camera
    camera_of: Vec<usize>,
    place: Place,
}

/// What the search found.
struct Found {
    state: State,
    /// energy of the best result that faces another way, divided by the result's
    runner_up: f64,
}

impl Frame {
    fn new(views: &[(Camera, Silhouette)], options: &Options) -> Result<Self> {
        let observed: Vec<_> =
            views.par_iter().map(|(camera, silhouette)| Observation::new(camera, silhouette)).collect();
        let (mut observations, mut camera_of) = (Vec::new(), Vec::new());
        for (index, observation) in observed.into_iter().enumerate() {
            if let Some(observation) = observation? {
                observations.push(observation);
                camera_of.push(index);
            }
        }
        let place = locate(&observations, options)?;
        let cameras = views.iter().map(|(camera, _)| camera.clone()).collect();
        Ok(Self { cameras, observations, camera_of, place })
    }

    fn kept(&self) -> Vec<&Observation> {
        self.place.kept.iter().map(|&view| &self.observations[view]).collect()
    }

    /// The best of several starts.
    fn search(&self, model: &BodyModel, topology: &Topology, wanted: Wanted<'_>, options: &Options) -> Found {
        let kept = self.kept();
        let [coarse_passes, middle_passes] = [wanted.passes(&COARSE), wanted.passes(&MIDDLE)];
        let alphas = wanted.alphas(model);
        let setting = Setting { model, topology, views: &kept, centre: self.place.centroid, alphas: &alphas };
        let mut starts = find_starts(&setting);
        starts.truncate(FITTED);
        let problem = Problem { model, topology, frames: vec![kept.clone()], options: *options };
        let from = |start: &Start| {
            let state = State { poses: vec![start.pose.clone()], alpha: start.alpha.clone() };
            problem.solve(state, &coarse_passes)
        };
        let mut coarse: Vec<(State, f64)> = starts.par_iter().map(from).collect();
        coarse.sort_by(|a, b| a.1.total_cmp(&b.1));
        let twin = coarse.first().map(|(best, _)| twin(model, best));
        coarse.truncate(CONTENDERS);
        let mut contenders: Vec<State> = coarse.into_iter().map(|(state, _)| state).collect();
        contenders.extend(twin.map(|twin| problem.solve(twin, &coarse_passes[1..]).0));
        let mut refined: Vec<(State, f64)> =
            contenders.into_par_iter().map(|state| problem.solve(state, &middle_passes)).collect();
        refined.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (state, energy) = refined.swap_remove(0);
        let others = refined.iter().filter(|(other, _)| faces_elsewhere(&state, other));
        let runner_up = others.map(|(_, other)| other / energy.max(1e-9)).fold(f64::INFINITY, f64::min);
        Found { state, runner_up }
    }

    fn result(
        &self,
        model: &BodyModel,
        topology: &Topology,
        (pose, alpha): (&[f64], &[f64]),
        runner_up: f64,
        options: &Options,
    ) -> Result<Fit> {
        let mut posed = Posed::default();
        model.shape(alpha).pose(model, pose, &mut posed);
        let mut views: Vec<ViewFit> = self
            .cameras
            .iter()
            .map(|camera| ViewFit { camera: camera.name.clone(), iou: 0.0, is_used: false })
            .collect();
        let kept = self.place.kept.iter();
        kept.for_each(|&view| views[self.camera_of[view]].is_used = true);
        let ious: Vec<f64> = self
            .observations
            .par_iter()
            .map(|observation| {
                let mut drawn = Silhouette::empty(0, 0);
                let view = View::new(&observation.camera);
                Rasteriser::new().silhouette(&view, &posed.vertices, topology, &mut drawn);
                drawn.iou(&observation.silhouette)
            })
            .collect();
        self.camera_of.iter().zip(&ious).for_each(|(&camera, &iou)| views[camera].iou = iou);
        let used: Vec<f64> = views.iter().filter(|view| view.is_used).map(|view| view.iou).collect();
        let mean = used.iter().sum::<f64>() / used.len().max(1) as f64;
        if mean < options.least_iou {
            let worst = views.iter().filter(|view| view.is_used).min_by(|a, b| a.iou.total_cmp(&b.iou));
            return Err(Error::NotFound {
                iou: mean,
                camera: worst.map_or(String::new(), |v| v.camera.clone()),
            });
        }
        Ok(Fit {
            pose: pose.to_vec(),
            alpha: alpha.to_vec(),
            mesh: Mesh { vertices: posed.vertices, faces: model.faces().to_vec() },
            joints: posed.joints,
            confidence: confidence(&used, runner_up),
            views,
        })
    }
}

fn heading(state: &State) -> Matrix3<f64> {
    let pose = &state.poses[0];
    rotation_exp(&Vector3::new(pose[3], pose[4], pose[5]))
}

/// True if two bodies face directions more than 60 degrees apart.
fn faces_elsewhere(a: &State, b: &State) -> bool {
    (heading(a) * Vector3::z()).dot(&(heading(b) * Vector3::z())) < 0.5
}

/// The same body turned by half a turn, each limb about where its counterpart was.
fn twin(model: &BodyModel, state: &State) -> State {
    let mut twin = state.clone();
    let pose = &mut twin.poses[0];
    let turned = heading(state) * rotation_exp(&(Vector3::y() * PI));
    pose[3..6].copy_from_slice(rotation_log(&turned).as_slice());
    let limbs = limb_dofs(model);
    for (limb, other) in [(0, 1), (1, 0), (2, 3), (3, 2)] {
        for (i, (dof, from)) in limbs[limb].iter().zip(&limbs[other]).enumerate() {
            if let (Some(dof), Some(from)) = (*dof, *from) {
                let angle = state.poses[0][from];
                pose[dof] = match i {
                    // what was forward is backward now; twists can't be told
                    0 => -angle,
                    2 => 0.0,
                    _ => angle,
                };
            }
        }
    }
    model.rig().clamp(pose);
    twin
}
