-- Versions made from others, what is in a database, and models trained on it.

ALTER TABLE motion_databases
    -- the version whose clips it began with; null for one built from files alone, or when that was deleted since
    ADD COLUMN base_id    uuid    REFERENCES motion_databases ON DELETE SET NULL,
    -- names of clips of that version that were left out
    ADD COLUMN without    text[]  NOT NULL DEFAULT '{}',
    -- index files
    ADD COLUMN num_shards integer CHECK (num_shards >= 1),
    -- what is in it: counts by action, subjects, augmentation
    ADD COLUMN contents   jsonb,
    -- every clip: name, subject, action, poses; not read with lists
    ADD COLUMN clips      jsonb;
CREATE INDEX motion_databases_by_base ON motion_databases (base_id) WHERE base_id IS NOT NULL;

-- A model that was trained on one version. Training again replaces it for runs to come.
CREATE TABLE motion_database_models (
    motion_database_id uuid        NOT NULL REFERENCES motion_databases ON DELETE CASCADE,
    method             text        NOT NULL CHECK (method IN ('gplvm')),
    train_run_id       uuid        REFERENCES runs ON DELETE SET NULL,
    parameters         jsonb       NOT NULL,
    store_key          text        NOT NULL,
    bytes              bigint      NOT NULL CHECK (bytes >= 0),
    blake3             text        NOT NULL CHECK (blake3 ~ '^[0-9a-f]{64}$'),
    trained_at         timestamptz NOT NULL DEFAULT clock_timestamp(),
    PRIMARY KEY (motion_database_id, method)
);
