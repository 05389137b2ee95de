/// Frames per second of a drawn motion.
pub const FRAME_RATE: f64 = 60.0;
