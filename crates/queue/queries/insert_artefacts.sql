INSERT INTO artefacts (run_id, job_id, name, store_key, bytes, blake3, media_type, is_result)
SELECT $1, $2, name, store_key, bytes, blake3, media_type, is_result
FROM unnest($3::text[], $4::text[], $5::bigint[], $6::text[], $7::text[], $8::boolean[])
     AS new (name, store_key, bytes, blake3, media_type, is_result)
