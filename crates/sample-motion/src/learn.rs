use std::collections::BTreeMap;

use model::Motion;

use crate::basis::Basis;
use crate::body::Body;
use crate::components::{principal, score};
use crate::features::{CHANNELS, CONTACT, FORWARD, HEIGHT, JOINTS, Landmarks, Track, mean_rotations};
use crate::movement::{Model, Movement, MovementShape, Quantised};
use crate::segment::{Segment, describe, mark_phases};
use crate::signal::quantile;
use crate::{Action, Error, Result, gait, jumps, punches};

/// Fewest segments of which a mean and a variation are learned.
const LEAST_SEGMENTS: usize = 6;
/// Most components of style and of variation; and groups per style, segments per variation component at least.
const MOST_STYLES: usize = 12;
const MOST_VARIATIONS: usize = 10;
const GROUPS_PER_STYLE: usize = 3;
const SEGMENTS_PER_VARIATION: usize = 4;
/// Segments this many times farther from their group's mean than the median are not variations of it.
const OUTLYING: f64 = 2.5;
/// Where trials hold one segment each, variation within a trial is taken to be this share of the one between them.
const STYLE_AS_VARIATION: f64 = 0.4;
/// Long boxing trials are cut into blocks of this length, each a group of its own, seconds.
const BLOCK_SECS: f64 = 10.0;

/// A recorded trial to learn from.
#[derive(Debug, Clone)]
pub struct LabelledMotion {
    /// name of the trial, for messages
    pub name: String,
    /// who moved: trials of one subject share a skeleton
    pub subject: String,
    /// what was done
    pub action: Action,
    /// the motion, at any frame rate
    pub motion: Motion,
}

/// A kind of segment and how it is found.
struct Kind {
    action: Action,
    name: &'static str,
    basis: Basis,
    pause_secs: (f64, f64),
    find: fn(&Track) -> Vec<Segment>,
}

const KINDS: [Kind; 6] = [
    Kind {
        action: Action::Walk,
        name: "walking cycle",
        basis: Basis::Cycle { harmonics: 8 },
        pause_secs: (0.0, 0.0),
        find: gait::cycles,
    },
    Kind {
        action: Action::Run,
        name: "running cycle",
        basis: Basis::Cycle { harmonics: 8 },
        pause_secs: (0.0, 0.0),
        find: gait::cycles,
    },
    Kind {
        action: Action::Jump,
        name: "jump",
        basis: Basis::Once { cosines: 32 },
        pause_secs: (0.3, 1.2),
        find: jumps::jumps,
    },
    Kind {
        action: Action::Boxing,
        name: "left punch",
        basis: Basis::Once { cosines: 16 },
        pause_secs: (0.15, 0.5),
        find: |track| punches::punches(track, 0),
    },
    Kind {
        action: Action::Boxing,
        name: "right punch",
        basis: Basis::Once { cosines: 16 },
        pause_secs: (0.15, 0.5),
        find: |track| punches::punches(track, 1),
    },
    Kind {
        action: Action::Boxing,
        name: "guard",
        basis: Basis::Once { cosines: 10 },
        pause_secs: (0.15, 0.5),
        find: punches::guards,
    },
];

/// A segment as numbers, and where it came from.
struct Observation {
    group: String,
    subject: String,
    numbers: Vec<f64>,
}

impl Model {
    /// Learns a model from recorded trials of the CMU skeleton; trials in which no cycle or event is found are passed
    /// over. The result depends on the trials and their order only.
    ///
    /// # Errors
    /// [`Error::NoMotions`] without motions, [`Error::Skeleton`] if one is not on a CMU skeleton, and
    /// [`Error::TooFewSegments`] if an action's trials hold too few cycles or events.
    pub fn learn(motions: &[LabelledMotion]) -> Result<Self> {
        let Some(first) = motions.first() else { return Err(Error::NoMotions) };
        let mut skeletons = BTreeMap::new();
        for m in motions {
            if !m.motion.skeleton().same_structure(first.motion.skeleton()) {
                let reason = format!("skeleton has not the joints and channels of that of {}", first.name);
                return Err(Error::Skeleton { motion: m.name.clone(), reason });
            }
            skeletons.entry(m.subject.clone()).or_insert_with(|| m.motion.skeleton().clone());
        }
        let body = Body::learn(&skeletons)?;
        let find = Landmarks::find(first.motion.skeleton());
        find.map_err(|reason| Error::Skeleton { motion: first.name.clone(), reason })?;
        let references = mean_rotations(&motions.iter().map(|m| &m.motion).collect::<Vec<_>>())?;
        let mut tracks = Vec::new();
        for m in motions {
            let find = Landmarks::find(m.motion.skeleton());
            let landmarks = find.map_err(|reason| Error::Skeleton { motion: m.name.clone(), reason })?;
            if m.motion.num_frames() > 1 {
                tracks.push((m, Track::new(&m.motion, &landmarks, &references)?));
            }
        }
        let floors: Vec<f64> = tracks.iter().map(|(_, t)| t.floor_m).collect();
        let mut movements = Vec::new();
        for action in Action::ALL {
            let in_action: Vec<_> = tracks.iter().filter(|(m, _)| m.action == action).collect();
            if !in_action.is_empty() {
                movements.extend(learn_action(action, &in_action)?);
            }
        }
        Ok(Self { body, references, ball_m: quantile(&floors, 0.5), motions: motions.len(), movements })
    }
}

fn learn_action(action: Action, tracks: &[&(&LabelledMotion, Track)]) -> Result<Vec<Movement>> {
    let mut parts = Vec::new();
    for kind in KINDS.iter().filter(|k| k.action == action) {
        let found: Vec<_> = tracks
            .iter()
            .flat_map(|(m, track)| (kind.find)(track).into_iter().map(move |segment| (*m, track, segment)))
            .collect();
        if found.len() < LEAST_SEGMENTS {
            return Err(Error::TooFewSegments {
                movement: kind.name.to_owned(),
                found: found.len(),
                motions: tracks.len(),
                least: LEAST_SEGMENTS,
            });
        }
        let marks = found[0].2.marks.len() - 1;
        let mut mean_durations = vec![0.0; marks];
        for (_, track, segment) in &found {
            let durations = segment.durations(track.frame_rate);
            mean_durations.iter_mut().zip(durations).for_each(|(m, d)| *m += d / found.len() as f64);
        }
        let phases = mark_phases(&mean_durations);
        let observations: Vec<_> = found
            .iter()
            .map(|(m, track, segment)| Observation {
                group: group_name(m, segment, track.frame_rate),
                subject: m.subject.clone(),
                numbers: describe(track, segment, kind.basis, &phases),
            })
            .collect();
        parts.push(Part { kind, phases, observations });
    }
    let ranges = ranges(tracks);
    Ok(assemble(&parts, &ranges))
}

/// Segments that share a style: those of a trial, or of a block of a long boxing trial.
fn group_name(motion: &LabelledMotion, segment: &Segment, frame_rate: f64) -> String {
    match motion.action {
        Action::Boxing => {
            format!("{} block {}", motion.name, (segment.marks[0] / frame_rate / BLOCK_SECS) as usize)
        }
        _ => motion.name.clone(),
    }
}

struct Part<'a> {
    kind: &'a Kind,
    phases: Vec<f64>,
    observations: Vec<Observation>,
}

impl Part<'_> {
    /// How much each number counts when components are sought.
    fn importance(&self) -> Vec<f64> {
        let mut importance = vec![1.0; self.phases.len() - 1];
        for channel in 0..CHANNELS {
            let weight = match channel {
                HEIGHT => 4.0,
                FORWARD..JOINTS if channel < 4 => 0.3,
                CONTACT.. => 0.3,
                _ => 1.0,
            };
            importance.push(weight);
            importance.extend(std::iter::repeat_n(weight * 0.5f64.sqrt(), self.kind.basis.len() - 1));
        }
        importance
    }
}

/// Means, styles and variations of the movements of one action.
fn assemble(parts: &[Part], ranges: &[(f64, f64)]) -> Vec<Movement> {
    let votes = votes(parts);
    let groups: Vec<&String> = votes.keys().collect();
    let group_votes: Vec<f64> = votes.values().copied().collect();
    let all_segments: usize = parts.iter().map(|p| p.observations.len()).sum();

    let centred: Vec<Centred> = parts.iter().map(|part| Centred::new(part, &votes)).collect();
    // Styles of all movements at once: a group's deviations side by side, 0 where it lacks a movement.
    let joint: Vec<Vec<f64>> =
        groups.iter().map(|group| centred.iter().flat_map(|c| c.deviation(group)).collect()).collect();
    let importance: Vec<f64> = parts.iter().flat_map(Part::importance).collect();
    let styles =
        principal(&joint, &group_votes, &importance, MOST_STYLES.min(groups.len() / GROUPS_PER_STYLE));

    let mut from = 0;
    std::iter::zip(parts, &centred)
        .map(|(part, centred)| {
            let to = from + centred.mean.len();
            let own: Vec<&[f64]> = styles.iter().map(|s| &s[from..to]).collect();
            from = to;
            let (mut variation, mut persistence) = centred.variation(part);
            if variation.is_empty() {
                variation = own.iter().map(|s| s.iter().map(|v| v * STYLE_AS_VARIATION).collect()).collect();
                persistence = vec![0.0; variation.len()];
            }
            Movement {
                shape: MovementShape {
                    action: part.kind.action,
                    name: part.kind.name.to_owned(),
                    basis: part.kind.basis,
                    phases: part.phases.clone(),
                    share: part.observations.len() as f64 / all_segments as f64,
                    pause_secs: part.kind.pause_secs,
                    persistence,
                    ranges: ranges.to_vec(),
                    segments: part.observations.len(),
                    groups: centred.groups.len(),
                },
                mean: Quantised::new(&centred.mean),
                style: own.into_iter().map(Quantised::new).collect(),
                variation: variation.iter().map(|v| Quantised::new(v)).collect(),
            }
        })
        .collect()
}

/// The vote of every group: a subject with many trials counts as the root of their number.
fn votes(parts: &[Part]) -> BTreeMap<String, f64> {
    let subject_of: BTreeMap<&String, &String> =
        parts.iter().flat_map(|p| &p.observations).map(|o| (&o.group, &o.subject)).collect();
    let trials = |subject: &String| subject_of.values().filter(|s| **s == subject).count() as f64;
    subject_of.iter().map(|(group, subject)| ((*group).clone(), 1.0 / trials(subject).sqrt())).collect()
}

/// The observations of one movement about their means.
struct Centred {
    mean: Vec<f64>,
    /// mean of each group
    groups: BTreeMap<String, Vec<f64>>,
}

impl Centred {
    fn new(part: &Part, votes: &BTreeMap<String, f64>) -> Self {
        let numbers = part.observations[0].numbers.len();
        let mut groups = BTreeMap::<String, (Vec<f64>, f64)>::new();
        for o in &part.observations {
            let (sum, count) = groups.entry(o.group.clone()).or_insert_with(|| (vec![0.0; numbers], 0.0));
            sum.iter_mut().zip(&o.numbers).for_each(|(s, v)| *s += v);
            *count += 1.0;
        }
        let groups: BTreeMap<String, Vec<f64>> = groups
            .into_iter()
            .map(|(group, (sum, count))| (group, sum.into_iter().map(|s| s / count).collect()))
            .collect();
        let total: f64 = groups.keys().map(|g| votes[g]).sum();
        let mut mean = vec![0.0; numbers];
        for (group, numbers) in &groups {
            mean.iter_mut().zip(numbers).for_each(|(m, v)| *m += v * votes[group] / total);
        }
        Self { mean, groups }
    }

    fn deviation(&self, group: &str) -> Vec<f64> {
        match self.groups.get(group) {
            Some(numbers) => numbers.iter().zip(&self.mean).map(|(v, m)| v - m).collect(),
            None => vec![0.0; self.mean.len()],
        }
    }

    /// Components of the variation within groups, and how much of each lasts from one segment to the next.
    fn variation(&self, part: &Part) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut sizes = BTreeMap::<&str, f64>::new();
        part.observations.iter().for_each(|o| *sizes.entry(&o.group).or_default() += 1.0);
        let (mut residuals, mut votes, mut follows) = (Vec::new(), Vec::new(), Vec::new());
        let mut previous: Option<&str> = None;
        for o in part.observations.iter().filter(|o| sizes[o.group.as_str()] > 1.0) {
            let n = sizes[o.group.as_str()];
            residuals
                .push(o.numbers.iter().zip(&self.groups[&o.group]).map(|(v, m)| v - m).collect::<Vec<_>>());
            // n residuals about their own mean know only n - 1 deviations.
            votes.push(n / (n - 1.0));
            follows.push(previous == Some(&o.group));
            previous = Some(&o.group);
        }
        let importance = part.importance();
        leave_out_outlying(&mut residuals, &mut votes, &mut follows, &importance);
        let most = MOST_VARIATIONS.min(residuals.len() / SEGMENTS_PER_VARIATION);
        let mut components = principal(&residuals, &votes, &importance, most);
        // `principal` takes votes relative to their sum: put back what the sum exceeds the count by.
        let inflation = (votes.iter().sum::<f64>() / (residuals.len() as f64).max(1.0)).sqrt();
        let steps_per_segment = match part.kind.basis {
            // Recorded cycles follow each other by half a cycle.
            Basis::Cycle { .. } => 2,
            Basis::Once { .. } => 1,
        };
        let persistence = components
            .iter()
            .map(|c| persistence(&residuals, &follows, c, &importance).powi(steps_per_segment))
            .collect();
        components.iter_mut().flatten().for_each(|v| *v *= inflation);
        (components, persistence)
    }
}

fn leave_out_outlying(
    residuals: &mut Vec<Vec<f64>>,
    votes: &mut Vec<f64>,
    follows: &mut Vec<bool>,
    importance: &[f64],
) {
    let size = |r: &Vec<f64>| r.iter().zip(importance).map(|(v, w)| (v * w).powi(2)).sum::<f64>().sqrt();
    let sizes: Vec<f64> = residuals.iter().map(size).collect();
    let most = OUTLYING * quantile(&sizes, 0.5);
    let kept: Vec<usize> = (0..sizes.len()).filter(|&i| sizes[i] <= most).collect();
    // What follows one that is left out follows nothing.
    *follows = kept.iter().map(|&i| follows[i] && sizes[i - 1] <= most).collect();
    *votes = kept.iter().map(|&i| votes[i]).collect();
    *residuals = kept.into_iter().map(|i| std::mem::take(&mut residuals[i])).collect();
}

/// Correlation of a component's scores in successive segments, 0 to 0.9.
fn persistence(residuals: &[Vec<f64>], follows: &[bool], component: &[f64], importance: &[f64]) -> f64 {
    let scores: Vec<f64> = residuals.iter().map(|r| score(r, component, importance)).collect();
    let (mut products, mut squares) = (0.0, 0.0);
    for i in (1..scores.len()).filter(|&i| follows[i]) {
        products += scores[i] * scores[i - 1];
        squares += 0.5 * (scores[i].powi(2) + scores[i - 1].powi(2));
    }
    if squares > 0.0 { (products / squares).clamp(0.0, 0.9) } else { 0.0 }
}

/// Lowest and highest value of each channel, but for a thousandth at either end.
fn ranges(tracks: &[&(&LabelledMotion, Track)]) -> Vec<(f64, f64)> {
    (0..CHANNELS)
        .map(|channel| {
            let values: Vec<f64> = tracks.iter().flat_map(|(_, t)| &t.rows).map(|row| row[channel]).collect();
            (quantile(&values, 0.001), quantile(&values, 0.999))
        })
        .collect()
}
