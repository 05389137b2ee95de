//! What statements on both tables have in common: written out where they are compiled, as the database's library asks for.

/// Rows that are ready, with the columns of all versions and those that are a kind's own.
macro_rules! select {
    ($table:literal, $own:literal, $rest:literal) => {
        concat!(
            "SELECT id, name, version, store_key, blake3",
            $own,
            " FROM ",
            $table,
            " WHERE store_key IS NOT NULL AND ",
            $rest
        )
    };
}
pub(super) use select;

/// Row `$1`, if it waits for it, becomes ready: with `$2` to `$5`, which [`Built`](super::Built) knows, and columns that are a
/// kind's own.
macro_rules! set_ready {
    ($table:literal, $own:literal) => {
        concat!(
            "UPDATE ",
            $table,
            " SET store_key = $2, blake3 = $3, bytes = $4, contents = $5, ",
            $own,
            ", ready_at = clock_timestamp() WHERE id = $1 AND store_key IS NULL"
        )
    };
}
pub(super) use set_ready;
