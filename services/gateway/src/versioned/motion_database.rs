use std::collections::HashSet;

use formats::FileRole;
use jobs::motion_database::{self, MotionDatabaseFile};
use serde::{Deserialize, Serialize};
use sqlx::{PgConnection, types::Json};
use utoipa::ToSchema;
use uuid::Uuid;

use super::{
    lookup::{Latest, find},
    noun::{Added, Noun, Version, Versioned},
    sql::sql,
    users::runs_that_use,
};
use crate::{
    error::{Error, Result},
    lock::Lock,
    page::Item,
};

/// Most clips that one version leaves out.
const MAX_WITHOUT: usize = 10_000;

/// A motion database: one version of one name.
#[derive(Debug, Clone, Serialize, ToSchema, sqlx::FromRow)]
pub(crate) struct MotionDatabase {
    #[serde(flatten)]
    #[sqlx(flatten)]
    version: Version,
    /// the version whose clips it begins with; null for one made of files alone
    #[schema(example = "walks@1")]
    base: Option<String>,
    /// into how many index files it is divided
    #[schema(example = 1)]
    pub num_shards: Option<i32>,
    /// poses at 60 frames per second
    num_poses: Option<i64>,
    /// motion clips
    num_clips: Option<i64>,
    /// name of its skeleton
    skeleton: Option<String>,
    #[serde(skip)]
    pub base_id: Option<Uuid>,
}

impl Item for MotionDatabase {
    fn id(&self) -> Uuid {
        self.version.id
    }
}

impl MotionDatabase {
    /// As jobs name it.
    ///
    /// # Errors
    /// 409 with its state, if it is not ready.
    pub fn ready(&self) -> Result<MotionDatabaseFile> {
        let blake3 = self.blake3()?.to_owned();
        let Version { id, name, version, store_key, .. } = self.version.clone();
        let store_key = store_key.ok_or_else(|| Error::Internal(format!("{} has no file", self.title())))?;
        Ok(MotionDatabaseFile { id, name, version, store_key, blake3, gplvm: None })
    }
}

/// A motion database to be made.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewMotionDatabase {
    /// 1 to 64 letters, digits, `.`, `_` or `-`; an existing name gets a new version
    #[schema(example = "walks")]
    name: String,
    /// a motion database that is ready, whose clips the new one begins with: id, `name` (its latest version that is
    /// ready) or `name@version`
    #[schema(example = "walks@1")]
    base: Option<String>,
    /// clips of `base` to be left out, with all that was made from them
    #[serde(default)]
    #[schema(value_type = Option<Vec<String>>, example = json!(["16_15"]))]
    without: Vec<String>,
}

impl Versioned for MotionDatabase {
    const NOUN: Noun = Noun {
        name: "motion database",
        path: "/v1/motion-databases",
        sql: sql! {
            table: "motion_databases",
            columns: "b.name || '@' || b.version AS base, v.num_shards, v.num_poses, v.num_clips, v.skeleton, v.base_id",
            joins: "LEFT JOIN motion_databases b ON b.id = v.base_id",
            users: concat!(
                runs_that_use!("motion_database_id"),
                "UNION ALL
                 SELECT NULL, NULL, NULL, name || '@' || version FROM motion_databases
                 WHERE base_id = $1 AND store_key IS NULL
                 ORDER BY run_id, motion_database"
            ),
        },
        parameter: "motion_database",
        runs: &[motion_database::RUN_KIND, motion_database::TRAINING_RUN_KIND],
        role: FileRole::Motion,
        takes: FileRole::is_motion_file,
        sources: "an archive of ASF and AMC or of BVH files",
        input: store::key::motion_database_input,
        prefix: store::key::motion_database_prefix,
    };

    type New = NewMotionDatabase;

    fn version(&self) -> &Version {
        &self.version
    }

    fn check(new: &NewMotionDatabase) -> Result<&str> {
        if new.base.is_none() && !new.without.is_empty() {
            return Err(Error::Unprocessable(
                "`without` lists clips to leave out of `base`, and no base is given; give it, or drop `without`".into(),
            ));
        }
        if new.without.len() > MAX_WITHOUT {
            return Err(Error::Unprocessable(format!(
                "without has {} clips, expected at most {MAX_WITHOUT}",
                new.without.len()
            )));
        }
        Ok(&new.name)
    }

    async fn insert(
        db: &mut PgConnection,
        project_id: Uuid,
        Added { id, version }: Added,
        new: &NewMotionDatabase,
    ) -> Result<()> {
        let base = match &new.base {
            None => None,
            Some(base) => {
                let base: Self = find(db, project_id, base, Latest::Ready, Lock::Share).await?;
                base.ready()?;
                check_clips(db, (base.id(), &base.title()), &new.without).await?;
                Some(base.id())
            }
        };
        sqlx::query(
            "INSERT INTO motion_databases (id, project_id, name, version, base_id, without)
             VALUES ($1, $2, $3, $4, $5, $6)",
        )
        .bind(id)
        .bind(project_id)
        .bind(&new.name)
        .bind(version)
        .bind(base)
        .bind(&new.without)
        .execute(db)
        .await?;
        Ok(())
    }
}

/// The clips of its base that a version leaves out.
pub(crate) async fn left_out(db: &mut PgConnection, id: Uuid) -> Result<Vec<String>> {
    Ok(sqlx::query_scalar("SELECT without FROM motion_databases WHERE id = $1")
        .bind(id)
        .fetch_one(db)
        .await?)
}

/// A clip of a motion database.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub(crate) struct Clip {
    /// name; of one made from another `16_15~mirror`, `16_15~x0.8`
    #[schema(example = "16_15")]
    name: String,
    /// who moved
    #[schema(example = "16")]
    subject: String,
    /// what they did; empty if that is not known
    #[schema(example = "walk")]
    action: String,
    /// poses at 60 frames per second
    num_poses: u64,
}

/// The clips of a database, in its order; none until it is ready.
pub(crate) async fn clips(db: &mut PgConnection, id: Uuid) -> Result<Vec<Clip>> {
    let clips: Option<Json<Vec<Clip>>> =
        sqlx::query_scalar("SELECT clips FROM motion_databases WHERE id = $1").bind(id).fetch_one(db).await?;
    Ok(clips.map(|Json(clips)| clips).unwrap_or_default())
}

/// Refuses names of clips, or of the trials that these were made from, that are not in the database of that id.
async fn check_clips(db: &mut PgConnection, (id, title): (Uuid, &str), names: &[String]) -> Result<()> {
    if names.is_empty() {
        return Ok(());
    }
    let clips = clips(db, id).await?;
    let known: HashSet<&str> =
        clips.iter().flat_map(|clip| [clip.name.as_str(), motion_db::trial_name(&clip.name)]).collect();
    match names.iter().find(|name| !known.contains(name.as_str())) {
        None => Ok(()),
        Some(name) => {
            Err(Error::Unprocessable(format!("without has {name:?}, which is not a clip of {title}")))
        }
    }
}
