-- Keeps the run from ending while jobs are added to it. The lock is the foreign key's own: it is shared
-- among enqueuers, and stands in the way of nothing but the end of this very run (lock_run_to_end.sql).
SELECT project_id, state FROM runs WHERE id = $1 FOR KEY SHARE
