//! Trials of a walking skeleton, drawn from formulas: small, different by seed, the same every time.

use std::fmt::Write;

/// Frames per second of the trials' AMC files.
pub const FRAME_RATE: usize = 120;

/// Bones of the skeleton: name, parent, direction, length (inches), and how far it swings about x (degrees).
const BONES: [(&str, &str, [f64; 3], f64, f64); 13] = [
    ("lfemur", "root", [0.3, -0.95, 0.0], 7.0, 25.0),
    ("ltibia", "lfemur", [0.3, -0.95, 0.0], 7.0, 30.0),
    ("lfoot", "ltibia", [0.0, -0.3, 0.95], 2.5, 15.0),
    ("rfemur", "root", [-0.3, -0.95, 0.0], 7.0, -25.0),
    ("rtibia", "rfemur", [-0.3, -0.95, 0.0], 7.0, -30.0),
    ("rfoot", "rtibia", [0.0, -0.3, 0.95], 2.5, -15.0),
    ("thorax", "root", [0.0, 1.0, 0.0], 9.0, 5.0),
    ("head", "thorax", [0.0, 1.0, 0.0], 3.5, 4.0),
    ("lhumerus", "thorax", [1.0, 0.0, 0.0], 5.0, -20.0),
    ("lhand", "lhumerus", [1.0, 0.0, 0.0], 4.0, -12.0),
    ("rhumerus", "thorax", [-1.0, 0.0, 0.0], 5.0, 20.0),
    ("rhand", "rhumerus", [-1.0, 0.0, 0.0], 4.0, 12.0),
    ("neck", "thorax", [0.0, 1.0, 0.1], 0.5, 2.0),
];

/// The skeleton, as ASF.
pub fn skeleton() -> String {
    let mut asf = String::from(
        "# made by formulas\n:version 1.10\n:name walker\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n\
         :documentation\n  synthetic\n:root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  \
         orientation 0 0 0\n:bonedata\n",
    );
    for (i, (name, _, direction, length, _)) in BONES.iter().enumerate() {
        let [x, y, z] = direction;
        let _ = write!(
            asf,
            "  begin\n    id {}\n    name {name}\n    direction {x} {y} {z}\n    length {length}\n    \
             axis 0 0 0 XYZ\n    dof rx ry rz\n    limits (-180 180)\n           (-180 180)\n           \
             (-180 180)\n  end\n",
            i + 1
        );
    }
    asf.push_str(":hierarchy\n  begin\n");
    let parents: Vec<&str> = std::iter::once("root").chain(BONES.iter().map(|b| b.0)).collect();
    for parent in parents {
        let children: Vec<&str> = BONES.iter().filter(|b| b.1 == parent).map(|b| b.0).collect();
        if !children.is_empty() {
            let _ = writeln!(asf, "    {parent} {}", children.join(" "));
        }
    }
    asf.push_str("  end\n");
    asf
}

/// A trial of so many frames, as AMC.
pub fn motion(seed: u32, frames: usize) -> String {
    let vary = |k: u32| f64::from(seed.wrapping_mul(2_654_435_761).rotate_left(k * 5) % 1000) / 1000.0 - 0.5;
    let cadence = 2.0 * std::f64::consts::PI * (0.9 + 0.15 * vary(1));
    let speed = 6.0 * (1.0 + 0.3 * vary(2));
    let mut amc = String::from(":FULLY-SPECIFIED\n:DEGREES\n");
    for frame in 0..frames {
        let t = frame as f64 / FRAME_RATE as f64;
        let phase = cadence * t + 6.0 * vary(3);
        let _ = writeln!(amc, "{}", frame + 1);
        let (height, sway) = (17.0 + 0.3 * (2.0 * phase).sin(), 2.0 * phase.sin());
        let _ = writeln!(amc, "root {:.6} {height:.6} {:.6} 0 {sway:.6} 0", 0.3 * phase.sin(), speed * t);
        for (i, (name, .., swing)) in BONES.iter().enumerate() {
            let own = 1.0 + 0.2 * vary(i as u32 + 4);
            let x = swing * own * (phase + 0.1 * i as f64).sin();
            let y = 4.0 * own * (phase + 0.7 * i as f64).cos();
            let z = 3.0 * own * (2.0 * phase + i as f64).sin();
            let _ = writeln!(amc, "{name} {x:.6} {y:.6} {z:.6}");
        }
    }
    amc
}
