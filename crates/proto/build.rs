//! Compiles `proto/marey/v1/*.proto` without `protoc`, and keeps the descriptors for reflection.

use prost::Message;
use std::{error::Error, path::PathBuf};

const ROOT: &str = "../../proto";
const FILES: [&str; 7] = [
    "marey/v1/geometry.proto",
    "marey/v1/inverse_kinematics.proto",
    "marey/v1/live.proto",
    "marey/v1/motion_index.proto",
    "marey/v1/reconstruction.proto",
    "marey/v1/refinement.proto",
    "marey/v1/shape_init.proto",
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed={ROOT}");
    let descriptors = protox::compile(FILES, [ROOT])?;
    let out = PathBuf::from(std::env::var("OUT_DIR")?);
    std::fs::write(out.join("marey_descriptors.bin"), descriptors.encode_to_vec())?;
    tonic_prost_build::configure().compile_fds(descriptors)?;
    Ok(())
}
