//! Questions to databases of several shards: each shard is asked where it is kept, and the answers are merged.
//!
//! A shard is asked of the replica that keeps it; one that is down is replaced by this one, which then opens the shard
//! itself. Distances are computed from the poses alone (see [`crate::search`]), and equal ones are ordered by clip and
//! frame, so that the answer is that of one index, whatever the number of shards and replicas.

use crate::{
    Error,
    databases::{Databases, Part},
    peers::Peers,
    search::{self, Match, PointQuestion, WindowQuestion},
};
use futures::future::try_join_all;
use library::motion_database::ShardList;
use proto::v1;
use std::collections::HashMap;
use tonic::Status;
use uuid::Uuid;

pub(crate) struct FanOut {
    pub databases: Databases,
    pub peers: Peers,
}

/// A question that shards can be asked.
trait Question: Clone {
    fn database(&self) -> Result<Uuid, Error>;
    fn shard(&self) -> Option<usize>;
    fn num_matches(&self) -> usize;
    /// Asks one index file kept here.
    async fn ask_here(&self, fan_out: &FanOut, part: Part) -> Result<Vec<Match>, Error>;
    /// Asks a replica about one shard.
    async fn ask_peer(
        &self,
        client: v1::motion_index_client::MotionIndexClient<tonic::transport::Channel>,
        shard: usize,
    ) -> Result<Vec<Match>, Status>;
}

impl FanOut {
    /// The database windows nearest to a window.
    pub async fn nearest_windows(&self, request: &v1::NearestWindowsRequest) -> Result<Vec<Match>, Error> {
        self.ask(request).await
    }

    /// The database poses whose control points fit best.
    pub async fn find_poses(
        &self,
        request: &v1::FindPosesByControlPointsRequest,
    ) -> Result<Vec<Match>, Error> {
        self.ask(request).await
    }

    async fn ask<Q: Question>(&self, question: &Q) -> Result<Vec<Match>, Error> {
        let database = question.database()?;
        let (_, list) = self.databases.find(database).await?;
        match (&*list, question.shard()) {
            (None, None) => question.ask_here(self, Part { database, shard: None }).await,
            (_, shard @ Some(_)) => question.ask_here(self, Part { database, shard }).await,
            (Some(list), None) => {
                let shards = (0..list.shards.len()).map(|shard| self.ask_shard(question, database, shard));
                Ok(merge(try_join_all(shards).await?, list, question.num_matches()))
            }
        }
    }

    async fn ask_shard<Q: Question>(
        &self,
        question: &Q,
        database: Uuid,
        shard: usize,
    ) -> Result<Vec<Match>, Error> {
        if let Some(asked) = self.peers.for_shard(database, shard) {
            match question.ask_peer(asked.client.clone(), shard).await {
                Ok(found) => return Ok(found),
                Err(status) if asked.is_down(&status) => {}
                Err(status) => return Err(Error::Peer(Box::new(status))),
            }
        }
        question.ask_here(self, Part { database, shard: Some(shard) }).await
    }
}

impl Question for v1::NearestWindowsRequest {
    fn database(&self) -> Result<Uuid, Error> {
        Ok(proto::id("database_id", &self.database_id)?)
    }

    fn shard(&self) -> Option<usize> {
        self.shard.map(|shard| shard as usize)
    }

    fn num_matches(&self) -> usize {
        self.num_matches as usize
    }

    async fn ask_here(&self, fan_out: &FanOut, part: Part) -> Result<Vec<Match>, Error> {
        let databases = &fan_out.databases;
        let (row, list) = databases.find(part.database).await?;
        let opened = databases.open(&row, &list, part.shard).await?;
        let database = &opened.database;
        let values = proto::poses::window(&self.window, database.num_dofs())?;
        let question = WindowQuestion::new(values, database.num_dofs(), self.num_matches());
        if let Some(list) = &*list
            && search::is_too_short(database, question.num_frames())
            && list.clips.iter().any(|clip| clip.num_poses > question.num_frames())
        {
            // Other shards have clips that are long enough.
            return Ok(Vec::new());
        }
        databases.nearest_windows(part, &opened, question).await
    }

    async fn ask_peer(
        &self,
        mut client: v1::motion_index_client::MotionIndexClient<tonic::transport::Channel>,
        shard: usize,
    ) -> Result<Vec<Match>, Status> {
        let shard = u32::try_from(shard).ok();
        let answer = client.nearest_windows(Self { shard, ..self.clone() }).await?.into_inner();
        Ok(answer.matches.into_iter().map(|m| Match::from_wire(m.pose, m.distance)).collect())
    }
}

impl Question for v1::FindPosesByControlPointsRequest {
    fn database(&self) -> Result<Uuid, Error> {
        Ok(proto::id("database_id", &self.database_id)?)
    }

    fn shard(&self) -> Option<usize> {
        self.shard.map(|shard| shard as usize)
    }

    fn num_matches(&self) -> usize {
        self.num_matches as usize
    }

    async fn ask_here(&self, fan_out: &FanOut, part: Part) -> Result<Vec<Match>, Error> {
        let databases = &fan_out.databases;
        let frame = self.control_points.clone().ok_or(proto::Error::Missing { field: "control_points" })?;
        let points = proto::points::trajectories(&[frame], motion_db::FRAME_RATE)?;
        let (row, list) = databases.find(part.database).await?;
        let database = databases.open(&row, &list, part.shard).await?.database.clone();
        databases.nearest_poses(part, database, PointQuestion::new(points, self.num_matches())).await
    }

    async fn ask_peer(
        &self,
        mut client: v1::motion_index_client::MotionIndexClient<tonic::transport::Channel>,
        shard: usize,
    ) -> Result<Vec<Match>, Status> {
        let shard = u32::try_from(shard).ok();
        let answer = client.find_poses_by_control_points(Self { shard, ..self.clone() }).await?.into_inner();
        Ok(answer.matches.into_iter().map(|m| Match::from_wire(m.pose, m.residual_m)).collect())
    }
}

/// The best of all shards, ordered as one index orders them: by distance, then by clip and frame.
fn merge(found: Vec<Vec<Match>>, list: &ShardList, num_matches: usize) -> Vec<Match> {
    let place: HashMap<&str, usize> =
        list.clips.iter().enumerate().map(|(place, clip)| (clip.name.as_str(), place)).collect();
    let mut all: Vec<(usize, Match)> = found
        .into_iter()
        .flatten()
        .map(|m| (place.get(m.clip.as_str()).copied().unwrap_or(usize::MAX), m))
        .collect();
    all.sort_by(|(a_place, a), (b_place, b)| {
        a.distance.total_cmp(&b.distance).then(a_place.cmp(b_place)).then(a.frame.cmp(&b.frame))
    });
    all.truncate(num_matches);
    all.into_iter().map(|(_, m)| m).collect()
}
