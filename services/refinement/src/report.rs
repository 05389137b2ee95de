//! What `run.json` says of a person who was followed, and what an animator should know of it.

use body::Limb;
use jobs::{
    JobReport,
    multi_view::{CameraReport, TrackingSession, timings},
    run_json::{Origin, RunReport},
};
use queue::JobError;
use results::ResultFile;
use serde_json::{Value, json};
use tracking::{Stage, Tracked};

use crate::finished::{Finished, Meeting};

/// Share of frames with a misaligned limb from which on a user had better look.
const MANY: f64 = 0.05;
/// Mean overlap below which something is wrong with what was uploaded.
const LOW_OVERLAP: f64 = 0.85;
/// A camera whose overlap is so much below that of the others is named.
const WORSE: f64 = 0.08;
/// Runs of frames that a message lists.
const LISTED: usize = 5;

/// The figures.
fn found(finished: &Finished) -> Value {
    let frames = &finished.tracked.frames;
    let count = |stage: Stage| frames.iter().filter(|tracked| tracked.stage == stage).count();
    let stages = [Stage::Local, Stage::Particles, Stage::Misaligned, Stage::Unseen];
    let stages: serde_json::Map<String, Value> =
        stages.map(|stage| (stage.name().to_owned(), count(stage).into())).into_iter().collect();
    let cameras = finished.cameras.iter().zip(overlaps(finished));
    let cameras: serde_json::Map<String, Value> =
        cameras.map(|(camera, overlap)| (camera.clone(), json!(overlap))).collect();
    let seams = finished.meetings.iter().map(|Meeting { seam, .. }| {
        json!({ "frame": seam.frame, "apart_m": seam.apart_m, "is_smooth": seam.is_smooth })
    });
    json!({
        "overlap": mean(frames.iter().filter(|t| t.stage != Stage::Unseen).map(Tracked::mean_iou)),
        "overlap_by_camera": cameras,
        "frames_by_stage": stages,
        "seams": seams.collect::<Vec<_>>(),
    })
}

/// `run.json`.
///
/// # Errors
/// To be tried again if it is no JSON.
pub(crate) fn run_json(
    origin: Origin,
    session: &TrackingSession,
    finished: &Finished,
    chunks: &[JobReport],
    merge: &JobReport,
) -> Result<ResultFile, JobError> {
    let warnings = [&session.warnings[..], &doubts(finished)].concat();
    let timings = timings(Some(&session.plan), &session.cameras)
        .one("fit_shape", &session.fit_shape)
        .all("chunks", chunks)
        .one("merge", merge)
        .speed(chunks);
    let own = json!({
        "cameras": session.cameras.iter().map(CameraReport::summary).collect::<Vec<_>>(),
        "tracking": found(finished),
    });
    let frames = Some((finished.tracked.frames.len(), finished.frame_rate));
    let report = RunReport { origin, warnings: &warnings, timings, frames, points: None };
    results::run_json(&report, &session.request, own)
}

/// Mean overlap of every camera, where it sees somebody.
fn overlaps(finished: &Finished) -> Vec<Option<f64>> {
    let overlap = |camera: usize| {
        let frames = finished.tracked.frames.iter();
        mean(frames.filter_map(|tracked| tracked.ious.get(camera).copied().flatten()))
    };
    (0..finished.cameras.len()).map(overlap).collect()
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

/// What is doubtful about the result, in words that say what to do.
fn doubts(finished: &Finished) -> Vec<String> {
    let frames = &finished.tracked.frames;
    let mut doubts = Vec::new();
    let unseen = numbers(frames, |tracked| tracked.stage == Stage::Unseen);
    if !unseen.is_empty() {
        doubts.push(format!(
            "nobody was found in {} of {} frames ({}): there the last pose is kept, and joints.* have no positions. Is \
             the person in view of at least two cameras there?",
            unseen.len(),
            frames.len(),
            ranges(&unseen)
        ));
    }
    let misaligned = numbers(frames, |tracked| tracked.stage == Stage::Misaligned);
    if misaligned.len() as f64 > MANY * frames.len() as f64 {
        let most =
            most_often(frames).map_or(String::new(), |limb| format!(", most often the {}", limb.name()));
        doubts.push(format!(
            "in {:.0} % of the frames a limb does not fit the silhouettes{most} ({}): look at the overlay videos there (red) and \
             do not trust those frames; more cameras, better silhouettes or more particles (--set particles=100) help",
            100.0 * misaligned.len() as f64 / frames.len() as f64,
            ranges(&misaligned)
        ));
    }
    for Meeting { seam, is_blind } in &finished.meetings {
        if let (false, false, Some(apart)) = (seam.is_smooth, is_blind, seam.apart_m) {
            doubts.push(format!(
                "two parts of the session do not agree at frame {}: joints are up to {:.0} cm apart, and the motion may jump \
                 there; the part that covers the silhouettes better was taken",
                seam.frame,
                100.0 * apart
            ));
        }
    }
    let overlaps = overlaps(finished);
    let all = mean(overlaps.iter().flatten().copied());
    if let Some(all) = all.filter(|all| *all < LOW_OVERLAP) {
        doubts.push(format!(
            "the body covers only {:.0} % of the silhouettes: are calibration and silhouettes right, do the clips begin at the \
             same moment, are the clothes tight?",
            100.0 * all
        ));
    }
    for (index, camera) in finished.cameras.iter().enumerate() {
        let others = overlaps.iter().enumerate().filter(|(other, _)| *other != index);
        let others = mean(others.filter_map(|(_, overlap)| *overlap));
        if let (Some(own), Some(others)) = (overlaps[index], others)
            && own < others - WORSE
        {
            doubts.push(format!(
                "camera {camera} fits worse than the others (overlap {own:.2}, they have {others:.2}): its clip may begin at \
                 another moment, or its silhouettes are poor; try --cameras without it"
            ));
        }
    }
    doubts
}

/// The limb that is misaligned in most frames.
fn most_often(frames: &[Tracked]) -> Option<Limb> {
    let count = |limb: Limb| {
        frames.iter().filter(|tracked| tracked.misalignment.misaligned().any(|other| other == limb)).count()
    };
    // of those equally often, the last: the outermost
    Limb::ALL.into_iter().max_by_key(|&limb| count(limb))
}

fn numbers(frames: &[Tracked], is_wanted: impl Fn(&Tracked) -> bool) -> Vec<usize> {
    frames.iter().filter(|tracked| is_wanted(tracked)).map(|tracked| tracked.frame).collect()
}

/// Numbers of frames as ranges, the first few.
fn ranges(frames: &[usize]) -> String {
    let runs: Vec<&[usize]> = frames.chunk_by(|a, b| a + 1 == *b).collect();
    let said = runs.iter().take(LISTED).map(|run| match run {
        [first, .., last] => format!("{first}–{last}"),
        _ => format!("{}", run[0]),
    });
    let said = said.collect::<Vec<_>>().join(", ");
    match frames {
        [_] => format!("frame {said}"),
        _ if runs.len() > LISTED => format!("frames {said}, …"),
        _ => format!("frames {said}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_listed_as_ranges() {
        assert_eq!(ranges(&[3]), "frame 3");
        assert_eq!(ranges(&[3, 4, 5, 9]), "frames 3–5, 9");
        assert_eq!(ranges(&[1, 3, 5, 7, 9, 11]), "frames 1, 3, 5, 7, 9, …");
    }
}
