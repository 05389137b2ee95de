//! Throw-away PostgreSQL and synthetic captures for tests.
