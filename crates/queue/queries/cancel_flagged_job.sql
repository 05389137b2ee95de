-- The worker has stopped running a job that nobody wanted any more.
UPDATE jobs
SET state = 'cancelled', finished_at = clock_timestamp(), leased_by = NULL, heartbeat_at = NULL
WHERE id = $1 AND state = 'running' AND lease_number = $2 AND cancel_requested
