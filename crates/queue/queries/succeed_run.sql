UPDATE runs
SET state = 'succeeded', progress = 1, phrase = '', started_at = coalesce(started_at, clock_timestamp()),
    progress_at = clock_timestamp(), finished_at = clock_timestamp()
WHERE id = $1 AND state IN ('queued', 'running')
