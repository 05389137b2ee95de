use std::{cell::Cell, io};

use crate::Error;

/// Bytes that may still be unpacked.
#[derive(Debug)]
pub(super) struct Budget {
    limit: u64,
    left: Cell<u64>,
    is_exceeded: Cell<bool>,
}

impl Budget {
    pub(super) fn new(bytes: u64) -> Self {
        Self { limit: bytes, left: Cell::new(bytes), is_exceeded: Cell::new(false) }
    }

    pub(super) fn limit_bytes(&self) -> u64 {
        self.limit
    }

    /// Charges what is read to the budget.
    pub(super) fn limit<R: io::Read>(&self, inner: R) -> Limited<'_, R> {
        Limited { inner, budget: self }
    }

    /// Why reading failed: the budget, or damage of the format.
    pub(super) fn error(&self, format: &'static str, error: &io::Error) -> Error {
        self.exceeded().unwrap_or_else(|| Error::Damaged { format, message: error.to_string() })
    }

    /// The error of a budget that is used up.
    pub(super) fn exceeded(&self) -> Option<Error> {
        self.is_exceeded.get().then_some(Error::Limit { what: "bytes unpacked", limit: self.limit })
    }
}

/// A reader that fails once the budget is used up.
#[derive(Debug)]
pub(super) struct Limited<'b, R> {
    inner: R,
    budget: &'b Budget,
}

impl<R: io::Read> io::Read for Limited<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        match self.budget.left.get().checked_sub(read as u64) {
            Some(left) => {
                self.budget.left.set(left);
                Ok(read)
            }
            None => {
                self.budget.is_exceeded.set(true);
                Err(io::Error::other("unpacks to too many bytes"))
            }
        }
    }
}
