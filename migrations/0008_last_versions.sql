-- Numbers of versions are not used again: whoever names a version that was deleted must not get another in its place.

CREATE TABLE last_versions (
    project_id uuid    NOT NULL REFERENCES projects ON DELETE CASCADE,
    -- table of what is versioned
    noun       text    NOT NULL,
    name       text    NOT NULL,
    version    integer NOT NULL CHECK (version >= 1),
    PRIMARY KEY (project_id, noun, name)
);

-- Every version counts, whoever adds it: services of the version before may still run.
CREATE FUNCTION keep_last_version() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO last_versions AS l (project_id, noun, name, version)
    VALUES (NEW.project_id, TG_TABLE_NAME, NEW.name, NEW.version)
    ON CONFLICT (project_id, noun, name) DO UPDATE SET version = greatest(l.version, excluded.version);
    RETURN NULL;
END
$$;
CREATE TRIGGER motion_databases_keep_last_version AFTER INSERT ON motion_databases
    FOR EACH ROW EXECUTE FUNCTION keep_last_version();
CREATE TRIGGER body_models_keep_last_version AFTER INSERT ON body_models
    FOR EACH ROW EXECUTE FUNCTION keep_last_version();

-- Runs still tell of versions that were deleted.
INSERT INTO last_versions (project_id, noun, name, version)
SELECT project_id, noun, name, max(version) FROM (
    SELECT project_id, 'motion_databases' AS noun, name, version FROM motion_databases
    UNION ALL
    SELECT project_id, 'body_models', name, version FROM body_models
    UNION ALL
    SELECT r.project_id, u.noun, u.used->>'name', (u.used->>'version')::integer
    FROM runs r
    CROSS JOIN LATERAL (VALUES ('motion_databases', r.parameters->'motion_database'),
                               ('body_models', r.parameters->'body_model')) u (noun, used)
    WHERE jsonb_typeof(u.used) = 'object' AND u.used->>'name' <> 'shipped'
      AND CASE WHEN u.used->>'version' ~ '^[1-9][0-9]{0,8}$' THEN true ELSE false END
) known
GROUP BY project_id, noun, name;
