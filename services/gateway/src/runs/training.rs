//! Training models on motion databases.

use jobs::motion_database::TrainGplvm;
use regression::gplvm::TrainingOptions;
use serde::Deserialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::enqueue::{NewRun, accept};
use crate::{
    access::Access,
    answer::Answer,
    error::{Error, Result},
    extract::Posted,
    json,
    lock::Lock,
    page::Item,
    versioned::{self, Latest, MotionDatabase},
};

/// A model to be trained.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewTraining {
    /// the method that needs the model: `gplvm`, the only one that needs any
    #[schema(example = "gplvm")]
    method: Option<String>,
    /// how it is trained, by name: `latent_dims`, `active`, `max_iterations`
    #[serde(default)]
    #[schema(value_type = Option<Object>, example = json!({"latent_dims": 4}))]
    parameters: Map<String, Value>,
}

impl NewTraining {
    /// All parameters, those left out with their defaults.
    fn resolve(&self) -> Result<TrainingOptions> {
        let refuse = |error: &dyn std::fmt::Display| Error::Unprocessable(format!("parameters.{error}"));
        if let Some(method) = self.method.as_ref().filter(|method| *method != "gplvm") {
            return Err(Error::Unprocessable(format!(
                "method is {method:?}, expected \"gplvm\": no other method needs a model"
            )));
        }
        let options: TrainingOptions = json::read_parameters(self.parameters.clone())?;
        options.check().map_err(|error| refuse(&error))?;
        Ok(options)
    }
}

/// Trains a model on a motion database that is ready.
pub(crate) async fn train(by: &Access, which: &str, posted: Posted<NewTraining>) -> Result<Answer> {
    let Posted { body, request } = posted;
    let project_id = by.caller.project_id;
    let parameters = body.resolve()?;
    let mut tx = by.app.db.begin().await?;
    if let Some(answer) = request.replay(&mut tx, project_id).await? {
        return Ok(answer);
    }
    let database: MotionDatabase =
        versioned::find(&mut tx, project_id, which, Latest::Ready, Lock::Share).await?;
    let payload = TrainGplvm { motion_database: database.ready()?, parameters };
    let run = NewRun::new(&payload)?.with_motion_database(Some(database.id()));
    let run_id = run.enqueue(&mut tx, project_id).await?;
    accept(tx, &request, project_id, run_id).await
}
