-- How many jobs of each kind stand in each unfinished state, for scaling and metrics.
SELECT kind, state, count(*) AS jobs
FROM jobs
WHERE state IN ('blocked', 'available', 'running')
GROUP BY kind, state
ORDER BY kind, state
