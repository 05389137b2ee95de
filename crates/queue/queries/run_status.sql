SELECT id, project_id, kind, session_id, parameters, state, progress, phrase,
       error_message, error_detail, created_at, started_at, finished_at
FROM runs
WHERE id = $1
