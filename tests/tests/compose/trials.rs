//! Walks of a simple figure: enough of a motion to be learned and reconstructed, whatever the sample motion draws.

use anyhow::Result;
use model::Motion;
use std::{f64::consts::TAU, fmt::Write as _};

const FRAME_RATE: f64 = 60.0;

/// Joints in the order of the file, depth first: name, parent, offset (centimetres), and how far the three angles (z, x, y) swing (degrees),
/// at what part of the stride.
#[rustfmt::skip]
const FIGURE: [(&str, Option<usize>, [f64; 3], [f64; 3], f64); 16] = [
    ("Hips", None, [0.0, 0.0, 0.0], [3.0, 2.0, 6.0], 0.0),
    ("Spine", Some(0), [0.0, 12.0, 0.0], [3.0, 3.0, 8.0], 0.5),
    ("Neck", Some(1), [0.0, 35.0, 0.0], [2.0, 4.0, 3.0], 0.1),
    ("Head", Some(2), [0.0, 12.0, 0.0], [2.0, 3.0, 2.0], 0.2),
    ("LeftArm", Some(1), [18.0, 30.0, 0.0], [8.0, 30.0, 5.0], 0.5),
    ("LeftForeArm", Some(4), [3.0, -28.0, 0.0], [2.0, 18.0, 3.0], 0.55),
    ("LeftHand", Some(5), [0.0, -25.0, 0.0], [4.0, 6.0, 2.0], 0.6),
    ("RightArm", Some(1), [-18.0, 30.0, 0.0], [8.0, 30.0, 5.0], 0.0),
    ("RightForeArm", Some(7), [-3.0, -28.0, 0.0], [2.0, 18.0, 3.0], 0.05),
    ("RightHand", Some(8), [0.0, -25.0, 0.0], [4.0, 6.0, 2.0], 0.1),
    ("LeftUpLeg", Some(0), [9.0, -5.0, 0.0], [4.0, 28.0, 3.0], 0.0),
    ("LeftLeg", Some(10), [0.0, -42.0, 0.0], [0.0, 25.0, 0.0], 0.2),
    ("LeftFoot", Some(11), [0.0, -40.0, 0.0], [3.0, 14.0, 2.0], 0.3),
    ("RightUpLeg", Some(0), [-9.0, -5.0, 0.0], [4.0, 28.0, 3.0], 0.5),
    ("RightLeg", Some(13), [0.0, -42.0, 0.0], [0.0, 25.0, 0.0], 0.7),
    ("RightFoot", Some(14), [0.0, -40.0, 0.0], [3.0, 14.0, 2.0], 0.8),
];

/// A walk of `frames` frames at 60 a second; another seed walks at another pace, width and mood.
pub fn draw(seed: u32, frames: usize) -> Result<Motion> {
    let mut bvh = String::from("HIERARCHY\n");
    write_joint(&mut bvh, 0)?;
    write!(bvh, "MOTION\nFrames: {frames}\nFrame Time: {}\n", 1.0 / FRAME_RATE)?;
    let style = Style::of(seed);
    for frame in 0..frames {
        style.write_frame(&mut bvh, frame as f64 / FRAME_RATE)?;
    }
    Ok(formats::bvh::read(bvh.as_bytes(), &formats::bvh::Options::default())?.value)
}

fn write_joint(bvh: &mut String, index: usize) -> Result<()> {
    let (name, parent, [x, y, z], ..) = FIGURE[index];
    let (word, channels) = match parent {
        None => ("ROOT", "6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"),
        Some(_) => ("JOINT", "3 Zrotation Xrotation Yrotation"),
    };
    write!(bvh, "{word} {name}\n{{\nOFFSET {x} {y} {z}\nCHANNELS {channels}\n")?;
    let children: Vec<_> = (0..FIGURE.len()).filter(|&child| FIGURE[child].1 == Some(index)).collect();
    if children.is_empty() {
        bvh.push_str("End Site\n{\nOFFSET 0 5 8\n}\n");
    }
    for child in children {
        write_joint(bvh, child)?;
    }
    bvh.push_str("}\n");
    Ok(())
}

/// What makes one walk another than the next.
struct Style {
    strides_per_second: f64,
    swing: f64,
    /// share of the second harmonic
    bounce: f64,
    lean_deg: f64,
    turn_deg_per_second: f64,
}

impl Style {
    fn of(seed: u32) -> Self {
        // multiples of the golden ratio spread evenly
        let spread = |salt: u32| (f64::from(seed * 7 + salt) * 0.618_033_988_749_895).fract();
        Self {
            strides_per_second: 0.8 + 0.4 * spread(1),
            swing: 0.8 + 0.4 * spread(2),
            bounce: 0.3 * spread(3),
            lean_deg: 6.0 * spread(4),
            turn_deg_per_second: 20.0 * (spread(5) - 0.5),
        }
    }

    fn write_frame(&self, bvh: &mut String, time_secs: f64) -> Result<()> {
        let stride = time_secs * self.strides_per_second;
        let heading = self.turn_deg_per_second * time_secs;
        let (x, y, z) =
            (15.0 * (TAU * stride / 9.0).sin(), 90.0 + 3.0 * (2.0 * TAU * stride).cos(), 20.0 * stride);
        write!(bvh, "{x} {y} {z}")?;
        for (index, (_, _, _, swings_deg, at)) in FIGURE.iter().enumerate() {
            for (axis, swing_deg) in swings_deg.iter().enumerate() {
                let phase = TAU * (stride + at) + axis as f64;
                let wave = phase.sin() + self.bounce * (2.0 * phase).sin();
                let steady = match (index, axis) {
                    (0, 1) => self.lean_deg,
                    (0, 2) => heading,
                    _ => 0.0,
                };
                write!(bvh, " {}", steady + self.swing * swing_deg * wave)?;
            }
        }
        bvh.push('\n');
        Ok(())
    }
}
