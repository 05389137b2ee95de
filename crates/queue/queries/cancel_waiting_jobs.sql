-- After lock_unfinished_jobs.sql, so that none of them is being claimed.
UPDATE jobs
SET state = 'cancelled', finished_at = clock_timestamp()
WHERE run_id = $1 AND state IN ('blocked', 'available')
