-- Services of the version before may still run and enqueue the job under its former name.
CREATE FUNCTION name_fit_shape() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    NEW.kind := 'fit-shape';
    RETURN NEW;
END
$$;

CREATE TRIGGER jobs_name_fit_shape BEFORE INSERT ON jobs
    FOR EACH ROW WHEN (NEW.kind = 'initialise-body') EXECUTE FUNCTION name_fit_shape();
