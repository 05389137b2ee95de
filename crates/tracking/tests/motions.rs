//! People whose motion is known are followed.

mod following;
mod moving;
#[path = "../../body/tests/scans/mod.rs"]
mod scans;

use std::sync::atomic::AtomicBool;

use body::BodyModel;
use following::follow;
use model::{Camera, Silhouette};
use moving::{cameras, distances, mixed, pose, seen};
use nalgebra::Vector3;
use tracking::{
    Chunk, Error, Footage, ObservedFrame, Options, Seen, Stage, Tracker, hold_unseen, merge, plan_chunks,
    track_footage,
};
use vision::scene::SilhouetteNoise;

static GO: AtomicBool = AtomicBool::new(false);

/// What was seen of frames without pictures.
fn silhouettes(frames: &[(moving::Views, Vec<Vector3<f64>>)]) -> Vec<Seen> {
    frames.iter().map(|(views, _)| Seen { views: views.clone(), matches: Vec::new() }).collect()
}

/// Follows a registered scan, whose surface is not one of the model's, through a mixed motion, from a start that `shape_fit`
/// finds. Limits: mean joint error, largest, metres; least intersection over union.
fn judge(test: &str, subjects: &[usize], views: usize, noise: Option<u64>, limits: [f64; 3]) {
    let Some(bodies) = testkit::shared::find("data/bodies", test) else { return };
    let data = scans::Scans::read(&bodies);
    let model = BodyModel::shipped();
    let cameras = cameras(views);
    for &subject in subjects {
        let shape = scans::shape_of(&model, &data.scans[subject]);
        let motion = mixed(&model, 6);
        let mut frames: Vec<_> = motion.iter().map(|pose| seen(&model, &shape, pose, &cameras)).collect();
        for (frame, (views, _)) in frames.iter_mut().enumerate() {
            for (index, (_, silhouette)) in views.iter_mut().enumerate() {
                if let Some(seed) = noise {
                    SilhouetteNoise::default().add_to(silhouette, seed + frame as u64, index as u64);
                }
            }
        }
        let fit = shape_fit::fit(&model, &frames[0].0, &shape_fit::Options::default()).unwrap();
        let mut tracker = Tracker::new(&model, &fit.alpha, &fit.pose, Options::default()).unwrap();
        let chunk = follow(&mut tracker, &fit.pose, 0, &silhouettes(&frames), |_| ());
        let (mut sum, mut worst, mut iou) = (0.0, 0.0f64, 1.0f64);
        for (tracked, (_, truth)) in chunk.frames.iter().zip(&frames) {
            let mean = distances(&tracked.joints, truth).sum::<f64>() / truth.len() as f64;
            let most = distances(&tracked.joints, truth).fold(0.0, f64::max);
            println!(
                "subject {subject} frame {:2}: {:5.1} mm, worst {:5.1} mm, iou {:.3}, error {:4.1} mm, {:?}",
                tracked.frame,
                1000.0 * mean,
                1000.0 * most,
                tracked.mean_iou(),
                1000.0 * tracked.misalignment.worst_m(),
                tracked.stage
            );
            sum += mean / frames.len() as f64;
            worst = worst.max(most);
            iou = iou.min(tracked.mean_iou());
        }
        println!("subject {subject}: {:.1} mm, worst {:.1} mm, least iou {iou:.3}", 1e3 * sum, 1e3 * worst);
        assert!(sum < limits[0] && worst < limits[1] && iou > limits[2], "{sum} {worst} {iou}");
    }
}

#[test]
fn scanned_people_are_followed_through_squats_and_turns() {
    let test = "scanned_people_are_followed_through_squats_and_turns";
    judge(test, &[17, 60], 8, None, [0.008, 0.12, 0.93]);
}

#[test]
fn a_scanned_person_is_followed_in_four_noisy_views() {
    judge("a_scanned_person_is_followed_in_four_noisy_views", &[33], 4, Some(3), [0.01, 0.05, 0.93]);
}

#[test]
fn chunks_tracked_apart_are_one_motion() {
    let model = BodyModel::shipped();
    let cameras = cameras(4);
    let alpha = [0.8, -0.6, 0.5];
    let shape = model.shape(&alpha);
    let motion = &mixed(&model, 5)[..16];
    let frames: Vec<_> = motion.iter().map(|pose| seen(&model, &shape, pose, &cameras)).collect();
    let chunks: Vec<Chunk> = plan_chunks(frames.len(), 8, 3)
        .iter()
        .map(|plan| {
            let start = &motion[plan.first];
            let mut tracker = Tracker::new(&model, &alpha, start, Options::default()).unwrap();
            follow(&mut tracker, start, plan.first, &silhouettes(&frames[plan.first..plan.end]), |_| ())
        })
        .collect();
    let merged = merge(&model, &shape, &chunks).unwrap();
    assert_eq!(merged.frames.len(), frames.len());
    assert!(merged.seams[0].is_smooth, "{:?}", merged.seams);
    for (tracked, (_, truth)) in merged.frames.iter().zip(&frames) {
        let most = distances(&tracked.joints, truth).fold(0.0, f64::max);
        assert!(most < 0.05, "frame {}: {most} m", tracked.frame);
    }
}

#[test]
fn a_person_who_turns_round_once_has_no_jump_in_any_number() {
    let model = BodyModel::shipped();
    let cameras = cameras(4);
    let frames = 25;
    let heading = |frame: usize| 0.2 + std::f64::consts::TAU * frame as f64 / (frames - 1) as f64;
    let motion: Vec<_> = (0..frames).map(|frame| pose(&model, heading(frame), [0, 1, 0, 0])).collect();
    let frames: Vec<_> = motion.iter().map(|pose| seen(&model, &model.shape(&[]), pose, &cameras)).collect();
    let plans = plan_chunks(frames.len(), 13, 3);
    let chunks: Vec<Chunk> = plans
        .iter()
        .map(|plan| {
            // a key frame knows of no turns before it
            let mut start = motion[plan.first].clone();
            start[4] -= if plan.first == 0 { 0.0 } else { std::f64::consts::TAU };
            let mut tracker = Tracker::new(&model, &[], &start, Options::default()).unwrap();
            follow(&mut tracker, &start, plan.first, &silhouettes(&frames[plan.first..plan.end]), |_| ())
        })
        .collect();
    let merged = merge(&model, &model.shape(&[]), &chunks).unwrap();
    for tracked in [&chunks[0].frames, &merged.frames] {
        for pair in tracked.windows(2) {
            let moved = pair[1].pose.iter().zip(&pair[0].pose).map(|(a, b)| (a - b).abs());
            assert!(moved.fold(0.0, f64::max) < 0.5, "frame {}: {:?}", pair[1].frame, pair[1].pose);
        }
    }
    let turned = merged.frames[24].pose[4] - merged.frames[0].pose[4];
    assert!((turned - std::f64::consts::TAU).abs() < 0.1, "{turned}");
}

#[test]
fn the_number_of_threads_changes_no_bit_of_local_and_particle_search() {
    let model = BodyModel::shipped();
    let shape = model.shape(&[0.4]);
    let motion = mixed(&model, 5);
    let (views, _) = seen(&model, &shape, &motion[0], &cameras(4));
    // from a pose that local optimisation does not come back from
    let mut start = motion[0].clone();
    let arm = model.rig().dof_index("l_shoulder_abd").unwrap();
    start[arm] += 1.9;
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let frame = ObservedFrame::new(3, &views).unwrap();
            let mut tracker = Tracker::new(&model, &[0.4], &start, Options::default()).unwrap();
            let misalignment = tracker.misalignment(&frame, &start);
            assert!(misalignment.any());
            let found = tracker.search(&frame, &start, &start, &misalignment, &|| true).unwrap().unwrap();
            assert!(found.effective_sample_size >= 1.0 && found.effective_sample_size <= 25.0);
            (found, tracker.track(&frame, &GO).unwrap())
        })
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_stop_is_heard_inside_a_frame_and_an_empty_frame_keeps_the_pose() {
    let model = BodyModel::shipped();
    let motion = mixed(&model, 5);
    let (views, _) = seen(&model, &model.shape(&[]), &motion[0], &cameras(3));
    let frame = ObservedFrame::new(7, &views).unwrap();
    let mut tracker = Tracker::new(&model, &[], &motion[0], Options::default()).unwrap();
    assert_eq!(tracker.track(&frame, &AtomicBool::new(true)), Err(Error::Stopped { frame: 7 }));
    let tracked = tracker.track(&frame, &GO).unwrap();
    assert!(tracked.stage == Stage::Local && tracked.mean_iou() > 0.97, "{:?}", tracked.ious);
    let nobody: Vec<_> = views
        .into_iter()
        .map(|(camera, mut silhouette)| {
            silhouette.clear();
            (camera, silhouette)
        })
        .collect();
    let unseen = tracker.track(&ObservedFrame::new(8, &nobody).unwrap(), &GO).unwrap();
    assert_eq!((unseen.stage, unseen.ious, unseen.pose), (Stage::Unseen, vec![None; 3], tracked.pose));
    assert!(Tracker::new(&model, &[], &[0.0; 3], Options::default()).is_err());
}

#[test]
fn a_person_who_comes_late_and_leaves_is_followed_from_where_they_are_found() {
    let model = BodyModel::shipped();
    let shape = model.shape(&[0.5, -0.5]);
    let cameras = cameras(4);
    let motion = &mixed(&model, 6)[..16];
    let empty = |views: &moving::Views| -> moving::Views {
        views.iter().map(|(c, s)| (c.clone(), Silhouette::empty(s.width(), s.height()))).collect()
    };
    let frames: Vec<_> = motion.iter().map(|pose| seen(&model, &shape, pose, &cameras)).collect();
    // nobody in the first two frames and in two later ones; the first try to find somebody fails
    let is_empty = |frame: usize| frame < 2 || frame == 11 || frame == 12;
    let mut tries = 0;
    let footage = Footage {
        frames: 0..motion.len(),
        see: |frame: usize| {
            let (views, _) = &frames[frame];
            let views = if is_empty(frame) { empty(views) } else { views.clone() };
            Ok::<_, Error>(Seen { views, matches: Vec::new() })
        },
        find: |views: &[(Camera, Silhouette)]| {
            tries += 1;
            let fit = || shape_fit::fit_pose(&model, &shape.alpha, views, &shape_fit::Options::default());
            (tries > 1).then(fit).and_then(Result::ok).map(|fit| fit.pose)
        },
    };
    let rest = vec![0.0; model.rig().num_dofs()];
    let mut tracker = Tracker::new(&model, &shape.alpha, &rest, Options::default()).unwrap();
    let mut done = Vec::new();
    let mut chunk = track_footage(&mut tracker, footage, &GO, |frames| done.push(frames)).unwrap();
    assert!(done.iter().copied().eq(0..=motion.len()));
    assert!(chunk.frames.iter().map(|tracked| tracked.frame).eq(0..motion.len()));
    assert_eq!(hold_unseen(&model, &shape, &mut chunk.frames), 4);
    for (frame, tracked) in chunk.frames.iter().enumerate() {
        assert_eq!(tracked.stage == Stage::Unseen, is_empty(frame), "frame {frame}");
        let expected = if frame < 2 {
            2
        } else if is_empty(frame) {
            10
        } else {
            frame
        };
        let worst = distances(&tracked.joints, &frames[expected].1).fold(0.0, f64::max);
        assert!(worst < 0.06, "frame {frame}: {worst} m");
    }
}

#[test]
fn following_stops_when_it_is_told_to() {
    let model = BodyModel::shipped();
    let shape = model.shape(&[]);
    let pose = moving::pose(&model, 0.0, [0, 0, 0, 0]);
    let (views, _) = seen(&model, &shape, &pose, &cameras(2));
    let footage = Footage {
        frames: 3..9,
        see: |_| Ok::<_, Error>(Seen { views: views.clone(), matches: Vec::new() }),
        find: |_: &[(Camera, Silhouette)]| Some(pose.clone()),
    };
    let mut tracker = Tracker::new(&model, &[], &pose, Options::default()).unwrap();
    let stopped = track_footage(&mut tracker, footage, &AtomicBool::new(true), |_| ());
    assert_eq!(stopped, Err(Error::Stopped { frame: 3 }));
}
