UPDATE queue_settings SET staleness = make_interval(secs => $1)
