/// How work on many rows is divided among threads. The caller chooses; results do not depend on it: every piece is
/// worked out by itself, from what was there before.
pub trait Threads: Sync {
    /// Calls `work(i, piece)` for the i-th piece of `size` elements of `data` (the last may be shorter), each once, in
    /// any order and at any time.
    fn for_each_piece<T: Send>(&self, data: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync);
}

/// One thread: the caller's.
#[derive(Debug, Clone, Copy, Default)]
pub struct OneThread;

impl Threads for OneThread {
    fn for_each_piece<T: Send>(&self, data: &mut [T], size: usize, work: impl Fn(usize, &mut [T]) + Sync) {
        data.chunks_mut(size).enumerate().for_each(|(i, piece)| work(i, piece));
    }
}
