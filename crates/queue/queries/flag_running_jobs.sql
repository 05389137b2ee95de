UPDATE jobs
SET cancel_requested = true
WHERE run_id = $1 AND state = 'running' AND NOT cancel_requested
