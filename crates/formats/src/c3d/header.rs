use model::{counted, shown};

use super::{
    bytes::Processor,
    ends_early,
    parameters::{BLOCK, Parameters},
};
use crate::{Place, Result, error::at_byte, read::Warnings};

/// How the data lies in the file.
#[derive(Debug)]
pub(super) struct Header {
    pub(super) points: usize,
    /// analog values in a frame
    pub(super) analog: usize,
    pub(super) frames: usize,
    /// offset of the data, bytes
    pub(super) data: usize,
    /// file units in a step of an integer; negative for data in floats
    pub(super) scale: f64,
    /// frames per second
    pub(super) rate: f64,
}

impl Header {
    pub(super) fn read(
        bytes: &[u8],
        processor: Processor,
        parameters: &Parameters<'_>,
        warnings: &mut Warnings,
    ) -> Result<Self> {
        if bytes.len() < BLOCK {
            return Err(ends_early(bytes, "a header of 512 bytes"));
        }
        let word = |number: usize| processor.u16([bytes[2 * number - 2], bytes[2 * number - 1]]);
        let float = |number: usize| {
            let at = 2 * number - 2;
            f64::from(processor.f32([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
        };
        let number = |name| parameters.get("POINT", name).and_then(|p| p.numbers().next());
        let count = |name| parameters.get("POINT", name).and_then(|p| p.counts().next());

        let points = usize::from(word(2));
        if points == 0 {
            return Err(at_byte(2, "0 points", "at least one"));
        }
        if count("USED").is_some_and(|used| used != points as u64) {
            let used = count("USED").unwrap_or_default();
            warnings.add(
                Place::Byte(2),
                format!("the header has {}, POINT:USED is {used}", counted(points, "point")),
            );
        }
        let scale = number("SCALE").filter(|s| *s != 0.0).unwrap_or(float(7));
        if !scale.is_finite() || scale == 0.0 {
            return Err(at_byte(12, format!("a scale of {scale}"), "a number that is not 0"));
        }
        let rate = number("RATE").filter(|r| *r > 0.0).unwrap_or(float(11));
        if !(1e-6..=1e6).contains(&rate) {
            return Err(at_byte(20, format!("a frame rate of {} Hz", shown(rate)), "one from 1e-6 to 1e6"));
        }
        let start = match word(9) {
            0 => count("DATA_START").unwrap_or_default(),
            block => u64::from(block),
        };
        if start == 0 {
            return Err(at_byte(16, "0", "the block of the data, from 1"));
        }
        let data = (start - 1).saturating_mul(BLOCK as u64);
        let data = usize::try_from(data).ok().filter(|data| *data <= bytes.len());
        let data = data.ok_or_else(|| ends_early(bytes, format!("data from block {start}")))?;
        let mut header = Self { points, analog: usize::from(word(3)), frames: 0, data, scale, rate };
        let stated = stated_frames(u64::from(word(4)), u64::from(word(5)), parameters);
        header.frames = header.choose(bytes, &stated, warnings)?;
        Ok(header)
    }

    /// Bytes of a number in the data.
    pub(super) fn width(&self) -> usize {
        if self.scale < 0.0 { 4 } else { 2 }
    }

    /// Bytes of a frame.
    pub(super) fn frame_bytes(&self) -> usize {
        (4 * self.points + self.analog) * self.width()
    }

    /// The first of the stated numbers of frames for which there is data.
    fn choose(&self, bytes: &[u8], stated: &[(&str, u64)], warnings: &mut Warnings) -> Result<usize> {
        let there = (bytes.len() - self.data) / self.frame_bytes();
        let Some((place, frames)) = stated.iter().find(|(_, frames)| *frames <= there as u64) else {
            let expected = stated.first().map_or("at least one frame".into(), |(place, frames)| {
                format!("{} as {place} says, {} bytes each", counted(frames, "frame"), self.frame_bytes())
            });
            let found = format!("data for {}", counted(there, "frame"));
            return Err(at_byte(self.data as u64, found, expected));
        };
        for (other, number) in stated.iter().filter(|(_, number)| number != frames) {
            let message =
                format!("{other} says {}; the {frames} of {place} are read", counted(number, "frame"));
            warnings.add(Place::File, message);
        }
        // at most what is there, so it fits
        Ok(*frames as usize)
    }
}

/// Where the file states how many frames it has, most trusted first. The counts of 16 bits are left out where the
/// file is too long for them.
fn stated_frames(first: u64, last: u64, parameters: &Parameters<'_>) -> Vec<(&'static str, u64)> {
    const FULL: u64 = u16::MAX as u64;
    let field = |name| {
        let mut words = parameters.get("TRIAL", name)?.counts();
        Some(words.next()? + words.next().unwrap_or_default() * (FULL + 1))
    };
    let point = |name| parameters.get("POINT", name).and_then(|p| p.counts().next());
    let mut stated = Vec::new();
    if let (Some(first), Some(last)) = (field("ACTUAL_START_FIELD"), field("ACTUAL_END_FIELD")) {
        stated.push(("TRIAL:ACTUAL_END_FIELD", (last + 1).saturating_sub(first)));
    }
    stated.extend(point("LONG_FRAMES").map(|frames| ("POINT:LONG_FRAMES", frames)));
    let is_long = stated.iter().any(|(_, frames)| *frames > FULL);
    if !is_long {
        let header = ("the header", (last + 1).saturating_sub(first));
        let parameter = point("FRAMES").map(|frames| ("POINT:FRAMES", frames));
        if last == FULL {
            stated.extend(parameter);
        } else {
            stated.push(header);
            stated.extend(parameter.filter(|(_, frames)| *frames != FULL));
        }
    }
    stated.retain(|(_, frames)| *frames > 0);
    stated
}
