SELECT EXISTS (
    SELECT FROM jobs WHERE run_id = $1 AND state IN ('blocked', 'available', 'running')
)
