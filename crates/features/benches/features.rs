//! Features of a person of 400 × 800 pixels in a picture of 1004 × 1004, and of a person as high as a frame of 1920 × 1080.

#[path = "../tests/textured/mod.rs"]
mod textured;

use divan::Bencher;
use features::{Detector, FrameMatcher, Options, match_features};
use model::{Image, Silhouette};
use textured::{Change, NONE, picture};

fn main() {
    divan::main();
}

/// A picture with an ellipse of 400 × 800 (the picture's larger) pixels of texture.
fn person(size: [usize; 2], person: [usize; 2], shift: f64) -> (Image, Silhouette) {
    let part = person.map(|side| side * 5 / 4);
    let (small, inside) = picture(part, Change { shift: [shift, 0.3 * shift].into(), ..NONE }, 1);
    let (mut image, mut silhouette) = (Image::black(size[0], size[1]), Silhouette::empty(size[0], size[1]));
    for y in 0..part[1].min(size[1]) {
        for x in 0..part[0].min(size[0]) {
            image.set(x, y, small.pixel(x, y));
            silhouette.set(x, y, inside.contains(x as isize, y as isize));
        }
    }
    (image, silhouette)
}

#[divan::bench]
fn detect_400_of_400_x_800(bencher: Bencher) {
    let (image, inside) = person([1004, 1004], [400, 800], 0.0);
    let mut detector = Detector::default();
    bencher.bench_local(|| detector.detect(&image, &inside, &Options::default()));
}

#[divan::bench]
fn match_400_with_400(bencher: Bencher) {
    let options = Options::default();
    let seen = |shift: f64| {
        let (image, inside) = person([1004, 1004], [400, 800], shift);
        Detector::default().detect(&image, &inside, &options)
    };
    let (before, now) = (seen(0.0), seen(9.0));
    bencher.bench_local(|| match_features(&before, &now, &options));
}

#[divan::bench]
fn a_frame_of_1920_x_1080(bencher: Bencher) {
    let frames = [0.0, 9.0].map(|shift| person([1920, 1080], [500, 1000], shift));
    let mut matcher = FrameMatcher::new(Options::default());
    let mut index = 0;
    bencher.bench_local(|| {
        index += 1;
        matcher.push(&frames[index % 2].0, &frames[index % 2].1)
    });
}
