//! The reconstruction service: full-body motion from control points.
