-- Succeeds the job $1 under the lease $2, and unblocks the jobs that waited for it last. With the run locked,
-- so that no two do this to the same dependents at once.
WITH done AS (
    UPDATE jobs
    SET state = 'succeeded', progress = 1, progress_at = clock_timestamp(), finished_at = clock_timestamp(),
        leased_by = NULL, heartbeat_at = NULL
    WHERE id = $1 AND state = 'running' AND lease_number = $2 AND NOT cancel_requested
    RETURNING id
),
unblocked AS (
    UPDATE jobs
    SET pending_dependencies = pending_dependencies - 1,
        state = CASE WHEN pending_dependencies = 1 THEN 'available' ELSE 'blocked' END,
        available_at = CASE WHEN pending_dependencies = 1 THEN clock_timestamp() ELSE available_at END
    FROM done
    JOIN job_dependencies ON job_dependencies.depends_on = done.id
    WHERE jobs.id = job_dependencies.job_id AND jobs.state = 'blocked'
    RETURNING jobs.kind, jobs.state
)
SELECT EXISTS (SELECT FROM done) AS succeeded,
       ARRAY(SELECT DISTINCT kind FROM unblocked WHERE state = 'available') AS available_kinds
