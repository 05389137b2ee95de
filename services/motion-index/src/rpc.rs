//! `marey.v1.MotionIndex`: wire to question, answer to wire.

use crate::{
    Error, catalogue,
    catalogue::Row,
    databases::Databases,
    search::{Match, PointQuestion, WindowQuestion},
};
use futures::{Stream, StreamExt};
use motion_db::{FRAME_RATE, MotionDatabase};
use proto::v1::{self, motion_index_server::MotionIndex};
use std::{pin::Pin, sync::Arc};
use tonic::{Request, Response, Status, Streaming};

const MAX_MATCHES: u32 = 1024;
const PAGE_SIZE: u32 = 100;

pub(crate) struct Rpc {
    databases: Arc<Databases>,
}

impl Rpc {
    pub fn new(databases: Arc<Databases>) -> Self {
        Self { databases }
    }
}

#[tonic::async_trait]
impl MotionIndex for Rpc {
    async fn list_databases(
        &self,
        request: Request<v1::ListDatabasesRequest>,
    ) -> Result<Response<v1::ListDatabasesResponse>, Status> {
        let request = request.into_inner();
        let project = proto::id("project_id", &request.project_id)?;
        let after = match request.page_token.as_str() {
            "" => None,
            token => Some(token.parse().map_err(|_| Error::PageToken)?),
        };
        let size = if request.page_size == 0 { PAGE_SIZE } else { request.page_size.min(PAGE_SIZE) };
        let mut rows = catalogue::list(self.databases.pool(), project, after, i64::from(size) + 1).await?;
        let is_more = rows.len() > size as usize;
        rows.truncate(size as usize);
        let next_page_token = rows.last().filter(|_| is_more).map(|r| r.id.to_string()).unwrap_or_default();
        Ok(Response::new(v1::ListDatabasesResponse {
            databases: rows.iter().map(summary).collect(),
            next_page_token,
        }))
    }

    async fn describe_database(
        &self,
        request: Request<v1::DescribeDatabaseRequest>,
    ) -> Result<Response<v1::DescribeDatabaseResponse>, Status> {
        let id = proto::id("database_id", &request.into_inner().database_id)?;
        let (row, database) = self.databases.get(id).await?;
        Ok(Response::new(describe(&row, &database)))
    }

    async fn nearest_windows(
        &self,
        request: Request<v1::NearestWindowsRequest>,
    ) -> Result<Response<v1::NearestWindowsResponse>, Status> {
        Ok(Response::new(nearest_windows(&self.databases, request.into_inner()).await?))
    }

    type StreamNearestWindowsStream =
        Pin<Box<dyn Stream<Item = Result<v1::NearestWindowsResponse, Status>> + Send>>;

    async fn stream_nearest_windows(
        &self,
        request: Request<Streaming<v1::NearestWindowsRequest>>,
    ) -> Result<Response<Self::StreamNearestWindowsStream>, Status> {
        let databases = self.databases.clone();
        let answers = request.into_inner().then(move |question| {
            let databases = databases.clone();
            async move { Ok(nearest_windows(&databases, question?).await?) }
        });
        Ok(Response::new(Box::pin(answers)))
    }

    async fn find_poses_by_control_points(
        &self,
        request: Request<v1::FindPosesByControlPointsRequest>,
    ) -> Result<Response<v1::FindPosesByControlPointsResponse>, Status> {
        let request = request.into_inner();
        let id = proto::id("database_id", &request.database_id)?;
        let num_matches = num_matches(request.num_matches)?;
        let frame = request.control_points.ok_or(proto::Error::Missing { field: "control_points" })?;
        if frame.samples.len() < 2 {
            return Err(out_of_range("control_points", frame.samples.len(), "at least two samples").into());
        }
        let points = proto::points::trajectories(&[frame], FRAME_RATE)?;
        let found = self.databases.nearest_poses(id, PointQuestion::new(points, num_matches)).await?;
        let matches = found
            .into_iter()
            .map(|m| v1::ControlPointMatch { residual_m: m.distance, pose: Some(pose(m)) })
            .collect();
        Ok(Response::new(v1::FindPosesByControlPointsResponse { matches }))
    }
}

async fn nearest_windows(
    databases: &Databases,
    request: v1::NearestWindowsRequest,
) -> Result<v1::NearestWindowsResponse, Error> {
    let id = proto::id("database_id", &request.database_id)?;
    let num_matches = num_matches(request.num_matches)?;
    if request.window.is_empty() {
        return Err(proto::Error::Missing { field: "window" }.into());
    }
    let (_, database) = databases.get(id).await?;
    let values = proto::poses::window(&request.window, database.num_dofs())?;
    let question = WindowQuestion::new(values, database.num_dofs(), num_matches);
    let found = databases.nearest_windows(id, question).await?;
    let matches =
        found.into_iter().map(|m| v1::WindowMatch { distance: m.distance, pose: Some(pose(m)) }).collect();
    Ok(v1::NearestWindowsResponse { matches })
}

fn num_matches(found: u32) -> Result<usize, proto::Error> {
    if (1..=MAX_MATCHES).contains(&found) {
        Ok(found as usize)
    } else {
        Err(out_of_range("num_matches", found, "1 to 1024"))
    }
}

fn out_of_range(field: &'static str, found: impl ToString, expected: &'static str) -> proto::Error {
    proto::Error::OutOfRange { field, found: found.to_string(), expected }
}

fn pose(found: Match) -> v1::DatabasePose {
    v1::DatabasePose { clip: found.clip, frame: u32::try_from(found.frame).unwrap_or(u32::MAX) }
}

fn summary(row: &Row) -> v1::DatabaseSummary {
    v1::DatabaseSummary {
        id: row.id.to_string(),
        name: row.name.clone(),
        version: row.version.unsigned_abs(),
        num_poses: row.num_poses.unsigned_abs(),
        num_clips: row.num_clips.unsigned_abs(),
        bytes: row.bytes.unsigned_abs(),
        blake3: row.blake3.clone(),
        ready_at_unix_millis: row.ready_at.timestamp_millis(),
    }
}

fn describe(row: &Row, database: &MotionDatabase) -> v1::DescribeDatabaseResponse {
    let clip = |c: &motion_db::ClipInfo| v1::DatabaseClip {
        name: c.name.clone(),
        subject: c.subject.clone(),
        action: c.action.clone(),
        num_frames: c.num_poses as u64,
    };
    let skeleton = database.skeleton();
    v1::DescribeDatabaseResponse {
        summary: Some(summary(row)),
        frame_rate_hz: FRAME_RATE,
        skeleton_name: skeleton.name().to_owned(),
        joint_names: skeleton.joints().iter().map(|j| j.name.clone()).collect(),
        dof_names: skeleton.dof_names(),
        clips: database.clips().iter().map(clip).collect(),
    }
}
