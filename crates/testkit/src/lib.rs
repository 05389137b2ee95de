//! What tests stand on: recordings that are not ours to ship, where there are any, and with feature `motion` as
//! motions; with `postgres` a real
//! PostgreSQL, thrown away afterwards; with `services` all that a service needs, and motion to give to it.

#[cfg(feature = "postgres")]
pub mod postgres;
#[cfg(feature = "services")]
pub mod sandbox;
pub mod shared;
#[cfg(feature = "services")]
pub mod walker;
