//! Learns the sample-motion model from a folder of recorded CMU trials:
//!
//!     cargo run --release -p sample-motion --example learn -- DIR OUT
//!
//! DIR holds ASF and AMC files (also `.zst`) and an `index.csv` with at least the columns `file` (or `trial`) and
//! `action`; trials of other actions are passed over. The same files give the same model.

use std::path::Path;
use std::{env, fs};

use anyhow::{Context, Result, bail};
use formats::archive::{self, Limits};
use formats::motion_files;
use sample_motion::{CREDIT, LabelledMotion, Model};

fn main() -> Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [folder, out] = &arguments[..] else { bail!("usage: learn DIR OUT") };
    let motions = read_folder(Path::new(folder))?;
    println!("{} trials of {folder}", motions.len());
    let model = Model::learn(&motions)?;
    for s in model.summary() {
        println!(
            "{:8} {:14} {:4} segments of {:3} trials or blocks, {:2} styles and {:2} variations of {} numbers",
            s.action.name(),
            s.name,
            s.segments,
            s.groups,
            s.style_components,
            s.variation_components,
            s.numbers,
        );
    }
    let bytes = model.to_bytes();
    println!("{} bytes to {out}\n{CREDIT}", bytes.len());
    fs::write(out, bytes).with_context(|| format!("{out} cannot be written"))
}

fn read_folder(folder: &Path) -> Result<Vec<LabelledMotion>> {
    let mut entries = Vec::new();
    let files = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut paths = files.map(|f| Ok(f?.path())).collect::<Result<Vec<_>>>()?;
    paths.sort();
    for path in paths.iter().filter(|p| p.is_file()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let bytes = fs::read(path).with_context(|| format!("{} cannot be read", path.display()))?;
        entries.extend(archive::entries(&name, &bytes, &Limits::default())?);
    }
    let clips = motion_files::clips(&entries, &motion_files::Options::default())?;
    for warning in &clips.warnings {
        eprintln!("warning: {warning}");
    }
    let labelled = clips.value.into_iter().filter_map(|clip| {
        let action = clip.action.parse().ok()?;
        Some(LabelledMotion { name: clip.name, subject: clip.subject, action, motion: clip.motion })
    });
    Ok(labelled.collect())
}
