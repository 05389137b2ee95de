-- Running jobs whose worker has not been heard for the staleness. After a start of the server everyone
-- gets that long to be heard again.
SELECT j.id, j.run_id, j.kind, j.attempts AS attempt, j.max_attempts, j.lease_number, j.cancel_requested
FROM jobs j
CROSS JOIN queue_settings s
WHERE j.state = 'running'
  AND j.heartbeat_at < clock_timestamp() - s.staleness
  AND pg_postmaster_start_time() < clock_timestamp() - s.staleness
ORDER BY j.id
