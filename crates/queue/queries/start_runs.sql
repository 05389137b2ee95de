-- The runs $1 have begun. Does not wait: who holds the lock of a queued run is starting it as well, or
-- is ending it.
UPDATE runs
SET state = 'running', started_at = clock_timestamp()
WHERE id IN (
    SELECT id FROM runs WHERE id = ANY ($1) AND state = 'queued' FOR NO KEY UPDATE SKIP LOCKED
)
RETURNING id::text
