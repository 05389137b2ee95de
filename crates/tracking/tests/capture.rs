//! The capture that judges: 40 frames of a stranger, 8 cameras.

mod following;

use std::{
    path::Path,
    time::{Duration, Instant},
};

use body::BodyModel;
use features::{Features, detect, match_features};
use following::follow;
use formats::{calibration, image_files};
use model::{Camera, PointMatch, Silhouette};
use nalgebra::Vector3;
use serde_json::Value;
use tracking::{Options, Seen, Stage, Tracker};
use vision::scene::SilhouetteNoise;

const FRAMES: usize = 40;

fn views(folder: &Path, cameras: &[Camera], frame: usize, noise: Option<u64>) -> Vec<(Camera, Silhouette)> {
    let read = |(index, camera): (usize, &Camera)| {
        let file = testkit::shared::read(folder, &format!("silhouettes/{}/{frame:04}.png", camera.name));
        let mut silhouette = image_files::read_silhouette(&file, &Default::default()).unwrap().value;
        if let Some(seed) = noise {
            SilhouetteNoise::default().add_to(&mut silhouette, seed + frame as u64, index as u64);
        }
        (camera.clone(), silhouette)
    };
    cameras.iter().enumerate().map(read).collect()
}

/// True joints of every frame, in the order of the model's rig.
fn truth(folder: &Path, model: &BodyModel) -> Vec<Vec<Vector3<f64>>> {
    let json: Value =
        serde_json::from_slice(&testkit::shared::read(folder, "groundtruth/joints.json")).unwrap();
    let names: Vec<&str> =
        json["joint_names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let frames = json["frames"].as_array().unwrap();
    let joint = |frame: &Value, name: &str| {
        let index = names.iter().position(|other| *other == name).unwrap();
        let at = |axis: usize| frame["joints"][index][axis].as_f64().unwrap();
        Vector3::new(at(0), at(1), at(2))
    };
    let joints = |frame| model.rig().joints().iter().map(|j| joint(frame, &j.name)).collect();
    frames.iter().map(joints).collect()
}

/// There are pictures of every n-th frame of cameras 0, 2, 4 and 6.
const PICTURES: usize = 4;

/// Matches of the pictures of a camera, shape `[frames]`.
fn matches(folder: &Path, camera: &Camera, frames: &[Vec<(Camera, Silhouette)>]) -> Vec<Vec<PointMatch>> {
    let options = features::Options { reach: 0.3, ..features::Options::default() };
    let mut before = Features::default();
    let from_frame = |(frame, views): (usize, &Vec<(Camera, Silhouette)>)| {
        let silhouette =
            views.iter().find(|(own, _)| own.name == camera.name).map(|(_, silhouette)| silhouette);
        let name = format!("images/{}/{frame:04}.jpg", camera.name);
        let Some(silhouette) = silhouette.filter(|_| folder.join(&name).exists()) else { return Vec::new() };
        let bytes = testkit::shared::read(folder, &name);
        let image = image_files::read_image(&bytes, &Default::default()).unwrap();
        let now = detect(&image, silhouette, &options);
        let pairs = match_features(&before, &now, &options).into_iter().map(|[i, j]| PointMatch {
            frames_back: PICTURES as u32,
            before: before.points[i].pixel,
            now: now.points[j].pixel,
        });
        let pairs = pairs.collect();
        before = now;
        pairs
    };
    frames.iter().enumerate().map(from_frame).collect()
}

/// What is expected of a run.
struct Case {
    /// indices of the cameras
    cameras: &'static [usize],
    /// seed
    noise: Option<u64>,
    has_pictures: bool,
    /// mean joint error and largest, mm; least mean intersection over union
    limits: [f64; 3],
}

fn judge(test: &str, case: &Case) {
    let Case { cameras: wanted, noise, has_pictures, limits } = *case;
    let Some(folder) = testkit::shared::find("data/multiview/synthetic-8cam", test) else { return };
    let file = testkit::shared::read(&folder, "calibration.json");
    let all = calibration::read("calibration.json", &file, &Default::default()).unwrap().value;
    let cameras: Vec<Camera> = wanted.iter().map(|&index| all[index].clone()).collect();
    let model = BodyModel::shipped();
    let truth = truth(&folder, &model);
    let frames: Vec<_> = (0..FRAMES).map(|frame| views(&folder, &cameras, frame, noise)).collect();
    let fit = shape_fit::fit(&model, &frames[0], &shape_fit::Options::default()).unwrap();
    let mut tracker = Tracker::new(&model, &fit.alpha, &fit.pose, Options::default()).unwrap();
    let matches: Vec<_> =
        cameras.iter().filter(|_| has_pictures).map(|camera| matches(&folder, camera, &frames)).collect();
    let count: usize = matches.iter().flatten().map(Vec::len).sum();
    println!("{test}: {count} matches");
    let seen = |(index, views): (usize, &Vec<_>)| Seen {
        views: views.clone(),
        matches: matches.iter().map(|matches| matches[index].clone()).collect(),
    };
    let seen: Vec<_> = frames.iter().enumerate().map(seen).collect();
    // of the beginning of every frame, and of the end
    let mut marks = Vec::new();
    let chunk = follow(&mut tracker, &fit.pose, 0, &seen, |_| marks.push(Instant::now()));
    let times: Vec<(Stage, Duration)> = chunk
        .frames
        .iter()
        .zip(marks.windows(2))
        .map(|(tracked, at)| (tracked.stage, at[1] - at[0]))
        .collect();
    let (mut sum, mut worst, mut iou) = (0.0, 0.0f64, 0.0);
    for (tracked, truth) in chunk.frames.iter().zip(&truth) {
        let errors: Vec<f64> =
            tracked.joints.iter().zip(truth).map(|(a, b)| 1000.0 * (a - b).norm()).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let (joint, most) =
            errors.iter().enumerate().fold((0, 0.0), |most, (i, &e)| if e > most.1 { (i, e) } else { most });
        println!(
            "{test} {:2}: {mean:5.1} mm, {:>10} {most:5.1} mm, iou {:.3}, limb {:4.1} mm, {:?} {:.0} ms {:?}",
            tracked.frame,
            model.rig().joints()[joint].name,
            tracked.mean_iou(),
            1000.0 * tracked.misalignment.worst_m(),
            tracked.stage,
            times[tracked.frame].1.as_secs_f64() * 1e3,
            tracked.misalignment.misaligned().collect::<Vec<_>>()
        );
        sum += mean / FRAMES as f64;
        worst = worst.max(most);
        iou += tracked.mean_iou() / FRAMES as f64;
    }
    let is_local = |(stage, _): &&(Stage, Duration)| *stage == Stage::Local;
    let local: Vec<f64> = times.iter().filter(is_local).map(|(_, time)| time.as_secs_f64() * 1e3).collect();
    let least = local.iter().copied().fold(f64::INFINITY, f64::min);
    println!(
        "{test}: joints {sum:.1} mm, largest {worst:.1} mm, iou {iou:.3}; {} frames locally in {:.0} ms on average, {least:.0} \
         at best",
        local.len(),
        local.iter().sum::<f64>() / local.len().max(1) as f64
    );
    assert!(sum <= limits[0] && worst <= limits[1] && iou >= limits[2], "{sum} {worst} {iou}");
}

const ALL: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7];
const EVEN: &[usize] = &[0, 2, 4, 6];

#[test]
fn a_stranger_is_followed_in_eight_views() {
    let case = Case { cameras: ALL, noise: None, has_pictures: false, limits: [20.0, 100.0, 0.93] };
    judge("a_stranger_is_followed_in_eight_views", &case);
}

#[test]
fn a_stranger_is_followed_in_eight_views_and_a_few_pictures() {
    let case = Case { cameras: ALL, noise: None, has_pictures: true, limits: [20.0, 100.0, 0.93] };
    judge("a_stranger_is_followed_in_eight_views_and_a_few_pictures", &case);
}

#[test]
fn a_stranger_is_followed_in_four_noisy_views() {
    let case = Case { cameras: EVEN, noise: Some(5), has_pictures: false, limits: [35.0, 150.0, 0.93] };
    judge("a_stranger_is_followed_in_four_noisy_views", &case);
}

#[test]
fn a_stranger_is_followed_in_four_noisy_views_with_pictures() {
    let case = Case { cameras: EVEN, noise: Some(5), has_pictures: true, limits: [35.0, 150.0, 0.93] };
    judge("a_stranger_is_followed_in_four_noisy_views_with_pictures", &case);
}
