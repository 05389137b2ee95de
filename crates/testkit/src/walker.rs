//! A person made of sines who walks: an Acclaim skeleton with CMU's names, and trials of any length that differ by
//! number. Small enough to be indexed in a moment; nothing about it is meant to look natural.

use std::fmt::Write as _;

/// The skeleton file.
pub const ASF: &str = "\
:version 1.10
:name walker
:units
  mass 1.0
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1\n    name lfemur\n    direction 0.25 -0.968 0\n    length 7.5\n    axis 0 0 20 XYZ\n    dof rx ry rz
    limits (-160 20)\n    (-70 70)\n    (-60 70)
  end
  begin
    id 2\n    name ltibia\n    direction 0.25 -0.968 0\n    length 7.2\n    axis 0 0 20 XYZ\n    dof rx\n    limits (-10 170)
  end
  begin
    id 3\n    name lfoot\n    direction 0 -0.2 0.98\n    length 2.2\n    axis 0 0 0 XYZ\n    dof rx rz\n    limits (-45 90)\n    (-70 20)
  end
  begin
    id 4\n    name rfemur\n    direction -0.25 -0.968 0\n    length 7.5\n    axis 0 0 -20 XYZ\n    dof rx ry rz
    limits (-160 20)\n    (-70 70)\n    (-70 60)
  end
  begin
    id 5\n    name rtibia\n    direction -0.25 -0.968 0\n    length 7.2\n    axis 0 0 -20 XYZ\n    dof rx\n    limits (-10 170)
  end
  begin
    id 6\n    name rfoot\n    direction 0 -0.2 0.98\n    length 2.2\n    axis 0 0 0 XYZ\n    dof rx rz\n    limits (-45 90)\n    (-20 70)
  end
  begin
    id 7\n    name thorax\n    direction 0 1 0\n    length 6\n    axis 0 0 0 XYZ\n    dof rx ry rz
    limits (-20 45)\n    (-30 30)\n    (-30 30)
  end
  begin
    id 8\n    name head\n    direction 0 1 0\n    length 3\n    axis 0 0 0 XYZ\n    dof rx ry\n    limits (-37 22)\n    (-45 45)
  end
  begin
    id 9\n    name lhumerus\n    direction 1 0 0\n    length 5\n    axis 180 30 90 XYZ\n    dof rx ry rz
    limits (-60 90)\n    (-90 90)\n    (-90 90)
  end
  begin
    id 10\n    name lhand\n    direction 1 0 0\n    length 4\n    axis 180 -30 90 XYZ\n    dof rx\n    limits (-10 170)
  end
  begin
    id 11\n    name rhumerus\n    direction -1 0 0\n    length 5\n    axis 180 -30 -90 XYZ\n    dof rx ry rz
    limits (-90 60)\n    (-90 90)\n    (-90 90)
  end
  begin
    id 12\n    name rhand\n    direction -1 0 0\n    length 4\n    axis 180 30 -90 XYZ\n    dof rx\n    limits (-10 170)
  end
:hierarchy
  begin
    root lfemur rfemur thorax
    lfemur ltibia
    ltibia lfoot
    rfemur rtibia
    rtibia rfoot
    thorax head lhumerus rhumerus
    lhumerus lhand
    rhumerus rhand
  end
";

/// Trial `number` at 120 frames a second.
pub fn amc(number: usize, frames: usize) -> String {
    let mut out = String::from(":FULLY-SPECIFIED\n:DEGREES\n");
    let pace = 1.0 + 0.06 * (number % 5) as f64;
    let swing = 28.0 + 2.5 * (number % 4) as f64;
    for frame in 0..frames {
        let seconds = frame as f64 / 120.0;
        let (s, c) = (std::f64::consts::TAU * pace * seconds + 0.7 * number as f64).sin_cos();
        let heading = 25.0 * (0.3 * seconds + number as f64).sin();
        let _ = writeln!(out, "{}", frame + 1);
        let _ = writeln!(
            out,
            "root {:.5} {:.5} {:.5} 2 {heading:.5} {:.5}",
            3.0 * c,
            14.6 + 0.4 * s * c,
            20.0 * seconds,
            2.0 * s
        );
        let _ = writeln!(
            out,
            "lfemur {:.5} {:.5} 3\nltibia {:.5}\nlfoot {:.5} 2",
            -swing * s,
            4.0 * c,
            25.0 + 22.0 * c,
            8.0 * s
        );
        let _ = writeln!(
            out,
            "rfemur {:.5} {:.5} -3\nrtibia {:.5}\nrfoot {:.5} -2",
            swing * s,
            -4.0 * c,
            25.0 - 22.0 * c,
            -8.0 * s
        );
        let _ = writeln!(out, "thorax 4 {:.5} {:.5}\nhead {:.5} {:.5}", 8.0 * s, 3.0 * c, 5.0 * c, -8.0 * s);
        let _ = writeln!(
            out,
            "lhumerus {:.5} 12 {:.5}\nlhand {:.5}",
            swing * s,
            -60.0 + 6.0 * c,
            35.0 + 15.0 * s
        );
        let _ = writeln!(
            out,
            "rhumerus {:.5} -12 {:.5}\nrhand {:.5}",
            -swing * s,
            60.0 + 6.0 * c,
            35.0 - 15.0 * s
        );
    }
    out
}

/// Trial `number` as a motion.
pub fn motion(number: usize, frames: usize) -> model::Motion {
    let skeleton = formats::asf::read(ASF.as_bytes()).unwrap().value;
    formats::amc::read(amc(number, frames).as_bytes(), &skeleton, 120.0).unwrap().value
}
