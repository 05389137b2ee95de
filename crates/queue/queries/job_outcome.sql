-- Where the job $1 stands, for someone whose write was refused.
SELECT state, lease_number FROM jobs WHERE id = $1
