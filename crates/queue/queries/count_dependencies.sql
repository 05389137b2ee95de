-- Of the jobs $2 of run $1: how many there are, and how many have not succeeded yet.
SELECT count(*) AS found, count(*) FILTER (WHERE state <> 'succeeded') AS pending
FROM jobs
WHERE run_id = $1 AND id = ANY ($2)
