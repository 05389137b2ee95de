//! All that there is to say of a motion database: its contents, the models trained on it, its users.

use chrono::{DateTime, Utc};
use jobs::motion_database;
use serde::{Deserialize, Serialize};
use sqlx::{PgConnection, types::Json};
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    motion_database::MotionDatabase,
    noun::Versioned,
    users::{self, User},
};
use crate::{
    error::{Error, Result},
    page::Item,
};

/// A motion database, and what is in it.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MotionDatabaseDetails {
    #[serde(flatten)]
    database: MotionDatabase,
    /// clips of `base` that were left out
    without: Vec<String>,
    /// null until it is ready
    contents: Option<Contents>,
    /// how long it took to build it, seconds
    build_seconds: Option<f64>,
    /// models that were trained on it
    models: Vec<Model>,
    /// runs under way, and versions not built yet, that need it; while there are any, it can't be deleted
    used_by: Vec<User>,
}

/// What is in a motion database: `jobs::motion_database::Contents`, described for the API, of which `jobs` knows nothing.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Contents {
    /// frames per second
    #[schema(example = 60.0)]
    frame_rate_hz: f64,
    /// joints of the skeleton
    num_joints: usize,
    /// degrees of freedom of the skeleton
    num_dofs: usize,
    /// by action, as `index.csv` names it
    actions: Vec<Share>,
    /// by subject
    subjects: Vec<Share>,
    /// what was made from the recordings
    augment: Augment,
    /// problems in the files
    warnings: Vec<String>,
}

/// How much of a motion database one action or subject is.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Share {
    /// empty where it is not known
    #[schema(example = "walk")]
    name: String,
    /// clips, those made from others included
    num_clips: u64,
    /// poses at 60 frames per second
    num_poses: u64,
}

/// Motion to be made from the recordings of a motion database, so that it holds more of what people do.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Augment {
    /// every clip with left and right exchanged
    mirror: bool,
    /// every clip at these multiples of its recorded speed
    #[serde(rename = "warps")]
    #[schema(example = json!([0.8, 1.25]))]
    speeds: Vec<f64>,
}

impl From<Augment> for motion_database::Augment {
    fn from(Augment { mirror, speeds }: Augment) -> Self {
        Self { mirror, speeds }
    }
}

impl From<motion_database::Augment> for Augment {
    fn from(motion_database::Augment { mirror, speeds }: motion_database::Augment) -> Self {
        Self { mirror, speeds }
    }
}

/// A model that was trained on a motion database.
#[derive(Debug, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct Model {
    /// the method that uses it
    #[schema(example = "gplvm")]
    method: String,
    /// the run that trained it
    run_id: Option<Uuid>,
    /// size, bytes
    bytes: i64,
    /// BLAKE3, hexadecimal
    blake3: String,
    /// when it was trained
    trained_at: DateTime<Utc>,
}

/// All that there is to say of a motion database.
pub(crate) async fn details(
    db: &mut PgConnection,
    database: MotionDatabase,
) -> Result<MotionDatabaseDetails> {
    let (without, contents, build_seconds): (Vec<String>, Option<Json<Contents>>, Option<f64>) =
        sqlx::query_as(
            "SELECT d.without, d.contents, extract(epoch FROM d.ready_at - r.started_at)::double precision
         FROM motion_databases d LEFT JOIN runs r ON r.id = d.build_run_id WHERE d.id = $1",
        )
        .bind(database.id())
        .fetch_one(&mut *db)
        .await?;
    let models = sqlx::query_as(
        "SELECT method, train_run_id AS run_id, bytes, blake3, trained_at FROM motion_database_models
         WHERE motion_database_id = $1 ORDER BY method",
    )
    .bind(database.id())
    .fetch_all(&mut *db)
    .await?;
    let used_by = users::list(db, &database).await?;
    let contents = contents.map(|Json(contents)| contents);
    Ok(MotionDatabaseDetails { database, without, contents, build_seconds, models, used_by })
}

/// The GPLVM that a run with that method uses.
///
/// # Errors
/// 409, if none was trained.
pub(crate) async fn gplvm(db: &mut PgConnection, database: &MotionDatabase) -> Result<jobs::Object> {
    let found: Option<(String, String)> = sqlx::query_as(
        "SELECT store_key, blake3 FROM motion_database_models WHERE motion_database_id = $1 AND method = 'gplvm'",
    )
    .bind(database.id())
    .fetch_optional(db)
    .await?;
    let (store_key, blake3) = found.ok_or_else(|| {
        Error::Conflict(format!(
            "no GPLVM has been trained on motion database {0}; train it first (marey db train {0})",
            database.version()
        ))
    })?;
    Ok(jobs::Object { store_key, blake3 })
}

/// The augmentation of a database that is ready.
pub(crate) async fn augment(db: &mut PgConnection, id: Uuid) -> Result<Augment> {
    let contents: Option<Json<Contents>> =
        sqlx::query_scalar("SELECT contents FROM motion_databases WHERE id = $1")
            .bind(id)
            .fetch_one(db)
            .await?;
    Ok(contents.map(|Json(contents)| contents.augment).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_are_shown_as_the_build_wrote_them() {
        let share =
            |name: &str| motion_database::Share { name: name.to_owned(), num_clips: 2, num_poses: 480 };
        let built = motion_database::Contents {
            frame_rate_hz: 60.0,
            num_joints: 30,
            num_dofs: 62,
            actions: vec![share("walk")],
            subjects: vec![share("7")],
            augment: motion_database::Augment { mirror: true, speeds: vec![0.8] },
            warnings: vec!["7_01.amc: doubtful".to_owned()],
        };
        let written = serde_json::to_value(&built).unwrap();
        assert_eq!(written["augment"], serde_json::json!({"mirror": true, "warps": [0.8]}));
        let read: Contents = serde_json::from_value(written.clone()).unwrap();
        assert_eq!(serde_json::to_value(&read).unwrap(), written);
    }
}
