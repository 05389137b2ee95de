//! Media types of files: what people upload and get, and what jobs leave.

/// Text of any format without a type of its own.
pub const TEXT: &str = "text/plain; charset=utf-8";
/// Tables.
pub const CSV: &str = "text/csv; charset=utf-8";
/// JSON.
pub const JSON: &str = "application/json";
/// Binary formats without a type of their own.
pub const BINARY: &str = "application/octet-stream";
/// Archives that are not packed.
pub const TAR: &str = "application/x-tar";
/// Scenes and bodies.
pub const GLB: &str = "model/gltf-binary";
/// Pictures.
pub const PNG: &str = "image/png";
/// Videos.
pub const MP4: &str = "video/mp4";
