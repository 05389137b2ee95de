//! The files that the examples speak of, drawn: recordings, a session of points, one of markers, one of cameras.

use std::{fs, path::Path, process::Command};

use anyhow::{Result, ensure};
use formats::{amc, asf, bvh, c3d, points_csv};
use model::PointTrajectories;
use nalgebra::Vector3;
use sample_motion::Action;
use tests::drawn_capture::DrawnCapture;

use crate::server::MAREY;

/// Plug-in Gait's markers of each control point, and how far beside it they are, metres.
const MARKERS: [(&str, &[&str], f64); 6] = [
    ("left_wrist", &["LWRA", "LWRB"], 0.03),
    ("right_wrist", &["RWRA", "RWRB"], 0.03),
    ("left_ankle", &["LANK", "LMED"], 0.04),
    ("right_ankle", &["RANK", "RMED"], 0.04),
    ("root", &["LASI", "RASI", "LPSI", "RPSI"], 0.12),
    ("head", &["LFHD", "RFHD", "LBHD", "RBHD", "TOP"], 0.07),
];

/// Draws all of them into a folder.
pub fn draw(folder: &Path) -> Result<()> {
    for arguments in [
        "sample --out recordings --count 12 --frames 120",
        "sample --out more --count 4 --seed 9 --frames 120",
        "sample --out take --count 1 --seed 2 --frames 120 --action walk --points 6",
        "sample-capture --out capture --frames 4",
    ] {
        let output = Command::new(MAREY).args(arguments.split(' ')).current_dir(folder).output()?;
        ensure!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }
    for entry in fs::read_dir(folder.join("take"))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        for (ending, plain) in
            [(".points.csv", "points.csv"), (".asf", "skeleton.asf"), (".amc", "truth.amc")]
        {
            if name.ends_with(ending) {
                fs::copy(&path, folder.join(plain))?;
            }
        }
    }
    let skeleton = asf::read(&fs::read(folder.join("skeleton.asf"))?)?.value;
    let motion = amc::read(&fs::read(folder.join("truth.amc"))?, &skeleton, 60.0)?.value;
    for name in ["rig.bvh", "take1.bvh", "take2.bvh"] {
        fs::write(folder.join(name), bvh::write(&motion))?;
    }
    let points = points_csv::read(&fs::read(folder.join("points.csv"))?)?.value;
    fs::write(folder.join("take3.c3d"), c3d::write(&markers(&points)?))?;
    let capture = DrawnCapture { cameras: 4, size: 288, frames: 8, action: Action::Walk, seed: 3 };
    capture.write(folder)
}

/// Copies everything of `from` into the new folder `to`.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    let output = Command::new("cp").arg("-r").args([from, to]).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// Markers around the points.
fn markers(points: &PointTrajectories) -> Result<PointTrajectories> {
    let mut names = Vec::new();
    let mut places = Vec::new();
    for (point, markers, beside) in MARKERS {
        let Some(index) = points.point_index(point) else {
            continue;
        };
        for (number, marker) in markers.iter().enumerate() {
            let turn = std::f64::consts::TAU * number as f64 / markers.len() as f64;
            names.push((*marker).to_owned());
            places.push((index, Vector3::new(turn.cos(), 0.0, turn.sin()) * beside));
        }
    }
    let frames = 0..points.num_frames();
    let positions = frames.flat_map(|frame| {
        let at = |(index, offset): &(usize, Vector3<f64>)| {
            points.position(frame, *index).map_or(Vector3::repeat(f64::NAN), |place| place + offset)
        };
        places.iter().map(at).collect::<Vec<_>>()
    });
    Ok(PointTrajectories::new(names, points.frame_rate(), positions.collect())?)
}
