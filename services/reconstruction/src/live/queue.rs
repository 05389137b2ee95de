//! A bounded queue between a thread that computes and tasks that wait.

use std::{
    collections::VecDeque,
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};
use tokio::sync::Notify;

/// One producer, one consumer, at most so many items. Either side may be a thread or a task.
#[derive(Debug)]
pub(crate) struct Queue<T> {
    capacity: usize,
    state: Mutex<State<T>>,
    /// for the thread, on either side
    changed: Condvar,
    /// for the task that takes
    has_item: Notify,
    /// for the task that puts
    has_room: Notify,
}

#[derive(Debug)]
struct State<T> {
    items: VecDeque<T>,
    is_closed: bool,
}

/// The other side is gone, or stands still for too long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Gone;

impl<T> Queue<T> {
    pub fn new(capacity: usize) -> Self {
        let state = State { items: VecDeque::with_capacity(capacity + 1), is_closed: false };
        Self {
            capacity,
            state: Mutex::new(state),
            changed: Condvar::new(),
            has_item: Notify::new(),
            has_room: Notify::new(),
        }
    }

    /// Puts an item; where there is no room, the oldest goes and is given back.
    pub fn put_dropping(&self, item: T) -> Result<Option<T>, Gone> {
        let mut state = self.lock();
        if state.is_closed {
            return Err(Gone);
        }
        let dropped = if state.items.len() >= self.capacity { state.items.pop_front() } else { None };
        self.put(state, item);
        Ok(dropped)
    }

    /// Puts an item once there is room.
    pub async fn put_waiting(&self, item: T) -> Result<(), Gone> {
        let mut item = Some(item);
        loop {
            let room = self.has_room.notified();
            if self.try_put(&mut item)? {
                return Ok(());
            }
            room.await;
        }
    }

    /// Puts the item if there is room; whether there was.
    fn try_put(&self, item: &mut Option<T>) -> Result<bool, Gone> {
        let state = self.lock();
        if state.is_closed {
            return Err(Gone);
        }
        if state.items.len() >= self.capacity {
            return Ok(false);
        }
        if let Some(item) = item.take() {
            self.put(state, item);
        }
        Ok(true)
    }

    /// Puts an item once there is room, on a thread; gives up when nothing was taken for `patience`.
    pub fn put_blocking(&self, item: T, patience: Duration) -> Result<(), Gone> {
        let until = Instant::now() + patience;
        let mut state = self.lock();
        while !state.is_closed && state.items.len() >= self.capacity {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(Gone);
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
        if state.is_closed {
            return Err(Gone);
        }
        self.put(state, item);
        Ok(())
    }

    /// Puts the last items, room or not, and closes.
    pub fn finish(&self, last: impl IntoIterator<Item = T>) {
        let mut state = self.lock();
        if !state.is_closed {
            state.items.extend(last);
        }
        drop(state);
        self.close();
    }

    /// The next item; `None` when there will be none.
    pub async fn take(&self) -> Option<T> {
        loop {
            let item = self.has_item.notified();
            if let Ok(taken) = self.try_take() {
                return Some(taken);
            }
            if self.is_at_end() {
                return None;
            }
            item.await;
        }
    }

    fn try_take(&self) -> Result<T, Gone> {
        let mut state = self.lock();
        let taken = state.items.pop_front().ok_or(Gone)?;
        self.took(state);
        Ok(taken)
    }

    fn is_at_end(&self) -> bool {
        let state = self.lock();
        state.is_closed && state.items.is_empty()
    }

    /// The next item, on a thread; `None` when there will be none.
    pub fn take_blocking(&self) -> Option<T> {
        let mut state = self.lock();
        loop {
            if let Some(taken) = state.items.pop_front() {
                self.took(state);
                return Some(taken);
            }
            if state.is_closed {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Nothing more is put; what is there can still be taken.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
        self.has_item.notify_one();
        self.has_room.notify_one();
    }

    fn put(&self, mut state: MutexGuard<'_, State<T>>, item: T) {
        state.items.push_back(item);
        drop(state);
        self.changed.notify_all();
        self.has_item.notify_one();
    }

    fn took(&self, state: MutexGuard<'_, State<T>>) {
        drop(state);
        self.changed.notify_all();
        self.has_room.notify_one();
    }

    fn lock(&self) -> MutexGuard<'_, State<T>> {
        // Held for moves of items only: a panic leaves nothing half-done.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn what_comes_too_fast_pushes_out_the_oldest() {
        let queue = Queue::new(4);
        let dropped: Vec<u32> = (0..10).filter_map(|i| queue.put_dropping(i).unwrap()).collect();
        assert_eq!(dropped, [0, 1, 2, 3, 4, 5]);
        queue.close();
        let left: Vec<u32> = std::iter::from_fn(|| queue.take_blocking()).collect();
        assert_eq!(left, [6, 7, 8, 9]);
        assert_eq!(queue.put_dropping(10), Err(Gone));
    }

    #[tokio::test]
    async fn who_must_not_drop_waits_for_room() {
        let queue = Arc::new(Queue::new(2));
        let taker = queue.clone();
        let thread =
            std::thread::spawn(move || std::iter::from_fn(|| taker.take_blocking()).collect::<Vec<_>>());
        for i in 0..1000 {
            queue.put_waiting(i).await.unwrap();
            assert!(queue.lock().items.len() <= 2);
        }
        queue.close();
        assert_eq!(thread.join().unwrap(), (0..1000).collect::<Vec<_>>());
    }

    #[tokio::test]
    async fn a_thread_waits_for_a_task_that_takes() {
        let queue = Arc::new(Queue::new(1));
        let putter = queue.clone();
        let thread = std::thread::spawn(move || {
            for i in 0..1000 {
                putter.put_blocking(i, Duration::from_secs(60)).unwrap();
            }
            putter.finish([1000, 1001, 1002]);
        });
        for i in 0..1003 {
            assert_eq!(queue.take().await, Some(i));
        }
        assert_eq!(queue.take().await, None);
        thread.join().unwrap();
    }

    #[test]
    fn nobody_waits_for_ever_for_who_does_not_read() {
        let queue = Queue::new(1);
        queue.put_blocking(0, Duration::ZERO).unwrap();
        assert_eq!(queue.put_blocking(1, Duration::from_millis(1)), Err(Gone));
    }
}
