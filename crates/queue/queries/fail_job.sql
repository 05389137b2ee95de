-- $3: message for the user, $4: detail for a developer.
UPDATE jobs
SET state = 'failed', error_message = $3, error_detail = $4, finished_at = clock_timestamp(),
    leased_by = NULL, heartbeat_at = NULL
WHERE id = $1 AND state = 'running' AND lease_number = $2 AND NOT cancel_requested
