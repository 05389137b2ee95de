-- What people own: projects, their keys, capture sessions, uploaded files and motion databases.
-- Runs and jobs are in 0001_queue.sql; here they are tied to their owners.

CREATE TABLE projects (
    id          uuid        PRIMARY KEY,
    name        text        NOT NULL UNIQUE CHECK (name ~ '^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$'),
    created_at  timestamptz NOT NULL DEFAULT now()
);

-- A key is shown once; only its BLAKE3 hash is kept.
CREATE TABLE api_keys (
    id          uuid        PRIMARY KEY,
    project_id  uuid        NOT NULL REFERENCES projects ON DELETE CASCADE,
    name        text        NOT NULL DEFAULT '',
    hash        bytea       NOT NULL UNIQUE CHECK (octet_length(hash) = 32),
    scopes      text[]      NOT NULL CHECK (scopes <@ ARRAY['read', 'write', 'admin']),
    created_at  timestamptz NOT NULL DEFAULT now(),
    revoked_at  timestamptz
);
CREATE INDEX api_keys_of_project ON api_keys (project_id);

-- Ids are UUIDv7, so their order is the order of creation: lists are paged newest first by id.
CREATE TABLE sessions (
    id          uuid        PRIMARY KEY,
    project_id  uuid        NOT NULL REFERENCES projects ON DELETE CASCADE,
    name        text        NOT NULL CHECK (char_length(name) BETWEEN 1 AND 200),
    tags        text[]      NOT NULL DEFAULT '{}',
    created_at  timestamptz NOT NULL DEFAULT now()
);
CREATE INDEX sessions_of_project ON sessions (project_id, id DESC);

-- One row is one version of a named database. Its state is not stored but follows from the rest:
--   open      no build run yet: it collects files
--   building  its build run goes on: its files are fixed
--   failed    its build run failed or was cancelled: it collects files again
--   ready     it has an index file: it never changes again
CREATE TABLE motion_databases (
    id           uuid        PRIMARY KEY,
    project_id   uuid        NOT NULL REFERENCES projects ON DELETE CASCADE,
    name         text        NOT NULL CHECK (name ~ '^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$'),
    version      integer     NOT NULL CHECK (version >= 1),
    build_run_id uuid        REFERENCES runs ON DELETE SET NULL,
    -- set together by the job that built it, in its completing transaction
    store_key    text,
    bytes        bigint      CHECK (bytes >= 0),
    blake3       text        CHECK (blake3 ~ '^[0-9a-f]{64}$'),
    num_poses    bigint      CHECK (num_poses >= 0),
    num_clips    bigint      CHECK (num_clips >= 0),
    skeleton     text,
    ready_at     timestamptz,
    created_at   timestamptz NOT NULL DEFAULT now(),
    UNIQUE (project_id, name, version),
    CONSTRAINT ready_means_built CHECK (
        num_nonnulls(store_key, bytes, blake3, num_poses, num_clips, ready_at) IN (0, 6))
);

-- A file belongs to a session or to a motion database. A row exists only when the whole upload is in the store and
-- its checksum was right.
CREATE TABLE files (
    id                 uuid        PRIMARY KEY,
    project_id         uuid        NOT NULL REFERENCES projects ON DELETE CASCADE,
    session_id         uuid        REFERENCES sessions ON DELETE CASCADE,
    motion_database_id uuid        REFERENCES motion_databases ON DELETE CASCADE,
    name               text        NOT NULL CHECK (char_length(name) BETWEEN 1 AND 200),
    role               text        NOT NULL CHECK (role IN ('skeleton', 'control-points', 'ground-truth', 'motion')),
    media_type         text        NOT NULL,
    store_key          text        NOT NULL UNIQUE,
    bytes              bigint      NOT NULL CHECK (bytes >= 0),
    blake3             text        NOT NULL CHECK (blake3 ~ '^[0-9a-f]{64}$'),
    uploaded_at        timestamptz NOT NULL DEFAULT now(),
    CHECK (num_nonnulls(session_id, motion_database_id) = 1),
    UNIQUE (session_id, name),
    UNIQUE (motion_database_id, name)
);

-- The answer of a POST that carried an Idempotency-Key, kept for a day. The row is written in the transaction that
-- does the work, so a second request with the key waits for the first and then gets its answer.
CREATE TABLE idempotency_keys (
    project_id   uuid        NOT NULL REFERENCES projects ON DELETE CASCADE,
    key          text        NOT NULL CHECK (char_length(key) BETWEEN 1 AND 255),
    -- BLAKE3 of method, path and body: the same key with another request is an error
    request_hash bytea       NOT NULL CHECK (octet_length(request_hash) = 32),
    status       integer     NOT NULL,
    location     text,
    response     jsonb       NOT NULL,
    created_at   timestamptz NOT NULL DEFAULT now(),
    PRIMARY KEY (project_id, key)
);
CREATE INDEX idempotency_keys_by_age ON idempotency_keys (created_at);

-- `motion_database_id`: the database that a reconstruction reads.
ALTER TABLE runs
    ADD COLUMN motion_database_id uuid REFERENCES motion_databases ON DELETE SET NULL,
    ADD CONSTRAINT runs_session FOREIGN KEY (session_id) REFERENCES sessions ON DELETE CASCADE;
CREATE INDEX runs_of_project ON runs (project_id, id DESC);
CREATE INDEX runs_of_motion_database ON runs (motion_database_id);

-- Who had a job last, kept after the lease has ended: a run shows its workers.
ALTER TABLE jobs ADD COLUMN last_worker text;
CREATE FUNCTION jobs_keep_last_worker() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    NEW.last_worker := NEW.leased_by;
    RETURN NEW;
END
$$;
CREATE TRIGGER jobs_last_worker BEFORE UPDATE OF leased_by ON jobs FOR EACH ROW
    WHEN (NEW.leased_by IS NOT NULL)
    EXECUTE FUNCTION jobs_keep_last_worker();
