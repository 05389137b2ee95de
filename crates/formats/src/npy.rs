//! NPY: one array of numbers, as NumPy writes it.

use model::counted;

use crate::{Error, Result, error::at_byte, text::quote};

/// An array: numbers in C order (the last index runs fastest).
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// length along each dimension; empty for a single number
    pub shape: Vec<usize>,
    /// the numbers; integers above 2^53 are rounded
    pub values: Vec<f64>,
}

/// Most dimensions of an array.
const MOST_DIMENSIONS: usize = 32;

const MAGIC: &[u8] = b"\x93NUMPY";

/// Reads an array of integers or floats of either byte order; arrays in Fortran order are brought into C order.
///
/// # Errors
/// If the header is not as the format wants it, the numbers are of another kind (complex, text, objects), or there is not
/// exactly the data that the shape needs.
pub fn read(bytes: &[u8]) -> Result<Array> {
    let Some([major, _minor]) = bytes.strip_prefix(MAGIC).and_then(|rest| rest.get(..2)) else {
        let found = quote(&bytes[..bytes.len().min(8)]);
        return Err(at_byte(0, found, "the beginning of an NPY"));
    };
    // the length of the header has two bytes in version 1 and four in 2 and 3
    let (at, width) = match major {
        1 => (8, 2),
        2 | 3 => (8, 4),
        version => return Err(at_byte(6, format!("version {version}"), "1, 2 or 3")),
    };
    let ends_early = || at_byte(bytes.len() as u64, "the end of the file", "the header of an NPY");
    let length = bytes.get(at..at + width).ok_or_else(ends_early)?;
    let length = length.iter().rev().fold(0_usize, |length, byte| length << 8 | usize::from(*byte));
    let start = at + width;
    let end = start.checked_add(length).filter(|end| *end <= bytes.len()).ok_or_else(ends_early)?;
    let header = String::from_utf8_lossy(&bytes[start..end]);
    let wrong = |what: &str, expected: &str| {
        at_byte(start as u64, format!("{what} in the header {}", quote(header.as_bytes())), expected)
    };
    let kind = field(&header, "descr").and_then(Kind::from_descr);
    let kind =
        kind.ok_or_else(|| wrong("no such descr", "integers or floats of 1 to 8 bytes, such as '<f4'"))?;
    let is_fortran = match field(&header, "fortran_order") {
        Some("False") => false,
        Some("True") => true,
        _ => return Err(wrong("no fortran_order", "True or False")),
    };
    let shape = shape(&header).ok_or_else(|| wrong("no shape", "a tuple of whole numbers"))?;
    let count = shape.iter().try_fold(1_usize, |count, side| count.checked_mul(*side));
    let needed = count.and_then(|count| count.checked_mul(kind.bytes));
    if needed != Some(bytes.len() - end) {
        let found = format!("{} of data", counted(bytes.len() - end, "byte"));
        let expected = format!("those of an array of {shape:?} numbers of {} bytes", kind.bytes);
        return Err(at_byte(end as u64, found, expected));
    }
    let values = kind.numbers(&bytes[end..]);
    let values = if is_fortran { from_fortran(&shape, &values) } else { values };
    Ok(Array { shape, values })
}

impl Array {
    /// The numbers as rows of three, of an array whose last dimension is 3.
    ///
    /// # Errors
    /// [`Error::Unexpected`] with the shape found.
    pub fn points(&self) -> Result<Vec<nalgebra::Vector3<f64>>> {
        if self.shape.last() == Some(&3) && self.shape.len() > 1 {
            Ok(self.values.chunks_exact(3).map(nalgebra::Vector3::from_column_slice).collect())
        } else {
            Err(Error::whole_file(format!("an array of shape {:?}", self.shape), "a last dimension of 3"))
        }
    }
}

/// Text of a field of the header, which is a Python dict.
fn field<'h>(header: &'h str, name: &str) -> Option<&'h str> {
    let at = header.find(&format!("'{name}'"))? + name.len() + 2;
    let rest = header[at..].trim_start().strip_prefix(':')?.trim_start();
    Some(rest.split([',', '}']).next()?.trim().trim_matches('\''))
}

fn shape(header: &str) -> Option<Vec<usize>> {
    let at = header.find("'shape'")? + "'shape'".len();
    let rest = header[at..].trim_start().strip_prefix(':')?.trim_start().strip_prefix('(')?;
    let sides = rest.split_once(')')?.0;
    let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
    let shape = sides.map(|side| side.parse().ok()).take(MOST_DIMENSIONS + 1).collect::<Option<Vec<_>>>()?;
    (shape.len() <= MOST_DIMENSIONS).then_some(shape)
}

/// How a number is stored.
#[derive(Debug, Clone, Copy)]
struct Kind {
    is_big_endian: bool,
    /// `i`, `u` or `f`; a bool is a `u`
    letter: u8,
    bytes: usize,
}

impl Kind {
    fn from_descr(descr: &str) -> Option<Self> {
        let [order, letter, digit] = descr.as_bytes() else { return None };
        let bytes = usize::from(digit.checked_sub(b'0')?);
        let is_known = match letter {
            b'i' | b'u' => [1, 2, 4, 8].contains(&bytes),
            b'f' => [2, 4, 8].contains(&bytes),
            b'b' => bytes == 1,
            _ => false,
        };
        let is_order = [b'<', b'>', b'|', b'='].contains(order) && (*order != b'|' || bytes == 1);
        (is_known && is_order).then_some(Self { is_big_endian: *order == b'>', letter: *letter, bytes })
    }

    fn numbers(self, bytes: &[u8]) -> Vec<f64> {
        let is_big = self.is_big_endian;
        match (self.letter, self.bytes) {
            (b'f', 2) => each(bytes, is_big, |number| half(u16::from_le_bytes(number))),
            (b'f', 4) => each(bytes, is_big, |number| f64::from(f32::from_le_bytes(number))),
            (b'f', _) => each(bytes, is_big, f64::from_le_bytes),
            (b'i', 1) => each(bytes, is_big, |number| f64::from(i8::from_le_bytes(number))),
            (b'i', 2) => each(bytes, is_big, |number| f64::from(i16::from_le_bytes(number))),
            (b'i', 4) => each(bytes, is_big, |number| f64::from(i32::from_le_bytes(number))),
            (b'i', _) => each(bytes, is_big, |number| i64::from_le_bytes(number) as f64),
            (_, 1) => each(bytes, is_big, |number: [u8; 1]| f64::from(number[0])),
            (_, 2) => each(bytes, is_big, |number| f64::from(u16::from_le_bytes(number))),
            (_, 4) => each(bytes, is_big, |number| f64::from(u32::from_le_bytes(number))),
            _ => each(bytes, is_big, |number| u64::from_le_bytes(number) as f64),
        }
    }
}

/// Every `N` bytes as a number.
fn each<const N: usize>(bytes: &[u8], is_big_endian: bool, number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    let little = |found: &[u8; N]| {
        let mut little = *found;
        if is_big_endian {
            little.reverse();
        }
        number(little)
    };
    bytes.as_chunks().0.iter().map(little).collect()
}

/// A float of 16 bits: sign, 5 of exponent, 10 of fraction.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (bits >> 10 & 31, f64::from(bits & 1023) / 1024.0);
    sign * match exponent {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2_f64.powi(i32::from(exponent) - 15),
    }
}

/// The numbers of an array in whose file the first index runs fastest, in C order.
fn from_fortran(shape: &[usize], values: &[f64]) -> Vec<f64> {
    let mut index = vec![0; shape.len()];
    let mut ordered = Vec::with_capacity(values.len());
    for _ in 0..values.len() {
        let at = index.iter().zip(shape).rev().fold(0, |at, (index, side)| at * side + index);
        ordered.push(values[at]);
        for (index, side) in index.iter_mut().zip(shape).rev() {
            *index += 1;
            if *index < *side {
                break;
            }
            *index = 0;
        }
    }
    ordered
}

/// An array of floats of 32 bits as NPY, version 1.
///
/// # Errors
/// If there are not as many values as the shape needs.
pub fn write_f32(shape: &[usize], values: &[f32]) -> Result<Vec<u8>> {
    if shape.iter().try_fold(1_usize, |count, side| count.checked_mul(*side)) != Some(values.len()) {
        return Err(Error::whole_file(counted(values.len(), "value"), format!("those of {shape:?}")));
    }
    let sides: String = shape.iter().map(|side| format!("{side}, ")).collect();
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({sides}), }}");
    // the data begins at a multiple of 64 bytes
    while !(MAGIC.len() + 4 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let length = u16::try_from(header.len())
        .map_err(|_| Error::whole_file(format!("{} dimensions", shape.len()), "fewer dimensions"))?;
    let mut bytes = MAGIC.to_vec();
    bytes.extend([1, 0]);
    bytes.extend(length.to_le_bytes());
    bytes.extend(header.as_bytes());
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    Ok(bytes)
}
