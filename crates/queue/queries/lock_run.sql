-- Taken before any job row by everyone who ends a job: the last two jobs of a run must see each other
-- end, and one order of locks is no deadlock. Enqueuers (KEY SHARE) do not wait for it.
SELECT state FROM runs WHERE id = $1 FOR NO KEY UPDATE
