//! Sparse reconstruction: full-body motion from a few control points.
