use std::f64::consts::TAU;

use model::Motion;

use crate::features::{CHANNELS, CONTACT, TILT};
use crate::frame_rate::FRAME_RATE;
use crate::ground;
use crate::movement::{Model, Movement};
use crate::random::{Purpose, RandomStream};
use crate::segment::piecewise;
use crate::signal::{bend_into, smooth, smoothstep};
use crate::{Action, Error, Result};

/// Most frames of one drawn motion.
const MOST_FRAMES: usize = 1 << 20;
/// Share of the style's variance that a subject keeps from trial to trial.
const PERSONAL_SHARE: f64 = 0.6;
/// Styles and variations farther out than this many deviations are not drawn.
const MOST_DEVIATIONS: f64 = 2.0;
/// Styles bend back from this many deviations on.
const MOST_STYLE: f64 = 1.3;
/// Durations between marks are kept within these, seconds.
const DURATION_SECS: (f64, f64) = (0.05, 5.0);
/// Time constant of the smoothing that hides the joints between events, frames.
const EVENT_SMOOTHING: f64 = 1.2;

/// Fastest change of an angle between events, rad/s.
const FASTEST_PAUSE: f64 = 3.0;
/// Deviation of the waves that keep a standing person alive, radians.
const SWAY_RAD: f64 = 0.006;

/// How much of what is drawn, and of whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawOptions {
    /// number of frames, at 60 per second
    pub frames: usize,
    /// seed of the person: bone lengths, and what stays the same in all trials of an action
    pub subject: u64,
}

impl Default for DrawOptions {
    /// Four seconds of subject 0.
    fn default() -> Self {
        Self { frames: 240, subject: 0 }
    }
}

impl Model {
    /// Draws a trial: a motion at 60 frames per second on [`Model::skeleton`] of the subject, floor at y = 0,
    /// beginning above the origin. Synthetic: see [`crate::NOTICE`].
    ///
    /// The same model, action, seed and options give the same motion, to the bit; values are rounded to 10⁻⁶ m and
    /// rad so that this holds between platforms whose sines differ in the last bit.
    ///
    /// # Errors
    /// [`Error::ActionNotLearned`] if the model lacks the action, [`Error::TooManyFrames`].
    pub fn draw(&self, action: Action, seed: u64, options: &DrawOptions) -> Result<Motion> {
        if options.frames > MOST_FRAMES {
            return Err(Error::TooManyFrames { found: options.frames, most: MOST_FRAMES });
        }
        let movements: Vec<&Movement> = self.movements.iter().filter(|m| m.shape.action == action).collect();
        let Some(first) = movements.first() else { return Err(Error::ActionNotLearned { action }) };
        let mut random = RandomStream::new(Purpose::Trial, [action as u64, options.subject, seed]);
        let style = draw_style(first.style.len(), action, options.subject, &mut random);
        let mut rows = match first.shape.basis {
            crate::basis::Basis::Cycle { .. } => cyclic_rows(first, &style, options.frames, &mut random),
            crate::basis::Basis::Once { .. } => event_rows(&movements, &style, options.frames, &mut random),
        };
        for row in &mut rows {
            for (value, &(low, high)) in row[..CONTACT].iter_mut().zip(&first.shape.ranges) {
                *value = bend_into(*value, low, high);
            }
        }
        ground::walk_on(self, &self.skeleton(options.subject)?, &rows, random.between(-3.0, 3.0))
    }
}

/// Scores of the style components: partly the subject's own, partly this trial's. The sum is cut again: a few trials
/// do not say how far a style may go.
fn draw_style(components: usize, action: Action, subject: u64, trial: &mut RandomStream) -> Vec<f64> {
    let mut personal = RandomStream::new(Purpose::PersonalStyle, [action as u64, subject, 0]);
    (0..components)
        .map(|_| {
            let own = PERSONAL_SHARE.sqrt() * personal.normal_within(MOST_DEVIATIONS);
            let score = own + (1.0 - PERSONAL_SHARE).sqrt() * trial.normal_within(MOST_DEVIATIONS);
            bend_into(score, -MOST_STYLE, MOST_STYLE)
        })
        .collect()
}

/// Scores of the variation, from one segment to the next.
struct Wander {
    scores: Vec<f64>,
}

impl Wander {
    fn new(movement: &Movement, random: &mut RandomStream) -> Self {
        Self { scores: movement.variation.iter().map(|_| random.normal_within(MOST_DEVIATIONS)).collect() }
    }

    fn step(&mut self, movement: &Movement, random: &mut RandomStream) {
        for (score, p) in self.scores.iter_mut().zip(&movement.shape.persistence) {
            *score = p * *score + (1.0 - p * p).sqrt() * random.normal_within(MOST_DEVIATIONS);
        }
    }

    /// The numbers of a segment: mean, style and this much variation.
    fn numbers(&self, movement: &Movement, style: &[f64]) -> Vec<f64> {
        let mut numbers = vec![0.0; movement.shape.num_numbers()];
        movement.mean.add_to(&mut numbers, 1.0);
        movement.style.iter().zip(style).for_each(|(c, &z)| c.add_to(&mut numbers, z));
        movement.variation.iter().zip(&self.scores).for_each(|(c, &z)| c.add_to(&mut numbers, z));
        numbers
    }
}

fn duration_secs(log_secs: f64) -> f64 {
    log_secs.exp().clamp(DURATION_SECS.0, DURATION_SECS.1)
}

/// The channels of a segment at a phase.
fn channels_at(movement: &Movement, numbers: &[f64], values: &mut [f64], phase: f64) -> [f64; CHANNELS] {
    movement.shape.basis.values(phase, values);
    let coefficients = &numbers[movement.shape.num_durations()..];
    let mut row = [0.0; CHANNELS];
    for (channel, c) in row.iter_mut().zip(coefficients.chunks_exact(values.len())) {
        *channel = c.iter().zip(values.iter()).map(|(c, v)| c * v).sum();
    }
    row
}

/// Cycle after cycle from a random phase; the numbers move smoothly from one cycle's to the next's.
fn cyclic_rows(
    movement: &Movement,
    style: &[f64],
    frames: usize,
    random: &mut RandomStream,
) -> Vec<[f64; CHANNELS]> {
    let mut wander = Wander::new(movement, random);
    let mut current = wander.numbers(movement, style);
    wander.step(movement, random);
    let mut next = wander.numbers(movement, style);
    let mut values = vec![0.0; movement.shape.basis.len()];
    let mut phase = random.uniform();
    let mut rows = Vec::with_capacity(frames);
    for _ in 0..frames {
        let share = smoothstep(phase);
        let blended: Vec<f64> = current.iter().zip(&next).map(|(a, b)| a + share * (b - a)).collect();
        rows.push(channels_at(movement, &blended, &mut values, phase));
        phase += 1.0 / (FRAME_RATE * duration_secs(blended[0]));
        if phase >= 1.0 {
            phase -= 1.0;
            wander.step(movement, random);
            current = std::mem::replace(&mut next, wander.numbers(movement, style));
        }
    }
    rows
}

/// Event after event, with pauses in which the end of one turns into the beginning of the next.
fn event_rows(
    movements: &[&Movement],
    style: &[f64],
    frames: usize,
    random: &mut RandomStream,
) -> Vec<[f64; CHANNELS]> {
    let mut wanders: Vec<Wander> = movements.iter().map(|m| Wander::new(m, random)).collect();
    let mut rows: Vec<[f64; CHANNELS]> = Vec::with_capacity(frames);
    while rows.len() < frames {
        let index = pick(movements, random);
        let movement = movements[index];
        wanders[index].step(movement, random);
        let event = event(movement, &wanders[index].numbers(movement, style));
        let pause_secs = random.between(movement.shape.pause_secs.0, movement.shape.pause_secs.1);
        let from = rows.last().copied().unwrap_or(event[0]);
        let pause = (pause_secs.max(least_pause_secs(&from, &event[0])) * FRAME_RATE) as usize;
        for i in 0..pause {
            let share = smoothstep((i + 1) as f64 / (pause + 1) as f64);
            rows.push(std::array::from_fn(|c| from[c] + share * (event[0][c] - from[c])));
        }
        rows.extend(event);
    }
    rows.truncate(frames);
    sway(&mut rows, random);
    for channel in 0..CHANNELS {
        let smoothed = smooth(&rows.iter().map(|r| r[channel]).collect::<Vec<_>>(), EVENT_SMOOTHING);
        rows.iter_mut().zip(smoothed).for_each(|(row, v)| row[channel] = v);
    }
    rows
}

/// Seconds that it takes to get from one stance to another without haste.
fn least_pause_secs(from: &[f64; CHANNELS], to: &[f64; CHANNELS]) -> f64 {
    let farthest = (TILT..CONTACT).map(|c| (to[c] - from[c]).abs()).fold(0.0, f64::max);
    // A smooth step is at its fastest one and a half times as fast as on average.
    (1.5 * farthest / FASTEST_PAUSE).min(2.0)
}

/// Nobody stands quite still: slow waves on every angle.
fn sway(rows: &mut [[f64; CHANNELS]], random: &mut RandomStream) {
    for channel in TILT..CONTACT {
        for _ in 0..2 {
            let amplitude = SWAY_RAD * random.normal_within(MOST_DEVIATIONS);
            let (hertz, start) = (random.between(0.15, 0.7), random.between(0.0, TAU));
            for (frame, row) in rows.iter_mut().enumerate() {
                row[channel] += amplitude * (start + TAU * hertz * frame as f64 / FRAME_RATE).sin();
            }
        }
    }
}

/// The frames of one event.
fn event(movement: &Movement, numbers: &[f64]) -> Vec<[f64; CHANNELS]> {
    let mut marks_secs = vec![0.0];
    for (i, log) in numbers[..movement.shape.num_durations()].iter().enumerate() {
        marks_secs.push(marks_secs[i] + duration_secs(*log));
    }
    let total_secs = marks_secs[marks_secs.len() - 1];
    let mut values = vec![0.0; movement.shape.basis.len()];
    (0..=(total_secs * FRAME_RATE) as usize)
        .map(|i| {
            let phase = piecewise(i as f64 / FRAME_RATE, &marks_secs, &movement.shape.phases);
            channels_at(movement, numbers, &mut values, phase)
        })
        .collect()
}

/// One of the movements, each as often as its share says.
fn pick(movements: &[&Movement], random: &mut RandomStream) -> usize {
    let mut left = random.uniform() * movements.iter().map(|m| m.shape.share).sum::<f64>();
    for (i, movement) in movements.iter().enumerate() {
        left -= movement.shape.share;
        if left < 0.0 {
            return i;
        }
    }
    movements.len() - 1
}
