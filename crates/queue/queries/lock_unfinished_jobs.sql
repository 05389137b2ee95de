-- Waits for claims and heartbeats under way (statements, never work). In the order of ids.
SELECT id FROM jobs
WHERE run_id = $1 AND state IN ('blocked', 'available', 'running')
ORDER BY id
FOR NO KEY UPDATE
