-- Runs from control points have one name, as requests have it. Gateways of the version before may still add some under the old
-- name; nothing depends on it but what people read.

UPDATE runs SET kind = 'sparse' WHERE kind = 'reconstruction';
