use model::Silhouette;

/// What each pixel of a frame shows. A pixel of none of these is plain background.
#[derive(Debug, Clone, PartialEq)]
pub struct Classes {
    /// something that isn't the background
    pub foreground: Silhouette,
    /// background, darker than usual
    pub shadow: Silhouette,
    /// background, brighter than usual
    pub highlight: Silhouette,
}

impl Classes {
    /// All plain background.
    pub fn new(width: usize, height: usize) -> Self {
        let empty = Silhouette::empty(width, height);
        Self { foreground: empty.clone(), shadow: empty.clone(), highlight: empty }
    }

    /// Classes of 64 pixels: word `word` of row `y`.
    #[inline(always)]
    pub(crate) fn put(&mut self, y: usize, word: usize, flags: &Flags) {
        self.foreground.row_mut(y)[word] = packed(&flags.foreground);
        self.shadow.row_mut(y)[word] = packed(&flags.shadow);
        self.highlight.row_mut(y)[word] = packed(&flags.highlight);
    }
}

/// Classes of 64 pixels, 0 or 1 each.
pub(crate) struct Flags {
    pub foreground: [u8; 64],
    pub shadow: [u8; 64],
    pub highlight: [u8; 64],
}

impl Flags {
    pub const NONE: Self = Self { foreground: [0; 64], shadow: [0; 64], highlight: [0; 64] };
}

/// 64 bytes of 0 or 1 as bits; eight at a time, by a product that brings the lowest bit of byte i to bit 56 + i.
#[inline(always)]
fn packed(flags: &[u8; 64]) -> u64 {
    let (bytes, _) = flags.as_chunks::<8>();
    bytes.iter().enumerate().fold(0, |bits, (i, eight)| {
        bits | (u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * i)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flag_becomes_its_bit() {
        for bit in 0..64 {
            let mut flags = [0; 64];
            flags[bit] = 1;
            assert_eq!(packed(&flags), 1 << bit);
        }
        assert_eq!(packed(&[1; 64]), u64::MAX);
    }
}
