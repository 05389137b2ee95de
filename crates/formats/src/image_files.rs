//! PNG and JPEG: pictures, and silhouettes as masks.
//!
//! Of a picture with transparency, transparent parts are black. A mask shows the person where it is at least half white, or,
//! where it has transparency, at least half opaque.

use std::io::Cursor;

use image::{
    DynamicImage, ExtendedColorType, ImageDecoder as _, ImageEncoder as _, ImageError, ImageFormat,
    ImageReader,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use model::{Image, Silhouette};

use crate::{Error, Place, Read, Result, error::at_byte, read::Warnings};

/// How large a picture may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// width and height each, pixels
    pub side: u32,
    /// width times height
    pub pixels: u64,
}

impl Default for Limits {
    /// 16,384 pixels a side and 64 megapixels.
    fn default() -> Self {
        Self { side: 1 << 14, pixels: 64 << 20 }
    }
}

/// Width and height of a PNG or JPEG, pixels, from its header alone.
///
/// # Errors
/// If it is neither, is damaged, or exceeds the limits.
pub fn size(bytes: &[u8], limits: &Limits) -> Result<[u32; 2]> {
    let size = reader(bytes, limits)?.into_dimensions().map_err(damaged)?;
    check_size(size, limits)
}

/// A picture in colour; grey becomes colour, 16 bits a channel become 8.
///
/// # Errors
/// If it is neither PNG nor JPEG, is damaged, or exceeds the limits.
pub fn read_image(bytes: &[u8], limits: &Limits) -> Result<Image> {
    let decoded = decode(bytes, limits)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let has_alpha = decoded.color().has_alpha();
    let pixels = if has_alpha {
        let over_black =
            |[r, g, b, a]: [u8; 4]| [r, g, b].map(|channel| (u16::from(channel) * u16::from(a) / 255) as u8);
        decoded.into_rgba8().pixels().flat_map(|pixel| over_black(pixel.0)).collect()
    } else {
        decoded.into_rgb8().into_raw()
    };
    Ok(Image::from_rgb(width, height, pixels)?)
}

/// A mask: the person is where it is at least half white, or at least half opaque in a picture of which some part is
/// transparent. Colours count by their luminance.
///
/// # Errors
/// If it is neither PNG nor JPEG, is damaged, or exceeds the limits.
pub fn read_silhouette(bytes: &[u8], limits: &Limits) -> Result<Read<Silhouette>> {
    let mut warnings = Warnings::default();
    let decoded = decode(bytes, limits)?;
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let values = match alpha(&decoded) {
        Some(alpha) => alpha,
        None => decoded.into_luma8().into_raw(),
    };
    let between = values.iter().filter(|&&value| (32..224).contains(&value)).count();
    // the rim of a person in smooth or compressed masks stays below this
    if between * 20 > values.len() {
        let part = 100.0 * between as f64 / values.len() as f64;
        let message = format!("{part:.0} % of the pixels are neither black nor white; is this a mask?");
        warnings.add(Place::File, message);
    }
    let silhouette = Silhouette::from_pixels(width, height, &values, |value| value >= 128)?;
    Ok(warnings.beside(silhouette))
}

/// A colour picture as PNG.
pub fn write_image(image: &Image) -> Vec<u8> {
    encode(image.rgb(), [image.width(), image.height()], ExtendedColorType::Rgb8)
}

/// A silhouette as PNG, 8 bits of grey: white is the person.
pub fn write_silhouette(silhouette: &Silhouette) -> Vec<u8> {
    let (width, height) = (silhouette.width(), silhouette.height());
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        let row = silhouette.row(y);
        pixels.extend((0..width).map(|x| if row[x / 64] >> (x % 64) & 1 == 1 { 255 } else { 0 }));
    }
    encode(&pixels, [width, height], ExtendedColorType::L8)
}

fn reader<'b>(bytes: &'b [u8], limits: &Limits) -> Result<ImageReader<Cursor<&'b [u8]>>> {
    let format = if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        ImageFormat::Png
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        ImageFormat::Jpeg
    } else {
        let found = crate::text::quote(&bytes[..bytes.len().min(8)]);
        return Err(at_byte(0, found, "the beginning of a PNG or JPEG"));
    };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut within = image::Limits::default();
    within.max_image_width = Some(limits.side);
    within.max_image_height = Some(limits.side);
    // four channels of two bytes, and the decoder's own
    within.max_alloc = Some(limits.pixels.saturating_mul(8).saturating_add(16 << 20));
    reader.limits(within);
    Ok(reader)
}

/// The pixels; memory is taken after the size in the header was checked.
fn decode(bytes: &[u8], limits: &Limits) -> Result<DynamicImage> {
    let decoder = reader(bytes, limits)?.into_decoder().map_err(damaged)?;
    check_size(decoder.dimensions(), limits)?;
    DynamicImage::from_decoder(decoder).map_err(damaged)
}

fn check_size((width, height): (u32, u32), limits: &Limits) -> Result<[u32; 2]> {
    let is_within = width.max(height) <= limits.side && u64::from(width) * u64::from(height) <= limits.pixels;
    if is_within && width > 0 && height > 0 {
        return Ok([width, height]);
    }
    let expected = format!("1 to {} pixels a side, {} in all", limits.side, limits.pixels);
    Err(Error::whole_file(format!("a picture of {width} x {height} pixels"), expected))
}

fn damaged(error: ImageError) -> Error {
    Error::Damaged { format: "picture", message: error.to_string().chars().take(200).collect() }
}

/// The opacity of the pixels, if some are transparent.
fn alpha(image: &DynamicImage) -> Option<Vec<u8>> {
    let alpha: Vec<u8> = match image {
        DynamicImage::ImageLumaA8(image) => image.pixels().map(|pixel| pixel.0[1]).collect(),
        DynamicImage::ImageRgba8(image) => image.pixels().map(|pixel| pixel.0[3]).collect(),
        DynamicImage::ImageLumaA16(image) => image.pixels().map(|pixel| (pixel.0[1] >> 8) as u8).collect(),
        DynamicImage::ImageRgba16(image) => image.pixels().map(|pixel| (pixel.0[3] >> 8) as u8).collect(),
        _ => return None,
    };
    alpha.iter().any(|&opacity| opacity < 255).then_some(alpha)
}

fn encode(pixels: &[u8], size: [usize; 2], colour: ExtendedColorType) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    // sides of pictures in memory are below 2^32, and writing to memory doesn't fail
    let written = encoder.write_image(pixels, size[0] as u32, size[1] as u32, colour);
    debug_assert!(written.is_ok(), "{written:?}");
    bytes
}
