-- The worker shuts down: the attempt is not counted.
UPDATE jobs
SET state = 'available', attempts = attempts - 1, available_at = clock_timestamp(),
    leased_by = NULL, heartbeat_at = NULL
WHERE id = $1 AND state = 'running' AND lease_number = $2 AND NOT cancel_requested
RETURNING kind
