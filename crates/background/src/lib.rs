//! Silhouettes from frames.
