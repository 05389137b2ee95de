use serde::{Deserialize, Serialize};

/// Who did a job, and how long it took. Goes to `run.json`, never into a motion or a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JobReport {
    /// The worker process.
    pub worker: String,
    /// Which attempt it was, from 1.
    pub attempt: i32,
    /// Time it took, seconds.
    pub seconds: f64,
    /// Frames that it computed.
    pub frames: usize,
}
