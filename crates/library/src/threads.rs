use motion_db::Threads;
use rayon::prelude::*;

/// All cores of the machine work on an index.
#[derive(Debug, Clone, Copy, Default)]
pub struct AllCores;

impl Threads for AllCores {
    fn for_each_piece<T: Send>(&self, data: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
        data.par_chunks_mut(size).enumerate().for_each(|(i, piece)| work(i, piece));
    }
}
