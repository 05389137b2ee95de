//! `marey.v1.Refinement`: the pose of one frame at once.

use std::sync::Arc;

use proto::v1::{self, refinement_server::Refinement};
use service::compute::{Slots, StopOnDrop};
use tonic::{Request, Response, Status};

use crate::{Shared, error::CallError, refine};

/// Largest request, bytes: silhouettes as PNG take some kilobytes each, photographs of masks a megabyte.
pub(crate) const MAX_REQUEST_BYTES: usize = 32 << 20;

pub(crate) struct Rpc {
    shared: Arc<Shared>,
    slots: Slots,
}

impl Rpc {
    pub fn new(shared: Arc<Shared>) -> Self {
        Self { shared, slots: Slots::default() }
    }

    async fn refine(&self, request: v1::RefineFrameRequest) -> Result<v1::RefineFrameResponse, CallError> {
        refine::check(&request)?;
        let (_, model) = self.shared.models.for_request(&request.body_model_id).await?;
        let stop = StopOnDrop::default();
        let flag = stop.flag();
        self.slots.run(move || refine::refine(&model, &request, &flag)).await
    }
}

#[tonic::async_trait]
impl Refinement for Rpc {
    async fn refine_frame(
        &self,
        request: Request<v1::RefineFrameRequest>,
    ) -> Result<Response<v1::RefineFrameResponse>, Status> {
        Ok(Response::new(self.refine(request.into_inner()).await?))
    }
}
