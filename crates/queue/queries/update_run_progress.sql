-- Brings the progress of the runs of the jobs $1 up to date: mean of their jobs by weight, newest phrase.
-- Does not wait for a locked run, and looks at most four times a second at each.
WITH due AS MATERIALIZED (
    SELECT r.id
    FROM runs r
    WHERE r.id IN (SELECT run_id FROM jobs WHERE id = ANY ($1))
      AND r.state IN ('queued', 'running')
      AND (r.state = 'queued' OR r.progress_at < clock_timestamp() - interval '250 milliseconds')
    FOR NO KEY UPDATE SKIP LOCKED
),
figures AS (
    SELECT due.id,
           least(1, sum(j.weight * j.progress) / sum(j.weight)) AS progress,
           (array_agg(j.phrase ORDER BY j.progress_at DESC)
               FILTER (WHERE j.phrase <> '' AND j.progress_at IS NOT NULL))[1] AS phrase
    FROM due
    JOIN jobs j ON j.run_id = due.id
    GROUP BY due.id
)
UPDATE runs
SET state = 'running',
    started_at = coalesce(runs.started_at, clock_timestamp()),
    -- A retry begins again at 0; the user's bar does not go back.
    progress = greatest(runs.progress, figures.progress),
    phrase = coalesce(figures.phrase, runs.phrase),
    progress_at = clock_timestamp()
FROM figures
WHERE runs.id = figures.id
RETURNING runs.id::text
