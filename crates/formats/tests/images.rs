//! Pictures and masks: every kind of pixel, limits, and damaged files.

use std::io::Cursor;

use formats::image_files::{self, Limits};
use image::{DynamicImage, ImageFormat};
use model::{Image, Silhouette};
use proptest::prelude::*;

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// White where x + y is at least 10, of 20 x 12 pixels.
fn mask() -> Silhouette {
    let mut mask = Silhouette::empty(20, 12);
    for (x, y) in (0..20).flat_map(|x| (0..12).map(move |y| (x, y))) {
        mask.set(x, y, x + y >= 10);
    }
    mask
}

#[test]
fn masks_of_every_kind_of_pixel_are_the_same_silhouette() {
    let limits = Limits::default();
    let grey = |x: u32, y: u32| if x + y >= 10 { 130 } else { 120 };
    let luma = image::GrayImage::from_fn(20, 12, |x, y| image::Luma([if x + y >= 10 { 255 } else { 0 }]));
    let rgb = image::RgbImage::from_fn(20, 12, |x, y| image::Rgb([grey(x, y); 3]));
    let alpha = image::RgbaImage::from_fn(20, 12, |x, y| image::Rgba([9, 9, 9, grey(x, y)]));
    let opaque = image::RgbaImage::from_fn(20, 12, |x, y| {
        let value = grey(x, y);
        image::Rgba([value, value, value, 255])
    });
    for image in [
        DynamicImage::ImageLuma8(luma),
        DynamicImage::ImageRgb8(rgb.clone()),
        DynamicImage::ImageRgba8(alpha),
        DynamicImage::ImageRgba8(opaque),
        DynamicImage::ImageRgb16(DynamicImage::ImageRgb8(rgb).into_rgb16()),
    ] {
        let read = image_files::read_silhouette(&encoded(&image, ImageFormat::Png), &limits).unwrap();
        assert_eq!(read.value, mask(), "{:?}", image.color());
        let is_black_and_white = matches!(image, DynamicImage::ImageLuma8(_));
        assert_eq!(read.warnings.is_empty(), is_black_and_white);
    }
}

#[test]
fn what_is_written_is_read_again() {
    let limits = Limits::default();
    let written = image_files::write_silhouette(&mask());
    assert_eq!(image_files::read_silhouette(&written, &limits).unwrap().value, mask());
    let rgb = (0..3 * 7 * 5).map(|value| value as u8 * 2).collect();
    let picture = Image::from_rgb(7, 5, rgb).unwrap();
    let written = image_files::write_image(&picture);
    assert_eq!(image_files::read_image(&written, &limits).unwrap(), picture);
    assert_eq!(image_files::size(&written, &limits).unwrap(), [7, 5]);
}

#[test]
fn jpegs_are_read_nearly_as_they_were() {
    let image = image::RgbImage::from_fn(64, 48, |x, y| image::Rgb([x as u8 * 3, y as u8 * 4, 100]));
    let bytes = encoded(&DynamicImage::ImageRgb8(image.clone()), ImageFormat::Jpeg);
    let read = image_files::read_image(&bytes, &Limits::default()).unwrap();
    let off = read.rgb().iter().zip(image.as_raw()).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(off < 24, "{off}");
}

#[test]
fn the_one_bit_masks_of_the_synthetic_capture_are_read() {
    let test = "the_one_bit_masks_of_the_synthetic_capture_are_read";
    let Some(folder) = testkit::shared::find("data/multiview/synthetic-8cam/silhouettes", test) else {
        return;
    };
    let bytes = testkit::shared::read(&folder, "cam0/0000.png");
    let read = image_files::read_silhouette(&bytes, &Limits::default()).unwrap();
    assert_eq!((read.value.width(), read.value.height(), read.warnings.len()), (1004, 1004, 0));
    assert!((20_000..200_000).contains(&read.value.area()), "{}", read.value.area());
}

/// A PNG whose header claims another size; the checksum is right.
fn claiming(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = image_files::write_silhouette(&mask());
    bytes[16..20].copy_from_slice(&width.to_be_bytes());
    bytes[20..24].copy_from_slice(&height.to_be_bytes());
    let mut crc = flate2::Crc::new();
    crc.update(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.sum().to_be_bytes());
    bytes
}

#[test]
fn sizes_are_bounded_before_memory_is_taken() {
    let limits = Limits::default();
    for (width, height) in [(1 << 30, 1 << 30), (16_000, 16_000), (20_000, 1)] {
        let bytes = claiming(width, height);
        assert!(image_files::read_silhouette(&bytes, &limits).is_err());
        assert!(image_files::size(&bytes, &limits).is_err());
    }
    let small = Limits { side: 100, pixels: 200 };
    let message = image_files::read_image(&claiming(20, 12), &small).unwrap_err().to_string();
    assert_eq!(
        message,
        "file: found a picture of 20 x 12 pixels, expected 1 to 100 pixels a side, 200 in all"
    );
    let message = image_files::read_image(b"GIF89a..", &limits).unwrap_err().to_string();
    assert_eq!(message, "byte 0: found \"GIF89a..\", expected the beginning of a PNG or JPEG");
}

#[test]
fn damaged_pictures_are_refused_or_read() {
    let image = image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([x as u8, y as u8 * 5, 100]));
    let image = DynamicImage::ImageRgb8(image);
    let limits = Limits { side: 1000, pixels: 1 << 18 };
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        let whole = encoded(&image, format);
        for length in 0..whole.len().min(400) {
            let _ = image_files::read_image(&whole[..length], &limits);
        }
        let changes = proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..6);
        let config = ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() };
        let mut runner = proptest::test_runner::TestRunner::new_with_rng(
            config,
            proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
        );
        let result = runner.run(&changes, |changes| {
            let mut bytes = whole.clone();
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            if let Ok(image) = image_files::read_image(&bytes, &limits) {
                prop_assert!(image.rgb().len() <= 3 << 18);
            }
            let _ = image_files::read_silhouette(&bytes, &limits);
            Ok(())
        });
        result.unwrap();
    }
}
