//! Numbers as the three kinds of processor store them.

/// The processor whose numbers a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Processor {
    /// little-endian, IEEE
    Intel,
    /// little-endian integers, VAX F floats
    Dec,
    /// big-endian, IEEE
    Mips,
}

impl Processor {
    pub(super) fn u16(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Intel | Self::Dec => u16::from_le_bytes(bytes),
            Self::Mips => u16::from_be_bytes(bytes),
        }
    }

    pub(super) fn i16(self, bytes: [u8; 2]) -> i16 {
        self.u16(bytes).cast_signed()
    }

    pub(super) fn f32(self, bytes: [u8; 4]) -> f32 {
        match self {
            Self::Intel => f32::from_le_bytes(bytes),
            Self::Mips => f32::from_be_bytes(bytes),
            Self::Dec => {
                // words are swapped, and the exponent is larger by two
                let [a, b, c, d] = bytes;
                let value = f32::from_le_bytes([c, d, a, b]);
                // an exponent of 0 is 0, and one of 255 is a number here, not an infinity
                let exponent = u16::from_le_bytes([a, b]) >> 7 & 0xff;
                match exponent {
                    0 => 0.0,
                    255 => f32::from_bits(value.to_bits() - (2 << 23)),
                    _ => value / 4.0,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vax_floats_are_those_of_the_manual() {
        // 1.0 is 0x4080, 0x0000; -2.5 is 0xc120, 0x0000; 100.0 is 0x43c8
        assert_eq!(Processor::Dec.f32([0x80, 0x40, 0, 0]), 1.0);
        assert_eq!(Processor::Dec.f32([0x20, 0xc1, 0, 0]), -2.5);
        assert_eq!(Processor::Dec.f32([0xc8, 0x43, 0, 0]), 100.0);
        assert_eq!(Processor::Dec.f32([0, 0, 0, 0]), 0.0);
        assert!(Processor::Dec.f32([0xff, 0x7f, 0xff, 0xff]).is_finite());
    }
}
