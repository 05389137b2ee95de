use nalgebra::Vector3;

use super::{bytes::Processor, header::Header};
use crate::{Result, error::at_byte};

/// A point in a frame, in file units.
pub(super) struct Sample {
    pub(super) position: Vector3<f64>,
    /// mean distance of the point from the rays that found it; 0 where it was not found so, but computed
    pub(super) residual: f64,
}

/// The samples of all frames, row-major, shape `[frames, points]`; `None` was not measured.
pub(super) fn read<'a>(
    bytes: &'a [u8],
    header: &'a Header,
    processor: Processor,
) -> Result<impl Iterator<Item = Option<Sample>> + 'a> {
    let width = header.width();
    let (points, frame) = (4 * header.points * width, header.frame_bytes());
    let data = header.frames.checked_mul(frame).and_then(|length| bytes[header.data..].get(..length));
    let data = data.ok_or_else(|| {
        at_byte(
            header.data as u64,
            "the end of the file",
            format!("{} frames of {frame} bytes", header.frames),
        )
    })?;
    let sample = move |bytes: &[u8]| {
        let number = |index: usize| {
            let at = index * width;
            if width == 4 {
                f64::from(processor.f32([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]))
            } else {
                f64::from(processor.i16([bytes[at], bytes[at + 1]]))
            }
        };
        let factor = if width == 4 { 1.0 } else { header.scale };
        let position = Vector3::new(number(0), number(1), number(2)) * factor;
        // the fourth number holds the cameras and the residual; negative says that there was no measurement
        let fourth = number(3);
        let is_measured = fourth >= 0.0 && position.iter().all(|v| v.is_finite());
        is_measured.then(|| Sample { position, residual: residual(fourth) * header.scale.abs() })
    };
    Ok(data.chunks_exact(frame).flat_map(move |frame| frame[..points].chunks_exact(4 * width)).map(sample))
}

/// The residual in the fourth number of a sample, in steps of the scale: its lower byte; the upper one is a mask of the
/// cameras.
fn residual(fourth: f64) -> f64 {
    f64::from(fourth.min(f64::from(i16::MAX)) as u16 & 0xff)
}
