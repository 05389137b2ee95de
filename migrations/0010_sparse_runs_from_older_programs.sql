-- Gateways of the version before may still run and add runs from control points under their former name.
CREATE FUNCTION name_sparse_run() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    NEW.kind := 'sparse';
    RETURN NEW;
END
$$;

CREATE TRIGGER runs_name_sparse_run BEFORE INSERT ON runs
    FOR EACH ROW WHEN (NEW.kind = 'reconstruction') EXECUTE FUNCTION name_sparse_run();

-- What they added since the names were changed.
UPDATE runs SET kind = 'sparse' WHERE kind = 'reconstruction';
