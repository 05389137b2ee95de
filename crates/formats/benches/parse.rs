//! How fast text is read and written; a number is given only where the recorded motion is there.

use std::path::PathBuf;

use divan::{Bencher, counter::BytesCount};
use formats::{BvhOptions, amc, asf, bvh};

fn main() {
    divan::main();
}

/// A walk of 4.6 s and its skeleton, or nothing.
fn trial() -> Option<(asf::File, Vec<u8>)> {
    let folder: PathBuf = testkit::shared::find("data/motion/five-actions", "parse")?;
    let acclaim = asf::read(&testkit::shared::read(&folder, "05.asf")).ok()?.value;
    Some((acclaim, testkit::shared::read(&folder, "05_01.amc")))
}

#[divan::bench]
fn amc_read(bencher: Bencher) {
    let Some((acclaim, bytes)) = trial() else { return };
    bencher.counter(BytesCount::new(bytes.len())).bench(|| amc::read(&bytes, &acclaim, 120.0));
}

#[divan::bench]
fn amc_write(bencher: Bencher) {
    let Some((acclaim, bytes)) = trial() else { return };
    let Ok(motion) = amc::read(&bytes, &acclaim, 120.0) else { return };
    bencher.counter(BytesCount::new(bytes.len())).bench(|| amc::write(&motion.value));
}

#[divan::bench]
fn bvh_read(bencher: Bencher) {
    let Some((acclaim, bytes)) = trial() else { return };
    let Ok(motion) = amc::read(&bytes, &acclaim, 120.0) else { return };
    let text = bvh::write(&motion.value);
    bencher.counter(BytesCount::new(text.len())).bench(|| bvh::read(text.as_bytes(), &BvhOptions::default()));
}

#[divan::bench]
fn bvh_write(bencher: Bencher) {
    let Some((acclaim, bytes)) = trial() else { return };
    let Ok(motion) = amc::read(&bytes, &acclaim, 120.0) else { return };
    let length = bvh::write(&motion.value).len();
    bencher.counter(BytesCount::new(length)).bench(|| bvh::write(&motion.value));
}
