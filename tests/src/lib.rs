//! What whole-system tests stand on: a [`System`] of real services on a real database, spoken to by [`Api`] over real
//! HTTP, with [`trials`] of known motion and a [`drawn_capture`] of one.

pub mod api;
pub mod drawn_capture;
pub mod system;
pub mod trials;

pub use api::{Answer, Api};
pub use system::System;
