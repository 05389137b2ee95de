use std::error::Error;
use std::io::{self, Read};

use flate2::bufread::MultiGzDecoder;
use ruzstd::decoding::{FrameDecoder, StreamingDecoder, errors::FrameDecoderError};

/// Compression of a single stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compression {
    Gzip,
    Zstd,
}

impl Compression {
    /// By the first bytes.
    pub(super) fn detect(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x1f, 0x8b, ..] => Some(Self::Gzip),
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Some(Self::Zstd),
            _ => None,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip stream",
            Self::Zstd => "zstd stream",
        }
    }

    /// Whether a file's name ends as it should with this compression.
    pub(super) fn is_named(self, name: &[u8]) -> bool {
        let name = name.to_ascii_lowercase();
        match self {
            Self::Gzip => name.ends_with(b".gz"),
            Self::Zstd => name.ends_with(b".zst"),
        }
    }

    /// Unpacks all members or frames, one after the other.
    pub(super) fn reader<'a>(self, bytes: &'a [u8]) -> Box<dyn Read + 'a> {
        match self {
            Self::Gzip => Box::new(MultiGzDecoder::new(bytes)),
            Self::Zstd => Box::new(ZstdFrames { rest: bytes, frame: None }),
        }
    }
}

/// Frames of zstd, one after the other; those that are to be skipped are.
struct ZstdFrames<'a> {
    /// after the frame that is being read
    rest: &'a [u8],
    frame: Option<StreamingDecoder<&'a [u8], FrameDecoder>>,
}

impl ZstdFrames<'_> {
    /// Starts the next frame; whether there is one.
    fn next_frame(&mut self) -> io::Result<bool> {
        while let [0x50..=0x5f, 0x2a, 0x4d, 0x18, a, b, c, d, after @ ..] = self.rest {
            let length = u32::from_le_bytes([*a, *b, *c, *d]);
            let next = usize::try_from(length).ok().and_then(|length| after.get(length..));
            self.rest = next.ok_or(io::ErrorKind::UnexpectedEof)?;
        }
        if self.rest.is_empty() {
            return Ok(false);
        }
        self.frame = Some(StreamingDecoder::new(self.rest).map_err(|e| reason(&e))?);
        Ok(true)
    }
}

/// Why the decoder stopped, which it tells in words of its own code.
fn reason(error: &(dyn Error + 'static)) -> io::Error {
    let mut next = Some(error);
    while let Some(error) = next {
        let io_error = error.downcast_ref::<io::Error>();
        if io_error.is_some_and(|error| error.kind() == io::ErrorKind::UnexpectedEof) {
            return io::Error::new(io::ErrorKind::UnexpectedEof, "it ends in the middle of its data");
        }
        match error.downcast_ref::<FrameDecoderError>() {
            Some(FrameDecoderError::WindowSizeTooBig { requested, max }) => {
                return io::Error::other(format!(
                    "it needs a window of {requested} bytes to unpack, expected at most {max}; compress it without --long or \
                     --ultra"
                ));
            }
            Some(FrameDecoderError::DictNotProvided { .. }) => {
                return io::Error::other("it was compressed with a dictionary; compress it without one");
            }
            _ => {}
        }
        // what an `io::Error` holds is not among its sources
        next = match io_error {
            Some(io_error) => io_error.get_ref().map(|inner| inner as &(dyn Error + 'static)),
            None => error.source(),
        };
    }
    io::Error::new(io::ErrorKind::InvalidData, "its data is damaged")
}

impl Read for ZstdFrames<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            let Some(frame) = &mut self.frame else {
                if !self.next_frame()? {
                    return Ok(0);
                }
                continue;
            };
            let read = frame.read(buffer).map_err(|e| reason(&e))?;
            if read > 0 {
                return Ok(read);
            }
            let decoder = &frame.decoder;
            let stated = decoder.get_checksum_from_data();
            if stated.is_some() && stated != decoder.get_calculated_checksum() {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "checksum does not match"));
            }
            self.rest = frame.get_ref();
            self.frame = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpack(bytes: &[u8]) -> io::Result<Vec<u8>> {
        let mut out = Vec::new();
        Compression::detect(bytes).unwrap().reader(bytes).read_to_end(&mut out)?;
        Ok(out)
    }

    fn zstd(bytes: &[u8]) -> Vec<u8> {
        ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
    }

    #[test]
    fn frames_one_after_the_other_are_one_stream() {
        let skipped = [0x50, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 1, 2, 3];
        let packed = [skipped.as_slice(), &zstd(b"one "), &skipped, &zstd(b""), &zstd(b"two")].concat();
        assert_eq!(unpack(&packed).unwrap(), b"one two");
    }

    #[test]
    fn truncated_streams_are_errors() {
        let packed = zstd(&b"some text that is long enough ".repeat(20));
        for length in 4..packed.len() {
            let error = unpack(&packed[..length]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof, "{length} of {}: {error}", packed.len());
        }
    }

    #[test]
    fn a_stream_that_is_not_unpacked_says_why() {
        let mut damaged = zstd(&b"some text that is long enough ".repeat(20));
        let blocks = damaged.len() - 12;
        damaged[blocks..].fill(0xff);
        assert_eq!(unpack(&damaged).unwrap_err().to_string(), "its data is damaged");
        // a frame's header: no dictionary and a window of 2 GiB; dictionary 7 and a window of 1 KiB
        let frame = |header: &[u8]| [&[0x28, 0xb5, 0x2f, 0xfd], header, &[1, 0, 0]].concat();
        let error = unpack(&frame(&[0x00, 21 << 3])).unwrap_err().to_string();
        assert!(error.starts_with("it needs a window of 2147483648 bytes to unpack"), "{error}");
        let error = unpack(&frame(&[0x01, 0, 7])).unwrap_err().to_string();
        assert!(error.starts_with("it was compressed with a dictionary"), "{error}");
    }
}
