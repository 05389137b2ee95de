//! The layout of this crate's artefacts: 8 letters, u32 length of a JSON header, the header, then f64, all
//! little-endian. Checksums are the store's business.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Error, Result};

pub struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    pub fn new(magic: &[u8; 8], header: &impl Serialize) -> Self {
        // Headers are made of strings and finite numbers, which always are JSON.
        let header = serde_json::to_vec(header).unwrap_or_default();
        let mut bytes = Vec::with_capacity(12 + header.len());
        bytes.extend_from_slice(magic);
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&header);
        Self { bytes }
    }

    pub fn numbers(&mut self, numbers: &[f64]) {
        for v in numbers {
            self.bytes.extend_from_slice(&v.to_le_bytes());
        }
    }

    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

pub struct Reader<'a> {
    rest: &'a [u8],
    what: &'static str,
}

impl<'a> Reader<'a> {
    pub fn new<H: DeserializeOwned>(
        bytes: &'a [u8],
        magic: &[u8; 8],
        what: &'static str,
    ) -> Result<(H, Self)> {
        let wrong = |found: String| Error::Bytes { what, found };
        let rest = bytes.strip_prefix(magic).ok_or_else(|| wrong("other first letters".to_owned()))?;
        let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(|| wrong("no header".to_owned()))?;
        let length = u32::from_le_bytes(*length) as usize;
        if length > rest.len() {
            return Err(wrong(format!("a header of {length} bytes in {} bytes", rest.len())));
        }
        let (header, rest) = rest.split_at(length);
        let header = serde_json::from_slice(header)
            .map_err(|e| wrong(format!("a header that does not parse: {e}")))?;
        Ok((header, Self { rest, what }))
    }

    /// `count` numbers, `None` standing for a product that overflowed.
    pub fn numbers(&mut self, count: Option<usize>) -> Result<Vec<f64>> {
        let bytes = count.and_then(|n| n.checked_mul(8)).filter(|n| *n <= self.rest.len());
        let Some(bytes) = bytes else {
            let found =
                format!("{} bytes of numbers where the header wants {count:?} numbers", self.rest.len());
            return Err(Error::Bytes { what: self.what, found });
        };
        let (numbers, rest) = self.rest.split_at(bytes);
        self.rest = rest;
        Ok(numbers.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
    }

    pub fn end(&self) -> Result<()> {
        if self.rest.is_empty() {
            return Ok(());
        }
        Err(Error::Bytes { what: self.what, found: format!("{} bytes too many", self.rest.len()) })
    }
}
