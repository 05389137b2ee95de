UPDATE jobs
SET pending_dependencies = pending_dependencies - 1,
    state = CASE WHEN pending_dependencies = 1 THEN 'available' ELSE 'blocked' END,
    available_at = CASE WHEN pending_dependencies = 1 THEN clock_timestamp() ELSE available_at END
FROM job_dependencies
WHERE job_dependencies.depends_on = $1 AND jobs.id = job_dependencies.job_id AND jobs.state = 'blocked'
RETURNING jobs.kind, jobs.state
