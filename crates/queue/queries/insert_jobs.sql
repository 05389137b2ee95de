-- One row for each position of the arrays $3 to $9.
INSERT INTO jobs (id, run_id, project_id, kind, payload, priority, weight, max_attempts,
                  pending_dependencies, state)
SELECT id, $1, $2, kind, payload, priority, weight, max_attempts, pending,
       CASE WHEN pending > 0 THEN 'blocked' ELSE 'available' END
FROM unnest($3::bigint[], $4::text[], $5::jsonb[], $6::smallint[], $7::float8[], $8::integer[], $9::integer[])
     AS new (id, kind, payload, priority, weight, max_attempts, pending)
