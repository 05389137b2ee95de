-- Body models, learned from registered scans, and the files of sessions with cameras.

-- One row is one version of a named model. Its state follows from the rest, as that of a motion database does. The name
-- `shipped` is that of the model which comes with the program and has no row.
CREATE TABLE body_models (
    id             uuid             PRIMARY KEY,
    project_id     uuid             NOT NULL REFERENCES projects ON DELETE CASCADE,
    name           text             NOT NULL CHECK (name ~ '^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$' AND name <> 'shipped'),
    version        integer          NOT NULL CHECK (version >= 1),
    build_run_id   uuid             REFERENCES runs ON DELETE SET NULL,
    -- set together by the job that built it, in its completing transaction
    store_key      text,
    bytes          bigint           CHECK (bytes >= 0),
    blake3         text             CHECK (blake3 ~ '^[0-9a-f]{64}$'),
    num_vertices   integer          CHECK (num_vertices >= 1),
    num_components integer          CHECK (num_components >= 0),
    -- what it was learned from and how well: scans, variance kept by the first 1, 2, … components, warnings
    contents       jsonb,
    ready_at       timestamptz,
    created_at     timestamptz      NOT NULL DEFAULT now(),
    UNIQUE (project_id, name, version),
    CONSTRAINT body_models_ready_means_built CHECK (
        num_nonnulls(store_key, bytes, blake3, num_vertices, num_components, contents, ready_at) IN (0, 7))
);

ALTER TABLE files
    ADD COLUMN body_model_id uuid REFERENCES body_models ON DELETE CASCADE,
    ADD UNIQUE (body_model_id, name),
    DROP CONSTRAINT files_role_check,
    ADD CONSTRAINT files_role_check CHECK (role IN (
        'skeleton', 'control-points', 'ground-truth', 'motion', 'scans',
        'calibration', 'video', 'images', 'masks', 'plate')),
    DROP CONSTRAINT files_check,
    ADD CONSTRAINT files_have_one_owner CHECK (num_nonnulls(session_id, motion_database_id, body_model_id) = 1);

-- The model that a run on cameras reads.
ALTER TABLE runs ADD COLUMN body_model_id uuid REFERENCES body_models ON DELETE SET NULL;
CREATE INDEX runs_of_body_model ON runs (body_model_id) WHERE body_model_id IS NOT NULL;
