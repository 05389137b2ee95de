-- $1: how many. Drawn before the insert, so that the jobs of a batch can name each other.
SELECT nextval(pg_get_serial_sequence('jobs', 'id')) AS id
FROM generate_series(1, $1)
