//! Runs on cameras: the body of a person, and its motion.

use formats::FileRole;
use jobs::multi_view;
use serde::Deserialize;
use serde_json::{Value, json};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    cameras::{self, CameraFields},
    enqueue::NewRun,
    session_run::{OnSession, SessionRun, Shared, shared},
};
use crate::{error::Result, page::Item};

/// The body of a person and its motion, from what calibrated cameras saw.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct MultiViewRun {
    /// the body model, by id, `name` (its latest version that is ready) or `name@version`; `shipped`, the one that comes
    /// with the program, when left out
    #[schema(example = "shipped")]
    body_model: Option<String>,
    /// the axis of the calibration's world that points up: `x`, `y` or `z`; what the file says when left out
    #[schema(value_type = Option<String>, example = "z")]
    up: Option<model::Axis>,
    #[serde(flatten)]
    #[schema(inline)]
    cameras: CameraFields,
}

impl SessionRun for MultiViewRun {
    const KIND: &'static str = multi_view::RUN_KIND;
    const FILES: Option<(FileRole, &'static str)> = Some((FileRole::Calibration, "a calibration"));
    const SHARED: &'static [Shared] = &[shared::<CameraFields>];

    fn example() -> Value {
        json!({
            "kind": "multi-view",
            "body_model": "shipped",
            "background": "auto",
            "parameters": {"chunk_frames": 150, "particles": 25},
        })
    }

    fn check(&self) -> Result<()> {
        self.cameras.check()
    }

    async fn plan(self, db: &mut PgConnection, project_id: Uuid, on: OnSession) -> Result<NewRun> {
        let session_id = on.session.id;
        let body_model = cameras::body_model(db, project_id, self.body_model.as_deref()).await?;
        let plan = self.cameras.plan(on, &body_model, self.up, None)?;
        let run = NewRun::new(&plan)?;
        Ok(run.on_session(session_id).with_body_model(body_model.id()))
    }
}
