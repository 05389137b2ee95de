UPDATE jobs
SET state = 'succeeded', progress = 1, progress_at = clock_timestamp(), finished_at = clock_timestamp(),
    leased_by = NULL, heartbeat_at = NULL
WHERE id = $1 AND state = 'running' AND lease_number = $2 AND NOT cancel_requested
