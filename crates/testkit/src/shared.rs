//! Finds the recorded motion that tests read. It is not ours to ship, so a user's machine has none: there a test
//! says that it is skipped; with `CI=true` its absence is a failure.
//!
//! The folder is `MAREY_SHARED`, by default `shared` beside the repository.

use std::{
    env, fs,
    io::Read as _,
    path::{Path, PathBuf},
};

/// The file or folder `path` of the shared data, for the test of that name; `None` where there is none.
///
/// # Panics
/// If it is not there and `CI` is `true`.
pub fn find(path: &str, test: &str) -> Option<PathBuf> {
    let root = env::var_os("MAREY_SHARED").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        |folder| workspace().join(folder),
    );
    let found = root.join(path);
    if found.exists() {
        return Some(found);
    }
    let is_ci = env::var("CI").is_ok_and(|v| v == "true" || v == "1");
    assert!(!is_ci, "{test}: no shared data at {}", found.display());
    println!("skipped: {test}: no shared data");
    None
}

/// Root of the repository; a relative `MAREY_SHARED` starts here.
fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A file of the folder as it was before compression: `16.asf` is read from `16.asf` or `16.asf.zst`.
///
/// # Panics
/// If there is no such file or it is damaged.
pub fn read(folder: &Path, name: &str) -> Vec<u8> {
    let plain = folder.join(name);
    let path =
        if plain.exists() { plain } else { folder.join(format!("{}.zst", name.trim_end_matches(".zst"))) };
    let bytes = fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    if path.extension().is_some_and(|e| e == "zst") { unpack(&bytes, &path) } else { bytes }
}

fn unpack(bytes: &[u8], path: &Path) -> Vec<u8> {
    let mut decoder =
        ruzstd::decoding::StreamingDecoder::new(bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut unpacked = Vec::new();
    decoder.read_to_end(&mut unpacked).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    unpacked
}

/// One row of `index.csv` of a folder of motion: the text of a column by its name.
#[derive(Debug, Clone)]
pub struct IndexRow(Vec<(String, String)>);

impl IndexRow {
    /// Text of a column, empty where the index has no such column.
    pub fn get(&self, column: &str) -> &str {
        self.0.iter().find(|(name, _)| name == column).map_or("", |(_, text)| text)
    }
}

/// The rows of `index.csv` of a folder of motion.
///
/// # Panics
/// If there is no index.
pub fn index(folder: &Path) -> Vec<IndexRow> {
    let text = String::from_utf8(read(folder, "index.csv")).unwrap_or_else(|e| panic!("index.csv: {e}"));
    let mut lines = text.lines();
    let columns: Vec<_> = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
    lines
        .map(|line| {
            let cells = line.splitn(columns.len(), ',').map(str::to_owned);
            IndexRow(columns.iter().cloned().zip(cells).collect())
        })
        .collect()
}

/// A trial of a folder of CMU's recordings, such as `16_15`, on the skeleton of its performer; 120 frames a second.
///
/// # Panics
/// If there is no such trial.
#[cfg(feature = "motion")]
pub fn trial(folder: &Path, name: &str) -> model::Motion {
    let performer = name.split('_').next().unwrap_or_default();
    let skeleton = formats::asf::read(&read(folder, &format!("{performer}.asf"))).unwrap().value;
    formats::amc::read(&read(folder, &format!("{name}.amc")), &skeleton, 120.0).unwrap().value
}
