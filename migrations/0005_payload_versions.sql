-- A payload whose meaning changes gets another version, so that a job in flight is not misread by a newer program.
ALTER TABLE jobs
    ADD COLUMN payload_version integer NOT NULL DEFAULT 1 CHECK (payload_version >= 1);
