//! One frame of 1004 × 1004 pixels: each model's classes, the cleaning, and all with the quality figure.

use background::{BackgroundModel, Classes, Cleaner, ModelKind, Parameters, Segmenter};
use divan::Bencher;
use model::{Image, Silhouette};

fn main() {
    divan::main();
}

const SIDE: usize = 1004;

/// A person as large as usual, with noise.
fn frame(number: usize) -> Image {
    let mut image = Image::black(SIDE, SIDE);
    let mut state = number as u32 + 1;
    let centre = 150 + 60 * number;
    for y in 0..SIDE {
        for x in 0..SIDE {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = (state >> 29) as u8;
            let is_person = x.abs_diff(centre) < 70 && (200..850).contains(&y);
            let colour =
                if is_person { [170, 60, 50] } else { [110 + (x / 50) as u8, 120, 100 + (y / 60) as u8] };
            image.set(x, y, colour.map(|value: u8| value + noise));
        }
    }
    image
}

fn learned(kind: ModelKind) -> (Segmenter, Image) {
    let frames: Vec<_> = (0..12).map(frame).collect();
    let plate = (kind == ModelKind::Plate).then(|| frame(100));
    let parameters = Parameters { model: kind, ..Parameters::default() };
    let segmenter = Segmenter::learn(&parameters, plate.as_ref(), &frames).expect("frames of one size");
    (segmenter, frames.into_iter().nth(5).expect("there are twelve"))
}

fn model(kind: ModelKind) -> (BackgroundModel, Image) {
    let (segmenter, frame) = learned(kind);
    (segmenter.model().clone(), frame)
}

#[divan::bench(args = [ModelKind::Plate, ModelKind::Adaptive, ModelKind::Mixture])]
fn classify(bencher: Bencher, kind: ModelKind) {
    let (mut model, frame) = model(kind);
    let mut classes = Classes::new(SIDE, SIDE);
    bencher.bench_local(|| model.classify(&frame, &mut classes));
}

#[divan::bench]
fn clean(bencher: Bencher) {
    let (mut model, frame) = model(ModelKind::Adaptive);
    let mut classes = Classes::new(SIDE, SIDE);
    model.classify(&frame, &mut classes);
    let mut cleaner = Cleaner::new(&Parameters::default().cleaning, SIDE, SIDE);
    let mut person = Silhouette::empty(SIDE, SIDE);
    bencher.bench_local(|| cleaner.clean(&classes, &mut person));
}

#[divan::bench(args = [ModelKind::Plate, ModelKind::Adaptive, ModelKind::Mixture])]
fn segment(bencher: Bencher, kind: ModelKind) {
    let (mut segmenter, frame) = learned(kind);
    bencher.bench_local(|| segmenter.segment(&frame).map(|(_, quality)| quality));
}

#[divan::bench(args = [ModelKind::Plate, ModelKind::Adaptive, ModelKind::Mixture], sample_count = 3)]
fn learn(bencher: Bencher, kind: ModelKind) {
    let frames: Vec<_> = (0..24).map(|number| frame(number % 12)).collect();
    let plate = (kind == ModelKind::Plate).then(|| frame(100));
    let parameters = Parameters { model: kind, ..Parameters::default() };
    bencher.bench_local(|| Segmenter::learn(&parameters, plate.as_ref(), &frames).map(|_| ()));
}
