INSERT INTO runs (id, project_id, kind, session_id, parameters)
VALUES ($1, $2, $3, $4, $5)
