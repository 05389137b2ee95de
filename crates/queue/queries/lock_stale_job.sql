-- The job $1 under lease $2, if its worker still has not been heard. Does not wait: who changes it now
-- is alive.
SELECT j.id
FROM jobs j
CROSS JOIN queue_settings s
WHERE j.id = $1 AND j.lease_number = $2 AND j.state = 'running'
  AND j.heartbeat_at < clock_timestamp() - s.staleness
FOR NO KEY UPDATE OF j SKIP LOCKED
