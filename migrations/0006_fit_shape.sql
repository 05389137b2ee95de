-- Pose and shape of a person are fitted, and the job that does it is called so. Jobs that have ended keep the kind that they had.
UPDATE jobs SET kind = 'fit-shape' WHERE kind = 'initialise-body' AND state IN ('blocked', 'available', 'running');
