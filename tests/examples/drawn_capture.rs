//! Writes a drawn capture with videos: `cargo run --release -p tests --example drawn_capture -- FOLDER [SIZE] [FRAMES]`.

use std::path::Path;

use anyhow::Context;
use sample_motion::Action;
use tests::drawn_capture::DrawnCapture;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().context("usage: drawn_capture FOLDER [SIZE] [FRAMES]")?;
    let size = arguments.next().map_or(Ok(720), |text| text.parse())?;
    let frames = arguments.next().map_or(Ok(48), |text| text.parse())?;
    DrawnCapture { cameras: 6, size, frames, action: Action::Walk, seed: 3 }.write(Path::new(&folder))
}
