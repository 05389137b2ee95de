use std::collections::HashMap;

use super::{bytes::Processor, ends_early};
use crate::{Result, error::at_byte, text::quote};

/// Bytes of a block; pointers in the file count blocks from 1.
pub(super) const BLOCK: usize = 512;

/// The parameters of a file, by group and name in capitals.
#[derive(Debug)]
pub(super) struct Parameters<'a> {
    groups: HashMap<i8, String>,
    list: HashMap<(i8, String), Parameter<'a>>,
}

/// One parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Parameter<'a> {
    /// where its values start
    pub(super) offset: u64,
    /// bytes of a value; -1 for text
    kind: i8,
    dimensions: &'a [u8],
    data: &'a [u8],
    processor: Processor,
}

/// Reads forward, by name of what is read.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, length: usize, what: &str) -> Result<&'a [u8]> {
        let end = self.at.checked_add(length).filter(|end| *end <= self.bytes.len());
        let end = end.ok_or_else(|| ends_early(self.bytes, what))?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    fn byte(&mut self, what: &str) -> Result<u8> {
        self.take(1, what).map(|b| b[0])
    }
}

impl<'a> Parameters<'a> {
    pub(super) fn read(bytes: &'a [u8]) -> Result<(Processor, Self)> {
        let [block, key, ..] = *bytes else { return Err(ends_early(bytes, "a header of 512 bytes")) };
        if key != 0x50 {
            return Err(at_byte(1, format!("{key:#04x}"), "0x50, the mark of a C3D file"));
        }
        if block == 0 {
            return Err(at_byte(0, "0", "the block of the parameters, from 1"));
        }
        let mut cursor = Cursor { bytes, at: (usize::from(block) - 1) * BLOCK };
        let start = cursor.at as u64;
        let head = cursor.take(4, "the parameter section")?;
        let processor = match head[3] {
            84 => Processor::Intel,
            85 => Processor::Dec,
            86 => Processor::Mips,
            other => {
                let expected = "the processor: 84 (Intel), 85 (DEC) or 86 (MIPS)";
                return Err(at_byte(start + 3, other.to_string(), expected));
            }
        };
        let mut parameters = Self { groups: HashMap::new(), list: HashMap::new() };
        while parameters.record(&mut cursor, processor)? {}
        Ok((processor, parameters))
    }

    /// Reads a group or a parameter; whether another follows.
    fn record(&mut self, cursor: &mut Cursor<'a>, processor: Processor) -> Result<bool> {
        // a negative length locks the record
        let length = cursor.byte("the name of a parameter")?.cast_signed().unsigned_abs();
        if length == 0 {
            return Ok(false);
        }
        let id = cursor.byte("the id of a group")?.cast_signed();
        let name = cursor.take(usize::from(length), "the name of a parameter")?;
        let name = String::from_utf8_lossy(name).to_uppercase();
        let pointer = cursor.at;
        let offset = cursor.take(2, "the offset of the next parameter")?;
        let offset = usize::from(processor.u16([offset[0], offset[1]]));
        if id < 0 {
            self.groups.entry(id).or_insert(name);
        } else {
            let parameter = Parameter::read(cursor, processor, &name)?;
            // groups are numbered -id
            self.list.entry((id.wrapping_neg(), name)).or_insert(parameter);
        }
        if offset == 0 {
            return Ok(false);
        }
        let next = pointer + offset;
        if offset < 2 || next > cursor.bytes.len() {
            let found = format!("an offset of {offset} bytes to the next parameter");
            return Err(at_byte(pointer as u64, found, "one within the file"));
        }
        cursor.at = next;
        Ok(true)
    }

    pub(super) fn get(&self, group: &str, name: &str) -> Option<Parameter<'a>> {
        // of groups of one name, which damaged files have, the lowest number: always the same one
        let ids = self.groups.iter().filter(|(_, g)| *g == group).map(|(id, _)| *id);
        ids.filter_map(|id| Some((id, self.list.get(&(id, name.to_owned()))?)))
            .max_by_key(|(id, _)| *id)
            .map(|(_, parameter)| *parameter)
    }
}

impl<'a> Parameter<'a> {
    fn read(cursor: &mut Cursor<'a>, processor: Processor, name: &str) -> Result<Self> {
        let start = cursor.at as u64;
        let kind = cursor.byte("the type of a parameter")?.cast_signed();
        if !matches!(kind, -1 | 1 | 2 | 4) {
            let found = format!("type {kind} of parameter {}", quote(name.as_bytes()));
            return Err(at_byte(start, found, "-1 (text), 1, 2 or 4 bytes"));
        }
        let count = cursor.byte("the number of dimensions")?;
        if count > 7 {
            let found = format!("{count} dimensions of parameter {}", quote(name.as_bytes()));
            return Err(at_byte(start + 1, found, "at most 7"));
        }
        let dimensions = cursor.take(usize::from(count), "the dimensions of a parameter")?;
        let offset = cursor.at as u64;
        let values: u64 = dimensions.iter().map(|d| u64::from(*d)).product();
        let length = usize::try_from(values * u64::from(kind.unsigned_abs())).unwrap_or(usize::MAX);
        let data = cursor.take(length, &format!("{length} bytes of parameter {}", quote(name.as_bytes())))?;
        Ok(Self { offset, kind, dimensions, data, processor })
    }

    /// The values of a parameter of text, without blanks around them; the first dimension is the length of one.
    pub(super) fn texts(self) -> impl Iterator<Item = &'a [u8]> {
        let length = match (self.kind, self.dimensions) {
            (-1, []) => 1,
            (-1, [length, ..]) => usize::from(*length),
            _ => 0,
        };
        self.data.chunks_exact(length.max(1)).filter(move |_| length > 0).map(|text| {
            let end = text.iter().rposition(|b| !matches!(b, 0 | b' ')).map_or(0, |last| last + 1);
            text[..end].trim_ascii()
        })
    }

    /// The values of a parameter of numbers.
    pub(super) fn numbers(self) -> impl Iterator<Item = f64> {
        let width = if self.kind > 0 { usize::from(self.kind.unsigned_abs()) } else { 0 };
        self.data.chunks_exact(width.max(1)).filter(move |_| width > 0).map(move |value| match *value {
            [a, b, c, d] => f64::from(self.processor.f32([a, b, c, d])),
            [a, b] => f64::from(self.processor.i16([a, b])),
            _ => f64::from(value[0]),
        })
    }

    /// The values of a parameter of words, which hold counts without sign.
    pub(super) fn counts(self) -> impl Iterator<Item = u64> {
        let is_float = self.kind == 4;
        self.numbers().filter_map(move |value| match value {
            v if is_float => (0.0..1e15).contains(&v).then_some(v as u64),
            // every value of a word fits; negative ones are counts above 32,767
            v => Some(u64::from((v as i16).cast_unsigned())),
        })
    }
}
