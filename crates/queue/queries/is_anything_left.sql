-- Whether the run $1 has unfinished jobs, and whether its progress is due to be brought up to date.
SELECT EXISTS (
           SELECT FROM jobs WHERE run_id = $1 AND state IN ('blocked', 'available', 'running')
       ) AS unfinished,
       EXISTS (
           SELECT FROM runs
           WHERE id = $1
             AND (state = 'queued' OR progress_at < clock_timestamp() - interval '250 milliseconds')
       ) AS progress_due
