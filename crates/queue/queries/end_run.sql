-- $2: failed or cancelled, $3: message, $4: detail (both null when cancelled).
UPDATE runs
SET state = $2, error_message = $3, error_detail = $4,
    progress_at = clock_timestamp(), finished_at = clock_timestamp()
WHERE id = $1 AND state IN ('queued', 'running')
