//! What tests stand on: a real PostgreSQL, thrown away afterwards.

pub mod postgres;
