//! Draws one trial from the bundled model (or another) and writes it as BVH:
//!
//!     cargo run --release -p sample-motion --example draw -- walk 7 out.bvh [SUBJECT] [FRAMES] [MODEL]
//!
//! What comes out is synthetic.

use std::{env, fs};

use anyhow::{Context, Result, bail};
use sample_motion::{Action, DrawOptions, Model, NOTICE};

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [action, seed, out, rest @ ..] = &arguments[..] else {
        bail!("usage: draw walk|run|jump|boxing SEED OUT.bvh [SUBJECT] [FRAMES] [MODEL]")
    };
    let action: Action = action.parse()?;
    let number = |i: usize, default: u64| rest.get(i).map_or(Ok(default), |n| n.parse::<u64>());
    let options = DrawOptions { subject: number(0, 0)?, frames: number(1, 240)? as usize };
    let model = match rest.get(2) {
        Some(path) => Model::from_bytes(&fs::read(path).with_context(|| format!("{path} cannot be read"))?)?,
        None => Model::bundled().clone(),
    };
    let motion = model.draw(action, seed.parse()?, &options)?;
    let text =
        if out.ends_with(".amc") { formats::amc::write(&motion) } else { formats::bvh::write(&motion) };
    fs::write(out, text).with_context(|| format!("{out} cannot be written"))?;
    if let Some(stem) = out.strip_suffix(".amc") {
        fs::write(format!("{stem}.asf"), formats::asf::write(motion.skeleton()))?;
    }
    println!("{} frames to {out}: {NOTICE}", motion.num_frames());
    Ok(())
}
