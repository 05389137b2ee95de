-- Claims up to $3 jobs of the kinds $2 for the worker $1.
--
-- Fair between projects: a job's turn is the number of jobs that its project has running, plus the
-- job's place in the project's own line. Low turns go first, then high priorities, then old jobs.
-- A lane is a (kind, project) with something available; lanes are found by skipping through the index, so
-- the cost grows with the number of lanes and not with the number of jobs.
--
-- FOR NO KEY UPDATE rather than FOR UPDATE: an open transaction that enqueues a job depending on one of
-- these holds its key (foreign key), and need not keep us from claiming it.
WITH RECURSIVE lanes (kind, project_id) AS (
    SELECT wanted.kind,
           (SELECT j.project_id FROM jobs j
            WHERE j.state = 'available' AND j.kind = wanted.kind
            ORDER BY j.project_id LIMIT 1)
    FROM unnest($2::text[]) AS wanted (kind)
    UNION ALL
    SELECT lanes.kind,
           (SELECT j.project_id FROM jobs j
            WHERE j.state = 'available' AND j.kind = lanes.kind AND j.project_id > lanes.project_id
            ORDER BY j.project_id LIMIT 1)
    FROM lanes
    WHERE lanes.project_id IS NOT NULL
),
loads AS (
    SELECT project_id, count(*) AS running FROM jobs WHERE state = 'running' GROUP BY project_id
),
candidates AS (
    SELECT line.id, line.priority,
           coalesce(loads.running, 0)
               + row_number() OVER (PARTITION BY lanes.project_id ORDER BY line.priority DESC, line.id) AS turn
    FROM lanes
    CROSS JOIN LATERAL (
        SELECT j.id, j.priority
        FROM jobs j
        WHERE j.state = 'available' AND j.kind = lanes.kind AND j.project_id = lanes.project_id
          AND j.available_at <= clock_timestamp()
        ORDER BY j.priority DESC, j.id
        LIMIT $3 + 16
    ) AS line
    LEFT JOIN loads ON loads.project_id = lanes.project_id
    WHERE lanes.project_id IS NOT NULL
),
-- More than wanted: others may be taking the first of them at this moment.
shortlist AS MATERIALIZED (
    SELECT id FROM candidates ORDER BY turn, priority DESC, id LIMIT $3 + 32
),
-- Goes through the short list in its order and locks row by row until it has enough: by the primary key,
-- whatever the statistics say of a table that turns over all the time. (Written as || '' the condition fits
-- none of the partial indices, which would be scanned whole.)
taken AS MATERIALIZED (
    SELECT free.id
    FROM shortlist
    CROSS JOIN LATERAL (
        SELECT j.id FROM jobs j
        WHERE j.id = shortlist.id AND j.state || '' = 'available'
        LIMIT 1
        FOR NO KEY UPDATE SKIP LOCKED
    ) AS free
    LIMIT $3
)
UPDATE jobs
SET state = 'running',
    attempts = attempts + 1,
    lease_number = lease_number + 1,
    leased_by = $1,
    heartbeat_at = clock_timestamp(),
    started_at = clock_timestamp(),
    progress = 0
FROM taken
WHERE jobs.id = taken.id
RETURNING jobs.id, jobs.run_id, jobs.project_id, jobs.kind, jobs.payload, jobs.payload_version,
          jobs.attempts AS attempt, jobs.max_attempts, jobs.lease_number
