//! Building body models.

use jobs::{
    InputFile,
    body_model::{BuildBodyModel, VersionName},
};
use serde::Deserialize;
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    build::{Build, no_files},
    enqueue::NewRun,
    units::check_unit,
};
use crate::{
    error::{Error, Result},
    versioned::{BodyModel, Version, Versioned},
};

/// How a body model is to be built; everything may be left out.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBodyModelBuild {
    /// most principal components, 1 to 20; 20 when left out
    #[schema(example = 20)]
    components: Option<usize>,
    /// metres of one unit of the scans; 1 when left out, for arrays whichever of 1, 0.01, 0.001 and 0.0001 makes people
    #[schema(example = 0.001)]
    metres_per_unit: Option<f64>,
}

impl Build for NewBodyModelBuild {
    type Row = BodyModel;

    fn check(&self) -> Result<()> {
        if let Some(components) = self.components.filter(|count| !(1..=body::MAX_COMPONENTS).contains(count))
        {
            return Err(Error::Unprocessable(format!(
                "components is {components}, expected 1 to {}",
                body::MAX_COMPONENTS
            )));
        }
        check_unit("metres_per_unit", self.metres_per_unit)
    }

    async fn plan(
        self,
        _: &mut PgConnection,
        _: Uuid,
        row: &BodyModel,
        files: Vec<InputFile>,
    ) -> Result<NewRun> {
        if files.is_empty() {
            return Err(no_files(row));
        }
        let Version { id, name, version, .. } = row.version().clone();
        let payload = BuildBodyModel {
            body_model: VersionName { id, name, version },
            files,
            components: self.components.unwrap_or(body::MAX_COMPONENTS),
            metres_per_unit: self.metres_per_unit,
        };
        NewRun::new(&payload)
    }
}
