-- Beats for the jobs $1 under the lease numbers $2; progress $3 and phrase $4 are stored where not null.
-- Answers for every one of them, in their order. Does not wait for a row that another transaction is changing: if it was
-- ours before that change it is 'busy', and the next beat will tell.
WITH held AS (
    SELECT id, lease_number, progress, phrase, place
    FROM unnest($1::bigint[], $2::bigint[], $3::float8[], $4::text[]) WITH ORDINALITY
         AS held (id, lease_number, progress, phrase, place)
),
locked AS MATERIALIZED (
    SELECT j.id, j.lease_number
    FROM held
    JOIN jobs j ON j.id = held.id
    WHERE j.state = 'running' AND j.lease_number = held.lease_number
    FOR NO KEY UPDATE OF j SKIP LOCKED
),
beaten AS (
    UPDATE jobs
    SET heartbeat_at = clock_timestamp(),
        progress = coalesce(held.progress, jobs.progress),
        phrase = coalesce(held.phrase, jobs.phrase),
        progress_at = CASE WHEN held.progress IS NULL THEN jobs.progress_at ELSE clock_timestamp() END
    FROM locked
    JOIN held ON held.id = locked.id AND held.lease_number = locked.lease_number
    WHERE jobs.id = locked.id
    RETURNING jobs.id, jobs.lease_number, jobs.cancel_requested
)
SELECT CASE
           WHEN beaten.cancel_requested THEN 'cancelled'
           WHEN beaten.id IS NOT NULL THEN 'held'
           WHEN EXISTS (
               SELECT FROM jobs j
               WHERE j.id = held.id AND j.state = 'running' AND j.lease_number = held.lease_number
           ) THEN 'busy'
           ELSE 'lost'
       END AS answer
FROM held
LEFT JOIN beaten ON beaten.id = held.id AND beaten.lease_number = held.lease_number
ORDER BY held.place
