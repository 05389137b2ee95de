/// The statements on one table of versioned things.
#[derive(Debug)]
pub(crate) struct Sql {
    /// the table
    pub table: &'static str,
    /// the row of id `$1` in project `$2`
    pub find: &'static str,
    /// the same, held against changes
    pub find_for_share: &'static str,
    /// the same, held alone
    pub find_for_update: &'static str,
    /// the rows of project `$1` with an id below `$2`, newest first, at most `$3`
    pub list: &'static str,
    /// the id in project `$1` of name `$2` and version `$3`
    pub find_version: &'static str,
    /// the id in project `$1` of the newest version of name `$2`: of one that is ready, if `$3` and there is one
    pub find_latest: &'static str,
    /// row `$1` is built by run `$2`
    pub set_build: &'static str,
    /// deletes row `$1`
    pub delete: &'static str,
    /// who needs row `$1`, which run `$2` builds
    pub users: &'static str,
}

/// The statements on a table: written out where they are compiled, as the database's library asks for.
macro_rules! sql {
    (table: $table:literal, columns: $columns:literal, joins: $joins:literal, users: $users:expr $(,)?) => {
        $crate::versioned::sql::Sql {
            table: $table,
            find: $crate::versioned::sql::select!(
                $table,
                $columns,
                $joins,
                "WHERE v.id = $1 AND v.project_id = $2"
            ),
            find_for_share: $crate::versioned::sql::select!(
                $table,
                $columns,
                $joins,
                "WHERE v.id = $1 AND v.project_id = $2 FOR SHARE OF v"
            ),
            find_for_update: $crate::versioned::sql::select!(
                $table,
                $columns,
                $joins,
                "WHERE v.id = $1 AND v.project_id = $2 FOR UPDATE OF v"
            ),
            list: $crate::versioned::sql::select!(
                $table,
                $columns,
                $joins,
                "WHERE v.project_id = $1 AND v.id < $2 ORDER BY v.id DESC LIMIT $3"
            ),
            find_version: concat!(
                "SELECT id FROM ",
                $table,
                " WHERE project_id = $1 AND name = $2 AND version = $3"
            ),
            find_latest: concat!(
                "SELECT id FROM ",
                $table,
                " WHERE project_id = $1 AND name = $2
                 ORDER BY (store_key IS NOT NULL AND $3) DESC, version DESC LIMIT 1"
            ),
            set_build: concat!("UPDATE ", $table, " SET build_run_id = $2 WHERE id = $1"),
            delete: concat!("DELETE FROM ", $table, " WHERE id = $1"),
            users: $users,
        }
    };
}
pub(super) use sql;

/// The columns of [`super::Version`], those that are a noun's own, and their state, which follows from the build's.
macro_rules! select {
    ($table:literal, $columns:literal, $joins:literal, $rest:literal) => {
        concat!(
            "SELECT v.id, v.name, v.version,
                    CASE WHEN v.store_key IS NOT NULL THEN 'ready'
                         WHEN r.id IS NULL THEN 'open'
                         WHEN r.state IN ('failed', 'cancelled') THEN 'failed'
                         ELSE 'building' END AS state,
                    v.build_run_id, v.bytes, v.blake3, v.created_at, v.ready_at, v.store_key, ",
            $columns,
            " FROM ",
            $table,
            " v LEFT JOIN runs r ON r.id = v.build_run_id ",
            $joins,
            " ",
            $rest
        )
    };
}
pub(super) use select;
