use body::shipped;
use formats::FileRole;
use jobs::body_model::{self, BodyModelFile, SHIPPED};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sqlx::PgConnection;
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    noun::{Added, Noun, State, Version, Versioned},
    sql::sql,
    users::runs_that_use,
};
use crate::{error::Result, page::Item};

/// A body model: one version of one name, or `shipped`, which is always there.
#[derive(Debug, Clone, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct BodyModel {
    #[serde(flatten)]
    #[sqlx(flatten)]
    version: Version,
    /// vertices of its mesh
    num_vertices: Option<i32>,
    /// principal components
    num_components: Option<i32>,
    /// what it was learned from and how well: scans, variance kept by the first 1, 2, … components, warnings
    contents: Option<Value>,
}

impl Item for BodyModel {
    fn id(&self) -> Uuid {
        self.version.id
    }
}

impl BodyModel {
    /// As jobs name it.
    ///
    /// # Errors
    /// 409 with its state, if it is not ready.
    pub fn ready(&self) -> Result<BodyModelFile> {
        let blake3 = self.blake3()?.to_owned();
        let Version { id, name, version, store_key, .. } = self.version.clone();
        Ok(BodyModelFile { id, name, version, store_key, blake3 })
    }
}

/// A body model to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBodyModel {
    /// 1 to 64 letters, digits, `.`, `_` or `-`; an existing name gets a new version
    #[schema(example = "athletes")]
    name: String,
}

impl Versioned for BodyModel {
    const NOUN: Noun = Noun {
        name: "body model",
        path: "/v1/body-models",
        sql: sql! {
            table: "body_models",
            columns: "v.num_vertices, v.num_components, v.contents",
            joins: "",
            users: concat!(runs_that_use!("body_model_id"), "ORDER BY run_id"),
        },
        parameter: "body_model",
        runs: &[body_model::RUN_KIND],
        role: FileRole::Scans,
        takes: FileRole::is_scan_file,
        sources: "an archive of registered scans",
        input: store::key::body_model_input,
        prefix: store::key::body_model_prefix,
    };

    type New = NewBodyModel;

    fn version(&self) -> &Version {
        &self.version
    }

    fn shipped() -> Option<Self> {
        let shipped = shipped();
        let model = &shipped.model;
        let count = |n: usize| i32::try_from(n).ok();
        Some(Self {
            version: Version {
                id: Uuid::nil(),
                name: SHIPPED.to_owned(),
                version: 1,
                state: State::Ready,
                build_run_id: None,
                bytes: i64::try_from(shipped.bytes.len()).ok(),
                blake3: Some(shipped.blake3.clone()),
                created_at: None,
                ready_at: None,
                store_key: None,
            },
            num_vertices: count(model.num_vertices()),
            num_components: count(model.num_components()),
            contents: Some(json!({
                "description": model.description(),
                "variance_kept": model.variance_kept(),
                "num_joints": model.rig().num_joints(),
                "num_dofs": model.rig().num_dofs(),
                "num_faces": model.faces().len(),
            })),
        })
    }

    fn check(new: &NewBodyModel) -> Result<&str> {
        Ok(&new.name)
    }

    async fn insert(
        db: &mut PgConnection,
        project_id: Uuid,
        Added { id, version }: Added,
        new: &NewBodyModel,
    ) -> Result<()> {
        sqlx::query("INSERT INTO body_models (id, project_id, name, version) VALUES ($1, $2, $3, $4)")
            .bind(id)
            .bind(project_id)
            .bind(&new.name)
            .bind(version)
            .execute(db)
            .await?;
        Ok(())
    }
}
