//! Building motion databases.

use jobs::{
    InputFile, bvh_centimetres,
    motion_database::{self, PlanMotionDatabase, VersionName},
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
    lock::Lock,
    page::Item,
    versioned::{self, Augment, Latest, MotionDatabase, Version, Versioned},
};

/// Most index files of one database.
const MAX_SHARDS: usize = 64;

/// How a motion database is to be built; everything may be left out.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewBuild {
    /// motion to be made from that of the files; nothing when left out, or what was made for `base`
    augment: Option<Augment>,
    /// into how many index files it is divided, 1 to 64, for databases too large for one machine; 1 when left out, or as
    /// many as `base` has
    #[schema(example = 1)]
    shards: Option<usize>,
    /// metres of one unit of BVH files (their format has no unit); 0.01, centimetres, when left out
    #[schema(example = 0.01)]
    bvh_metres_per_unit: Option<f64>,
}

impl Build for NewBuild {
    type Row = MotionDatabase;

    fn check(&self) -> Result<()> {
        if let Some(augment) = &self.augment {
            motion_database::Augment::from(augment.clone())
                .check()
                .map_err(|error| Error::Unprocessable(error.to_string()))?;
        }
        if let Some(shards) = self.shards.filter(|shards| !(1..=MAX_SHARDS).contains(shards)) {
            return Err(Error::Unprocessable(format!("shards is {shards}, expected 1 to {MAX_SHARDS}")));
        }
        check_unit("bvh_metres_per_unit", self.bvh_metres_per_unit)
    }

    async fn plan(
        self,
        db: &mut PgConnection,
        project_id: Uuid,
        row: &MotionDatabase,
        files: Vec<InputFile>,
    ) -> Result<NewRun> {
        let without = versioned::left_out(db, row.id()).await?;
        if files.is_empty() && without.is_empty() {
            return Err(no_files(row));
        }
        let base: Option<MotionDatabase> = match row.base_id {
            None => None,
            Some(id) => {
                Some(versioned::find(db, project_id, &id.to_string(), Latest::Any, Lock::Share).await?)
            }
        };
        let base = base.as_ref();
        let Version { id, name, version, .. } = row.version().clone();
        let payload = PlanMotionDatabase {
            motion_database: VersionName { id, name, version },
            base: base.map(MotionDatabase::ready).transpose()?,
            without,
            files,
            augment: self.augment_like(db, base).await?.into(),
            shards: self.shards.unwrap_or_else(|| shards_like(base)),
            bvh_metres_per_unit: self.bvh_metres_per_unit.unwrap_or_else(bvh_centimetres),
        };
        let run = NewRun::new(&payload)?;
        Ok(run.with_motion_database(row.base_id))
    }
}

impl NewBuild {
    /// The augmentation of a version made from another is the other's: a database is augmented as a whole.
    async fn augment_like(&self, db: &mut PgConnection, base: Option<&MotionDatabase>) -> Result<Augment> {
        let Some(base) = base else { return Ok(self.augment.clone().unwrap_or_default()) };
        let expected = versioned::augment(db, base.id()).await?;
        match &self.augment {
            Some(found) if *found != expected => Err(Error::Unprocessable(format!(
                "augment differs from that of {}, which this one extends; leave it out, or build a database from all the files",
                base.title()
            ))),
            _ => Ok(expected),
        }
    }
}

/// As many index files as the base has.
fn shards_like(base: Option<&MotionDatabase>) -> usize {
    base.and_then(|base| base.num_shards).and_then(|shards| usize::try_from(shards).ok()).unwrap_or(1)
}
