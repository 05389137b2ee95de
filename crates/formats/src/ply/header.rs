use crate::{
    Error, Result,
    text::{Lines, name, quote, words},
};

/// How the data is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Kind of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn from_word(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number in binary data.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// One number, or a list of them, of every item of an element.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// kind of the number that says how long a list is
    pub(super) count: Option<Kind>,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// of the header
    pub(super) line: usize,
}

impl Element {
    /// Least bytes of an item: a number in text takes a digit and a blank.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> usize {
        let number = |kind: Kind| if encoding == Encoding::Text { 2 } else { kind.bytes() };
        self.properties.iter().map(|property| number(property.count.unwrap_or(property.kind))).sum()
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// offset of the data, bytes
    pub(super) data: usize,
    /// lines of the header
    pub(super) lines: usize,
}

impl Header {
    pub(super) fn read(bytes: &[u8]) -> Result<Self> {
        let mut lines = Lines::new(bytes);
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        if lines.next().is_none_or(|line| line.text != b"ply") {
            let found = quote(&bytes[..bytes.len().min(8)]);
            return Err(Error::at_line(1, found, "ply, the beginning of a PLY"));
        }
        loop {
            let Some(line) = lines.next() else {
                return Err(Error::at_line(lines.number(), "the end of the file", "end_header"));
            };
            let wrong = |expected: &str| Error::at_line(line.number, quote(line.text), expected);
            let mut words = words(line.text);
            match words.next() {
                Some(b"end_header") => break,
                Some(b"format") => {
                    encoding = Some(match words.next() {
                        Some(b"ascii") => Encoding::Text,
                        Some(b"binary_little_endian") => Encoding::LittleEndian,
                        Some(b"binary_big_endian") => Encoding::BigEndian,
                        _ => return Err(wrong("ascii, binary_little_endian or binary_big_endian")),
                    });
                }
                Some(b"element") => {
                    let (found, count) = (words.next(), words.next());
                    let count = count.and_then(|word| std::str::from_utf8(word).ok()?.parse().ok());
                    let (Some(found), Some(count)) = (found, count) else {
                        return Err(wrong("element, a name and a number"));
                    };
                    let properties = Vec::new();
                    elements.push(Element { name: name(found), count, properties, line: line.number });
                }
                Some(b"property") => {
                    let element =
                        elements.last_mut().ok_or_else(|| wrong("an element before its properties"))?;
                    let first = words.next().unwrap_or_default();
                    let (count, kind) = if first == b"list" {
                        (words.next().and_then(Kind::from_word), words.next().unwrap_or_default())
                    } else {
                        (None, first)
                    };
                    let is_list_complete = first != b"list" || count.is_some();
                    let (Some(kind), Some(found), true) =
                        (Kind::from_word(kind), words.next(), is_list_complete)
                    else {
                        return Err(wrong(
                            "property, a type such as float, or list and two types, and a name",
                        ));
                    };
                    element.properties.push(Property { name: name(found), kind, count });
                }
                Some(b"comment" | b"obj_info") | None => {}
                Some(_) => return Err(wrong("format, element, property, comment or end_header")),
            }
        }
        let encoding =
            encoding.ok_or_else(|| Error::at_line(lines.number(), "no format", "a line format"))?;
        let data = bytes.len() - lines.rest().len();
        Ok(Self { encoding, elements, data, lines: lines.number() })
    }
}
