//! Learns the model that comes with Marey from the registered scans of a folder like the shared data's `bodies`:
//! `cargo run --release -p body --example learn_shipped -- FOLDER crates/body/assets/shipped.marey-body`

#[path = "../tests/scans/mod.rs"]
mod scans;

use std::{env, fs, path::Path};

use body::{LearnOptions, learn};
use scans::Scans;

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [bodies, out] = &arguments[..] else { panic!("expected a folder of scans and a file to write") };
    let data = Scans::read(Path::new(bodies));
    let description =
        "114 synthetic bodies made with MakeHuman/MPFB2 assets, CC0 1.0; nobody's body".to_owned();
    let options = LearnOptions { description, ..LearnOptions::default() };
    let learned = learn(&data.base(), &data.template, &options).expect("scans that can be learned from");
    println!("variance kept: {:.4?}", learned.variance_kept);
    let bytes = learned.model.to_bytes();
    println!("{} bytes", bytes.len());
    fs::write(out, bytes).expect("a file that can be written");
}
