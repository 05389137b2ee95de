-- What the jobs that job $1 depended on have left, in the order in which they were enqueued.
SELECT a.job_id, a.name, a.store_key, a.bytes, a.blake3, a.media_type, a.is_result
FROM job_dependencies d
JOIN artefacts a ON a.job_id = d.depends_on
WHERE d.job_id = $1
ORDER BY a.job_id, a.name
