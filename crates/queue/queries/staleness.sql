SELECT (extract(epoch FROM staleness))::float8 AS staleness_secs FROM queue_settings
