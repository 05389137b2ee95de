//! How often a disturbed pose is found again: local optimisation alone, and several particle searches before it.
//!
//! `cargo run --release -p tracking --example recovery [STARTS] [LIMBS]` prints a table for bodies drawn by 8 cameras; LIMBS is
//! `arm`, `arms` or `leg`, all of them if it is left out. A start is a body and a
//! pose of its own, a limb or two of which are turned by 10, 20 or 40 degrees in each angle, in random directions.

#[path = "../tests/moving/mod.rs"]
mod moving;

use std::time::Instant;

use body::BodyModel;
use moving::{cameras, distances, pose, seen};
use shape_fit::limb_dofs;
use tracking::{Annealing, ObservedFrame, Options, ParticleOptions, Tracker};

/// A joint that is farther off than this was not found, metres.
const FOUND_M: f64 = 0.05;

/// Repeatable numbers in [0, 1) without a generator's state: the golden ratio's multiples, far apart for each purpose.
fn number(start: usize, purpose: usize) -> f64 {
    let mixed = (start as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (purpose as u64).wrapping_mul(0xD1B5_4A32_D192_ED03);
    let mixed = (mixed ^ mixed >> 31).wrapping_mul(0x7FB5_D329_728E_A185);
    ((mixed ^ mixed >> 27) >> 11) as f64 / (1u64 << 53) as f64
}

fn methods() -> Vec<(&'static str, Option<ParticleOptions>)> {
    let search = |particles, iterations, with_prior, annealing| {
        Some(ParticleOptions { particles, iterations, with_prior, annealing, ..ParticleOptions::default() })
    };
    vec![
        ("local only", None),
        ("25 x 10 with prior", search(25, 10, true, Annealing::Interacting)),
        ("25 x 10 without", search(25, 10, false, Annealing::Interacting)),
        ("100 x 15 without", search(100, 15, false, Annealing::Interacting)),
        ("20 x 15 without (Gall)", search(20, 15, false, Annealing::Interacting)),
        ("25 x 10 filter, prior", search(25, 10, true, Annealing::Filter)),
    ]
}

/// Wilson's interval at 95 %, percent.
fn interval(found: usize, of: usize) -> [f64; 2] {
    let (n, p, z) = (of as f64, found as f64 / of as f64, 1.96);
    let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt() / (1.0 + z * z / n);
    [100.0 * (middle - half), 100.0 * (middle + half)]
}

fn main() {
    let starts: usize = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap_or(100);
    let model = BodyModel::shipped();
    let cameras = cameras(8);
    println!("{starts} starts each; found: all joints within {:.0} mm; 95 % intervals", 1000.0 * FOUND_M);
    let wanted = std::env::args().nth(2);
    for (limbs, name) in [(&[0][..], "arm"), (&[0, 1], "arms"), (&[2], "leg")] {
        if wanted.as_ref().is_some_and(|wanted| wanted != name) {
            continue;
        }
        for degrees in [10.0f64, 20.0, 40.0] {
            let mut found = vec![0; methods().len()];
            let mut seconds = vec![0.0; methods().len()];
            for start in 0..starts {
                let alpha: Vec<f64> =
                    (0..model.num_components()).map(|i| 2.0 * number(start, i) - 1.0).collect();
                let of = |purpose, count: usize| (number(start, purpose) * count as f64) as usize;
                let truth =
                    pose(&model, 6.0 * number(start, 90), [of(91, 11), of(92, 11), of(93, 8), of(94, 8)]);
                let (views, joints) = seen(&model, &model.shape(&alpha), &truth, &cameras);
                let frame = ObservedFrame::new(start, &views).unwrap();
                let mut disturbed = truth.clone();
                for &limb in limbs {
                    for (i, dof) in limb_dofs(&model)[limb].into_iter().flatten().enumerate() {
                        let sign = if number(start, 100 + 4 * limb + i) < 0.5 { -1.0 } else { 1.0 };
                        disturbed[dof] += sign * degrees.to_radians();
                    }
                }
                model.rig().clamp(&mut disturbed);
                for (i, (_, particles)) in methods().into_iter().enumerate() {
                    let options = Options { particles, ..Options::default() };
                    let mut tracker = Tracker::new(&model, &alpha, &disturbed, options).unwrap();
                    let began = Instant::now();
                    let tracked = tracker.track(&frame, &false.into()).unwrap();
                    seconds[i] += began.elapsed().as_secs_f64();
                    found[i] += usize::from(distances(&tracked.joints, &joints).all(|off| off < FOUND_M));
                }
            }
            for ((method, _), (&found, seconds)) in methods().iter().zip(found.iter().zip(&seconds)) {
                let [low, high] = interval(found, starts);
                println!(
                    "{name:<5} {degrees:>2.0} deg  {method:<24} {:5.1} %  ({low:.0} to {high:.0})  {:.0} ms",
                    100.0 * found as f64 / starts as f64,
                    1000.0 * seconds / starts as f64
                );
            }
        }
    }
}
