-- Whether a job of the kinds $1 could be claimed now.
SELECT EXISTS (
    SELECT FROM jobs WHERE state = 'available' AND kind = ANY ($1) AND available_at <= clock_timestamp()
)
