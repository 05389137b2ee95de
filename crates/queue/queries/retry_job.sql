-- $3: message, $4: detail, $5: seconds to wait. For attempts that failed; the attempt stays counted.
UPDATE jobs
SET state = 'available', error_message = $3, error_detail = $4,
    available_at = clock_timestamp() + make_interval(secs => $5),
    leased_by = NULL, heartbeat_at = NULL
WHERE id = $1 AND state = 'running' AND lease_number = $2 AND NOT cancel_requested
  AND attempts < max_attempts
