//! The skeleton of a performer, fitted to the paths of a few points.
