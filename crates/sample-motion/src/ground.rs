//! Puts drawn channels on a skeleton and on the floor: the foot that stands, stands still.

use std::sync::Arc;

use kinematics::{HEADING, Kinematics};
use model::{Motion, Skeleton};
use nalgebra::Vector3;

use crate::features::{
    CHANNELS, CONTACT, DOFS, FORWARD, HEIGHT, Landmarks, SIDEWAYS, TILT, TURNING, parametrisation,
};
use crate::frame_rate::FRAME_RATE;
use crate::movement::Model;
use crate::signal::{smooth, smoothstep};
use crate::{Error, Result};

/// Smoothing of the height correction, frames.
const HEIGHT_SMOOTHING: f64 = 4.0;
/// Smoothing of the root's steps, frames.
const STEP_SMOOTHING: f64 = 1.0;

/// Turns channels into a motion of `skeleton` that starts above the origin with `heading` (radians).
pub(crate) fn walk_on(
    model: &Model,
    skeleton: &Arc<Skeleton>,
    rows: &[[f64; CHANNELS]],
    heading: f64,
) -> Result<Motion> {
    let landmarks = Landmarks::find(skeleton).map_err(|reason| Error::BadFile { reason })?;
    let leg_m = landmarks.leg_m(skeleton);
    let parametrisation = parametrisation(skeleton, &model.references)?;
    let kinematics = Kinematics::new(skeleton, parametrisation.clone());
    let firm = firmness(rows);

    let mut coordinates = coordinates_in_place(rows, heading, leg_m, model.ball_m);
    let mut balls = Vec::with_capacity(rows.len());
    let mut state = kinematics.state();
    for x in &coordinates {
        kinematics.update(x, &mut state);
        balls.push(landmarks.balls.map(|j| state.positions[j]));
    }
    let steps = steps(rows, &coordinates, &balls, &firm, leg_m);
    let lifts = lifts(&balls, &firm, model.ball_m);
    let mut at = Vector3::zeros();
    for ((x, step), lift) in coordinates.iter_mut().zip(&steps).zip(lifts) {
        at += step;
        x[0] = at.x;
        x[1] += lift;
        x[2] = at.z;
    }

    let mut values = Vec::with_capacity(rows.len() * DOFS);
    let mut pose = vec![0.0; DOFS];
    let mut previous: Option<Vec<f64>> = None;
    for x in &coordinates {
        parametrisation.pose_from_coordinates(skeleton, x, previous.as_deref(), &mut pose);
        values.extend(pose.iter().map(|v| (v * 1e6).round() / 1e6));
        previous = Some(pose.clone());
    }
    Ok(Motion::new(skeleton.clone(), FRAME_RATE, values)?)
}

/// How firmly each foot stands, 0 or 1 with soft steps between; the model's own values are blurred.
fn firmness(rows: &[[f64; CHANNELS]]) -> Vec<[f64; 2]> {
    rows.iter().map(|row| [0, 1].map(|side| smoothstep((row[CONTACT + side] - 0.25) / 0.4))).collect()
}

fn coordinates_in_place(rows: &[[f64; CHANNELS]], heading: f64, leg_m: f64, ball_m: f64) -> Vec<[f64; DOFS]> {
    let mut heading = heading;
    rows.iter()
        .map(|row| {
            let mut x = [0.0; DOFS];
            x[1] = row[HEIGHT] * leg_m + ball_m;
            x[HEADING] = heading;
            x[HEADING + 1..].copy_from_slice(&row[TILT..CONTACT]);
            heading += row[TURNING] / FRAME_RATE;
            x
        })
        .collect()
}

/// How the root moves over the floor from each frame to the next: so that standing feet stay where they are, and at
/// the model's own speed as far as no foot stands. Metres; shape `[frames]`, the first is 0.
fn steps(
    rows: &[[f64; CHANNELS]],
    coordinates: &[[f64; DOFS]],
    balls: &[[Vector3<f64>; 2]],
    firm: &[[f64; 2]],
    leg_m: f64,
) -> Vec<Vector3<f64>> {
    let mut steps = vec![Vector3::zeros(); rows.len()];
    for i in 1..rows.len() {
        let (sin, cos) = coordinates[i][HEADING].sin_cos();
        let (forward, sideways) =
            (rows[i][FORWARD] * leg_m / FRAME_RATE, rows[i][SIDEWAYS] * leg_m / FRAME_RATE);
        let own = Vector3::new(forward * sin + sideways * cos, 0.0, forward * cos - sideways * sin);
        let weights = [0, 1].map(|side| firm[i - 1][side].min(firm[i][side]));
        let free = (1.0 - weights[0] - weights[1]).max(0.0);
        let mut step = own * free;
        for side in 0..2 {
            step += (balls[i - 1][side] - balls[i][side]) * weights[side];
        }
        steps[i] = step / (free + weights[0] + weights[1]);
    }
    let along = |axis: usize| smooth(&steps.iter().map(|s| s[axis]).collect::<Vec<_>>(), STEP_SMOOTHING);
    let (x, z) = (along(0), along(2));
    std::iter::zip(x, z).map(|(x, z)| Vector3::new(x, 0.0, z)).collect()
}

/// Corrections of the root's height that put standing feet on the floor, smooth in time. Metres.
fn lifts(balls: &[[Vector3<f64>; 2]], firm: &[[f64; 2]], ball_m: f64) -> Vec<f64> {
    let mut weights = Vec::with_capacity(balls.len());
    let mut wanted = Vec::with_capacity(balls.len());
    for (b, f) in balls.iter().zip(firm) {
        // The lower of two standing feet decides more.
        let gap = [0, 1].map(|side| ball_m - b[side].y);
        let w = [0, 1].map(|side| f[side] * (gap[side] / 0.03).clamp(-4.0, 4.0).exp());
        let total = w[0] + w[1] + 1e-9;
        weights.push(f[0].max(f[1]));
        wanted.push((w[0] * gap[0] + w[1] * gap[1]) / total);
    }
    let weighted: Vec<f64> = weights.iter().zip(&wanted).map(|(w, v)| w * v).collect();
    // Far from any standing frame, what is wanted within half a second decides, and then what is wanted on the whole.
    let near = |signal: &[f64]| smooth(signal, HEIGHT_SMOOTHING);
    let far = |signal: &[f64]| smooth(signal, 4.0 * HEIGHT_SMOOTHING);
    let overall = weighted.iter().sum::<f64>() / weights.iter().sum::<f64>().max(1e-9);
    let sums = std::iter::zip(near(&weighted), far(&weighted));
    let totals = std::iter::zip(near(&weights), far(&weights));
    std::iter::zip(sums, totals)
        .map(|((near, far), (w_near, w_far))| {
            (near + 0.01 * far + 1e-6 * overall) / (w_near + 0.01 * w_far + 1e-6)
        })
        .collect()
}
