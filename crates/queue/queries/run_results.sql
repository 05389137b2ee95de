SELECT name, store_key, bytes, blake3, media_type, is_result
FROM artefacts
WHERE run_id = $1 AND is_result
ORDER BY name
