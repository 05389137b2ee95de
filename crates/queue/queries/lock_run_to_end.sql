-- Waits for transactions that are adding jobs to this run.
SELECT state FROM runs WHERE id = $1 FOR UPDATE
