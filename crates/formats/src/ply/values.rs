use model::counted;

use super::header::{Element, Encoding, Header, Kind, Property};
use crate::{
    Error, Place, Result,
    text::{number, quote},
};

/// The numbers of the data, one after the other.
pub(super) struct Values<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
    /// of text, from 1
    line: usize,
}

impl<'a> Values<'a> {
    pub(super) fn new(bytes: &'a [u8], header: &Header) -> Self {
        Self { bytes, at: header.data, encoding: header.encoding, line: header.lines + 1 }
    }

    /// Refuses an element that says it has more items than there is data for.
    pub(super) fn check_room(&self, element: &Element) -> Result<()> {
        let least = element.least_bytes(self.encoding);
        if least == 0 && element.count > 0 {
            return Err(Error::at_line(
                element.line,
                format!("an element {:.40}", element.name),
                "properties",
            ));
        }
        // the last number of a text needs no blank after it
        let room = self.bytes.len() - self.at + 1;
        if element.count.checked_mul(least).is_none_or(|bytes| bytes > room) {
            let found = format!("{} of data", counted(room - 1, "byte"));
            let expected =
                format!("{} items of {:.40}, {least} bytes each or more", element.count, element.name);
            return Err(self.unexpected(found, expected));
        }
        Ok(())
    }

    pub(super) fn unexpected(&self, found: impl Into<String>, expected: impl Into<String>) -> Error {
        let place = match self.encoding {
            Encoding::Text => Place::Line(self.line),
            _ => Place::Byte(self.at as u64),
        };
        Error::Unexpected { place, found: found.into(), expected: expected.into() }
    }

    pub(super) fn number(&mut self, kind: Kind) -> Result<f64> {
        if self.encoding == Encoding::Text {
            let word = self.word();
            return number(word).ok_or_else(|| self.unexpected(quote(word), "a number"));
        }
        let Some(found) = self.bytes.get(self.at..self.at + kind.bytes()) else {
            return Err(self.unexpected(
                "the end of the file",
                format!("a number of {}", counted(kind.bytes(), "byte")),
            ));
        };
        let mut little = [0; 8];
        little[..found.len()].copy_from_slice(found);
        if self.encoding == Encoding::BigEndian {
            little[..found.len()].reverse();
        }
        self.at += found.len();
        let [a, b, c, d, ..] = little;
        Ok(match kind {
            Kind::I8 => f64::from(a.cast_signed()),
            Kind::U8 => f64::from(a),
            Kind::I16 => f64::from(i16::from_le_bytes([a, b])),
            Kind::U16 => f64::from(u16::from_le_bytes([a, b])),
            Kind::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Kind::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Kind::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Kind::F64 => f64::from_le_bytes(little),
        })
    }

    /// A count, or the index of a vertex.
    pub(super) fn index(&mut self, kind: Kind) -> Result<u32> {
        let value = self.number(kind)?;
        if value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 {
            Ok(value as u32)
        } else {
            Err(self.unexpected(format!("{value}"), "a whole number from 0"))
        }
    }

    pub(super) fn skip(&mut self, property: &Property) -> Result<()> {
        let count = match property.count {
            None => 1,
            Some(kind) => self.index(kind)?,
        };
        for _ in 0..count {
            self.number(property.kind)?;
        }
        Ok(())
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.bytes[self.at..].trim_ascii().is_empty()
    }

    /// The next word of text, empty at the end.
    fn word(&mut self) -> &'a [u8] {
        while let Some(byte) = self.bytes.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.line += usize::from(*byte == b'\n');
            self.at += 1;
        }
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|byte| !byte.is_ascii_whitespace()) {
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }
}
