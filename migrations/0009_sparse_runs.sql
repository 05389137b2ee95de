-- Runs from control points have one name, as requests have it. Gateways of the version before may still add some under the old
-- name: these run as all others, but `marey evaluate run` does not know it.

UPDATE runs SET kind = 'sparse' WHERE kind = 'reconstruction';
