-- As run_for_enqueue.sql, but also keeps the jobs of this run from completing (lock_run.sql), so that
-- those not yet succeeded can be counted. Still shared among enqueuers, and no heartbeat waits for it.
SELECT project_id, state FROM runs WHERE id = $1 FOR SHARE
