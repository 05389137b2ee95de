use motion_db::Clip;

use crate::{Protocol, Sweep};

/// What is evaluated.
#[derive(Debug, Clone)]
pub struct SparseEvaluation<'a> {
    /// motion the database is built from; a smaller database is made of the first of them (see [`crate::shuffle_by_name`])
    pub train: &'a [Clip],
    /// trials to be reconstructed
    pub test: &'a [Clip],
    /// what the database may hold of a trial
    pub protocol: Protocol,
    /// what is varied
    pub sweep: Sweep,
    /// only the first frames of each trial, at 60 a second
    pub max_frames: usize,
    /// trials that are reconstructed at once; no result depends on it, but each takes longer when there are several
    pub threads: usize,
}
