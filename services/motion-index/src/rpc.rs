//! `marey.v1.MotionIndex`: wire to question, answer to wire.

use crate::{Error, fan_out::FanOut, search::Match};
use futures::{Stream, StreamExt};
use library::{
    motion_database::{ShardList, ShardedClip},
    versions::motion_databases::{self, ReadyDatabase},
};
use motion_db::{ClipInfo, FRAME_RATE, MotionDatabase};
use proto::v1::{self, motion_index_server::MotionIndex};
use std::{pin::Pin, sync::Arc};
use tonic::{Request, Response, Status, Streaming};

const MAX_MATCHES: u32 = 1024;
const PAGE_SIZE: u32 = 100;

pub(crate) struct Rpc {
    fan_out: Arc<FanOut>,
}

impl Rpc {
    pub fn new(fan_out: FanOut) -> Self {
        Self { fan_out: Arc::new(fan_out) }
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
        let mut rows =
            motion_databases::list(self.fan_out.databases.pool(), project, after, i64::from(size) + 1)
                .await
                .map_err(Error::from)?;
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
        let databases = &self.fan_out.databases;
        let (row, list) = databases.find(id).await?;
        // All shards have the same skeleton.
        let opened = databases.open(&row, &list, list.is_some().then_some(0)).await?;
        Ok(Response::new(describe(&row, &list, &opened.database)))
    }

    async fn nearest_windows(
        &self,
        request: Request<v1::NearestWindowsRequest>,
    ) -> Result<Response<v1::NearestWindowsResponse>, Status> {
        Ok(Response::new(nearest_windows(&self.fan_out, &request.into_inner()).await?))
    }

    type StreamNearestWindowsStream =
        Pin<Box<dyn Stream<Item = Result<v1::NearestWindowsResponse, Status>> + Send>>;

    async fn stream_nearest_windows(
        &self,
        request: Request<Streaming<v1::NearestWindowsRequest>>,
    ) -> Result<Response<Self::StreamNearestWindowsStream>, Status> {
        let fan_out = self.fan_out.clone();
        let answers = request.into_inner().then(move |question| {
            let fan_out = fan_out.clone();
            async move { Ok(nearest_windows(&fan_out, &question?).await?) }
        });
        Ok(Response::new(Box::pin(answers)))
    }

    async fn find_poses_by_control_points(
        &self,
        request: Request<v1::FindPosesByControlPointsRequest>,
    ) -> Result<Response<v1::FindPosesByControlPointsResponse>, Status> {
        let request = request.into_inner();
        check_num_matches(request.num_matches)?;
        let samples = request.control_points.as_ref().map(|frame| frame.samples.len());
        let samples = samples.ok_or(proto::Error::Missing { field: "control_points" })?;
        if samples < 2 {
            let (what, expected) = ("samples in control_points", "at least 2");
            return Err(proto::Error::Count { what, found: samples, expected }.into());
        }
        let found = self.fan_out.find_poses(&request).await?;
        let matches = found
            .into_iter()
            .map(|m| v1::ControlPointMatch { residual_m: m.distance, pose: Some(pose(m)) })
            .collect();
        Ok(Response::new(v1::FindPosesByControlPointsResponse { matches }))
    }
}

async fn nearest_windows(
    fan_out: &FanOut,
    request: &v1::NearestWindowsRequest,
) -> Result<v1::NearestWindowsResponse, Error> {
    check_num_matches(request.num_matches)?;
    if request.window.is_empty() {
        return Err(proto::Error::Missing { field: "window" }.into());
    }
    let found = fan_out.nearest_windows(request).await?;
    let matches =
        found.into_iter().map(|m| v1::WindowMatch { distance: m.distance, pose: Some(pose(m)) }).collect();
    Ok(v1::NearestWindowsResponse { matches })
}

fn check_num_matches(found: u32) -> Result<(), proto::Error> {
    if (1..=MAX_MATCHES).contains(&found) {
        Ok(())
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

fn summary(row: &ReadyDatabase) -> v1::DatabaseSummary {
    v1::DatabaseSummary {
        id: row.id.to_string(),
        name: row.name.clone(),
        version: row.version.unsigned_abs(),
        num_poses: row.num_poses.unsigned_abs(),
        num_clips: row.num_clips.unsigned_abs(),
        bytes: row.bytes.unsigned_abs(),
        blake3: row.blake3.clone(),
        ready_at_unix_millis: row.ready_at.timestamp_millis(),
        num_shards: row.num_shards.unwrap_or(1).unsigned_abs(),
    }
}

fn describe(
    row: &ReadyDatabase,
    list: &Option<ShardList>,
    database: &MotionDatabase,
) -> v1::DescribeDatabaseResponse {
    let clip = |name: &String, subject: &String, action: &String, num_poses: usize| v1::DatabaseClip {
        name: name.clone(),
        subject: subject.clone(),
        action: action.clone(),
        num_frames: num_poses as u64,
    };
    let whole = |c: &ClipInfo| clip(&c.name, &c.subject, &c.action, c.num_poses);
    let sharded = |c: &ShardedClip| clip(&c.name, &c.subject, &c.action, c.num_poses);
    let clips = match list {
        None => database.clips().iter().map(whole).collect(),
        Some(list) => list.clips.iter().map(sharded).collect(),
    };
    let skeleton = database.skeleton();
    v1::DescribeDatabaseResponse {
        summary: Some(summary(row)),
        frame_rate_hz: FRAME_RATE,
        skeleton_name: skeleton.name().to_owned(),
        joint_names: skeleton.joints().iter().map(|j| j.name.clone()).collect(),
        dof_names: skeleton.dof_names(),
        clips,
    }
}
