//! The PostgreSQL job queue.
