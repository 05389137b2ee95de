INSERT INTO job_dependencies (run_id, job_id, depends_on)
SELECT $1, job_id, depends_on
FROM unnest($2::bigint[], $3::bigint[]) AS new (job_id, depends_on)
