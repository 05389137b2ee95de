//! `marey.v1.Reconstruction`: poses at once.

use crate::{Shared, error::CallError, ik, priors::Prior};
use jobs::motion_database::MotionDatabaseFile;
use kinematics::{Kinematics, Parametrisation, control_points};
use library::versions::motion_databases;
use model::{PointTrajectories, Skeleton};
use proto::v1::{self, reconstruction_server::Reconstruction, solve_inverse_kinematics_request::Performer};
use service::{FileError, compute::Slots};
use sparse::{Merged, Parameters, Session};
use std::{ops::ControlFlow, sync::Arc};
use tokio_util::sync::CancellationToken;
use tonic::{Request, Response, Status};
use uuid::Uuid;

const MAX_FRAMES: usize = 600;
/// Longest request; the answer to it has 1,200 frames and stays below gRPC's usual limit of 4 MB a message.
const MAX_SECONDS: f64 = 20.0;
/// Rates outside would make very many frames of few, or none, Hz.
const FRAME_RATES: std::ops::RangeInclusive<f64> = 10.0..=10_000.0;

pub(crate) struct Rpc {
    shared: Arc<Shared>,
    slots: Slots,
}

impl Rpc {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared, slots: Slots::default() }
    }

    async fn solve(&self, request: v1::SolvePoseRequest) -> Result<v1::SolvePoseResponse, CallError> {
        let id = proto::id("database_id", &request.database_id)?;
        let frames = request.frames.len();
        if !(1..=MAX_FRAMES).contains(&frames) {
            let (what, expected) = ("frames", "1 to 600");
            return Err(proto::Error::Count { what, found: frames, expected }.into());
        }
        let rate = if request.frame_rate_hz == 0.0 { motion_db::FRAME_RATE } else { request.frame_rate_hz };
        if !FRAME_RATES.contains(&rate) {
            return Err(out_of_range("frame_rate_hz", rate, "10 to 10000").into());
        }
        let seconds = frames as f64 / rate;
        if seconds > MAX_SECONDS {
            return Err(out_of_range("length of the frames", format!("{seconds} s"), "at most 20 s").into());
        }
        let trajectories = proto::points::trajectories(&request.frames, rate)?;
        let file = self.shared.motion_database(id).await?;
        let parameters = Parameters::default();
        let prior = self.shared.priors.get(&file, parameters.window).await.map_err(CallError::Prior)?;
        let gone = CancellationToken::new();
        let _when_dropped = gone.clone().drop_guard();
        let answered = self.slots.run(move || {
            let merged = solve(&prior, &request.skeleton_asf, &trajectories, &parameters, &gone)?;
            Ok(answer(&merged))
        });
        answered.await
    }

    async fn solve_ik(
        &self,
        request: v1::SolveInverseKinematicsRequest,
    ) -> Result<v1::SolveInverseKinematicsResponse, CallError> {
        ik::call::check(&request)?;
        let model = match &request.performer {
            Some(Performer::Body(body)) => Some(self.shared.models.for_request(&body.body_model_id).await?.1),
            _ => None,
        };
        let gone = CancellationToken::new();
        let _when_dropped = gone.clone().drop_guard();
        self.slots.run(move || ik::call::solve(&request, model.as_deref(), &gone)).await
    }
}

impl Shared {
    /// A motion database that is ready.
    pub(crate) async fn motion_database(&self, id: Uuid) -> Result<MotionDatabaseFile, CallError> {
        let found = motion_databases::find(&self.resources.pool, id).await?;
        found.map(MotionDatabaseFile::from).ok_or(CallError::NoSuchDatabase(id))
    }
}

#[tonic::async_trait]
impl Reconstruction for Rpc {
    async fn solve_pose(
        &self,
        request: Request<v1::SolvePoseRequest>,
    ) -> Result<Response<v1::SolvePoseResponse>, Status> {
        Ok(Response::new(self.solve(request.into_inner()).await?))
    }

    async fn solve_inverse_kinematics(
        &self,
        request: Request<v1::SolveInverseKinematicsRequest>,
    ) -> Result<Response<v1::SolveInverseKinematicsResponse>, Status> {
        Ok(Response::new(self.solve_ik(request.into_inner()).await?))
    }
}

/// Reconstructs a few frames in one piece; `gone` stops it.
fn solve(
    prior: &Prior,
    skeleton_asf: &str,
    trajectories: &PointTrajectories,
    parameters: &Parameters,
    gone: &CancellationToken,
) -> Result<Merged, CallError> {
    let skeleton: Arc<Skeleton> = if skeleton_asf.is_empty() {
        prior.database.skeleton().clone()
    } else {
        let read = formats::asf::read(skeleton_asf.as_bytes());
        let in_file = FileError::in_file("skeleton_asf");
        read.map_err(in_file).map_err(crate::InputError::from)?.value.skeleton
    };
    let points = control_points(&skeleton, trajectories.names()).map_err(crate::InputError::from)?;
    let session = Session::new(skeleton, points, trajectories)?;
    let frames = session.num_frames();
    // One chunk, however long the frames are at 60 a second.
    let parameters = Parameters { chunk_frames: frames.max(60), ..parameters.clone() };
    let mut reconstructor = prior.reconstructor(&session, &parameters)?;
    reconstructor.learn_zero_pose()?;
    let mut progress =
        |_| if gone.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let found = reconstructor.reconstruct(0..frames, &mut progress)?;
    Ok(sparse::merge(&prior.database, &session, &parameters, &[found])?)
}

fn answer(merged: &Merged) -> v1::SolvePoseResponse {
    let skeleton = merged.motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    let frames = merged.motion.poses().zip(&merged.quality).map(|(pose, quality)| {
        kinematics.update(pose, &mut state);
        v1::SolvedFrame {
            pose: Some(proto::poses::to_wire(pose)),
            joint_positions: state.positions.iter().map(proto::points::to_wire).collect(),
            residual_m: quality.residual_m,
        }
    });
    v1::SolvePoseResponse {
        frames: frames.collect(),
        dof_names: skeleton.dof_names(),
        joint_names: skeleton.joints().iter().map(|j| j.name.clone()).collect(),
    }
}

fn out_of_range(field: &'static str, found: impl ToString, expected: &'static str) -> proto::Error {
    proto::Error::OutOfRange { field, found: found.to_string(), expected }
}
