-- $1: channel, $2: payloads. Equal notifications of one transaction are sent once.
SELECT pg_notify($1, payload) FROM unnest($2::text[]) AS payload
