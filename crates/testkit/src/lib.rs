//! What tests stand on: recordings that are not ours to ship, where there are any, and (feature `services`) a real
//! PostgreSQL, thrown away afterwards.

#[cfg(feature = "services")]
pub mod postgres;
pub mod shared;
