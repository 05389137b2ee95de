-- One row for each position of the arrays $3 to $10.
INSERT INTO jobs (id, run_id, project_id, kind, payload, payload_version, priority, weight, max_attempts,
                  pending_dependencies, state)
SELECT id, $1, $2, kind, payload, payload_version, priority, weight, max_attempts, pending,
       CASE WHEN pending > 0 THEN 'blocked' ELSE 'available' END
FROM unnest($3::bigint[], $4::text[], $5::jsonb[], $6::integer[], $7::smallint[], $8::float8[], $9::integer[],
            $10::integer[])
     AS new (id, kind, payload, payload_version, priority, weight, max_attempts, pending)
