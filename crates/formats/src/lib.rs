//! Motion file formats: bytes to model and back.
