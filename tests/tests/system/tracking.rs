//! People followed through the frames of sessions with cameras, end to end.

use std::time::Duration;

use anyhow::{Context, Result, ensure};
use body::{BodyModel, Posed};
use formats::{PointsOptions, image_files, points_csv};
use model::{Camera, Image, Mesh, PointTrajectories, Silhouette};
use nalgebra::Vector3;
use serde_json::{Value, json};
use tests::{Api, System};
use video::{FrameReader, ReadOptions};
use vision::scene::{Ring, silhouettes};

use crate::{cameras::tar, faults::MAREY};

const CAMERAS: usize = 4;
const FRAMES: usize = 9;

/// A take of a drawn person who lifts their arms and walks off: a calibration, masks, and where the joints were.
pub(crate) struct Take {
    calibration: String,
    masks: Vec<u8>,
    cameras: Vec<Camera>,
    /// shape `[frames][cameras]`
    seen: Vec<Vec<Silhouette>>,
    truth: Vec<Vec<Vector3<f64>>>,
    joint_names: Vec<String>,
}

/// `empty`: frames in front in which nobody is.
pub(crate) fn take(empty: usize) -> Result<Take> {
    let model = BodyModel::shipped();
    let shape = model.shape(&[0.7, -0.4]);
    let cameras = Ring { cameras: CAMERAS, size: 402, focal: 530.0, ..Ring::default() }.cameras();
    let dof = |name: &str| model.rig().dof_index(name).with_context(|| name.to_owned());
    let (arms, elbow, legs) = (
        [dof("l_shoulder_abd")?, dof("r_shoulder_abd")?],
        dof("l_elbow")?,
        [dof("l_hip_flex")?, dof("r_hip_flex")?],
    );
    let (mut files, mut seen, mut truth) = (Vec::new(), Vec::new(), Vec::new());
    let nobody = image_files::write_silhouette(&Silhouette::empty(402, 402));
    for (camera, frame) in cameras.iter().flat_map(|camera| (0..empty).map(move |frame| (camera, frame))) {
        files.push((format!("{}/{frame:04}.png", camera.name), nobody.clone()));
    }
    let mut posed = Posed::default();
    for frame in 0..FRAMES {
        let share = frame as f64 / (FRAMES - 1) as f64;
        let mut pose = vec![0.0; model.rig().num_dofs()];
        (pose[0], pose[2], pose[4]) = (0.1 * share, 0.25 * share, 0.4 + 0.3 * share);
        arms.iter().for_each(|&arm| pose[arm] = 0.3 + 0.6 * share);
        pose[elbow] = 0.5 * share;
        (pose[legs[0]], pose[legs[1]]) = (0.4 * share, -0.2 * share);
        shape.pose(&model, &pose, &mut posed);
        let mesh = Mesh::new(posed.vertices.clone(), model.faces().to_vec())?;
        let frame_masks = silhouettes(&mesh, &cameras);
        for (camera, mask) in cameras.iter().zip(&frame_masks) {
            let name = format!("{}/{:04}.png", camera.name, empty + frame);
            files.push((name, image_files::write_silhouette(mask)));
        }
        seen.push(frame_masks);
        truth.push(posed.joints.clone());
    }
    let files: Vec<(&str, &[u8])> =
        files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    Ok(Take {
        calibration: formats::calibration::write(&cameras),
        masks: tar(&files)?,
        truth,
        cameras,
        seen,
        joint_names: model.rig().joints().iter().map(|joint| joint.name.clone()).collect(),
    })
}

impl Take {
    /// The same as pictures, of a person in patterned clothes before a wall, and of the wall.
    fn upload_pictures(&self, api: &Api) -> Result<String> {
        let (mut pictures, mut plates) = (Vec::new(), Vec::new());
        for (index, camera) in self.cameras.iter().enumerate() {
            let wall = painted(&Silhouette::empty(402, 402), [0, 0]);
            plates.push((format!("{}.png", camera.name), image_files::write_image(&wall)));
            for (frame, joints) in self.truth.iter().enumerate() {
                let pelvis = camera.project(&joints[0]).context("behind the camera")?;
                let picture =
                    painted(&self.seen[frame][index], [pelvis.x, pelvis.y].map(|x| x.round() as i64));
                pictures
                    .push((format!("{}/{frame:04}.png", camera.name), image_files::write_image(&picture)));
            }
        }
        let [pictures, plates] = [pictures, plates].map(|files| {
            tar(&files.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect::<Vec<_>>())
        });
        let (pictures, plates) = (pictures?, plates?);
        api.session(
            "take",
            &[
                ("calibration.json", self.calibration.as_bytes()),
                ("images.tar", &pictures),
                ("plates.tar", &plates),
            ],
        )
    }

    pub(crate) fn upload(&self, api: &Api) -> Result<String> {
        let files = [("calibration.json", self.calibration.as_bytes()), ("masks.tar", self.masks.as_slice())];
        api.session("take", &files)
    }

    /// Mean and largest distance of joints from where they were, metres.
    fn errors(&self, found: &PointTrajectories) -> Result<[f64; 2]> {
        ensure!(found.num_frames() == FRAMES && found.names() == self.joint_names, "{:?}", found.names());
        let (mut sum, mut most) = (0.0, 0.0f64);
        for (frame, truth) in self.truth.iter().enumerate() {
            for (joint, place) in truth.iter().enumerate() {
                let off = (found.position(frame, joint).context("missing")? - place).norm();
                (sum, most) = (sum + off, most.max(off));
            }
        }
        Ok([sum / (FRAMES * self.joint_names.len()) as f64, most])
    }
}

/// A person in a pattern of blocks that moves along with `origin` (a pixel), before a wall.
fn painted(mask: &Silhouette, origin: [i64; 2]) -> Image {
    let mut picture = Image::black(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            let wall = 70 + ((x / 40 + y / 40) % 2) as u8 * 12;
            let [block_x, block_y] =
                [(x as i64 - origin[0]).div_euclid(6), (y as i64 - origin[1]).div_euclid(6)];
            let hash = (block_x * 7919 + block_y * 104_729).wrapping_mul(2_654_435_761) >> 7;
            let [red, green] = [(hash & 0x3f) as u8, (hash >> 6 & 0x3f) as u8];
            let is_person = mask.contains(x as isize, y as isize);
            picture.set(x, y, if is_person { [190 + red, 20 + green, 200] } else { [wall; 3] });
        }
    }
    picture
}

/// Two chunks of what there is.
fn in_chunks(overlay: bool) -> Value {
    json!({"parameters": {"chunk_frames": 5, "overlap_frames": 2, "frame_rate": 25, "overlay": overlay}})
}

#[test]
fn a_person_in_masks_is_followed_and_every_result_can_be_read() -> Result<()> {
    let take = take(0)?;
    let system = System::with_cameras(2)?;
    let api = system.project("p")?;
    let run = api.start_run(&take.upload(&api)?, &in_chunks(true))?;
    let end = api.wait(&run)?;
    ensure!(end["state"] == "succeeded", "{end}");
    let result = |name: &str| -> Result<Vec<u8>> {
        let answer = api.get(&format!("{run}/results/{name}"))?;
        ensure!(answer.status == 200, "{name}: {}", String::from_utf8_lossy(&answer.body));
        Ok(answer.body)
    };
    let options = PointsOptions::default();
    let joints = [
        formats::c3d::read(&result("joints.c3d")?, &options)?.value,
        formats::trc::read(&result("joints.trc")?, &options)?.value,
        points_csv::read(&result("joints.csv")?)?.value,
    ];
    for joints in joints {
        let [mean, most] = take.errors(&joints)?;
        println!("joints: mean {:.1} mm, largest {:.1} mm", 1e3 * mean, 1e3 * most);
        assert!(mean < 0.02 && most < 0.07, "{mean} {most}");
        assert!((joints.frame_rate() - 25.0).abs() < 1e-6, "{}", joints.frame_rate());
    }
    let motion = formats::bvh::read(&result("motion.bvh")?, &formats::BvhOptions::default())?.value;
    assert_eq!(motion.num_frames(), FRAMES);
    assert!((motion.frame_rate() - 25.0).abs() < 0.01, "{}", motion.frame_rate());
    let glb = result("body.glb")?;
    let length = u32::from_le_bytes(glb[12..16].try_into()?) as usize;
    let scene: Value = serde_json::from_slice(&glb[20..20 + length])?;
    let times = &scene["accessors"]
        [scene["animations"][0]["samplers"][0]["input"].as_u64().context("no times")? as usize];
    assert_eq!(times["count"], FRAMES);
    let quality = String::from_utf8(result("quality.csv")?)?;
    let rows: Vec<&str> = quality.lines().collect();
    assert_eq!(rows.len(), FRAMES + 1);
    assert!(rows[0].starts_with("frame,time,stage,overlap,overlap_cam0,"), "{}", rows[0]);
    assert!(rows[2].starts_with("1,0.040000,local,0.9"), "{}", rows[2]);
    assert_eq!(String::from_utf8(result("poses.csv")?)?.lines().count(), FRAMES + 1);
    let report: Value = serde_json::from_slice(&result("run.json")?)?;
    let tracking = &report["tracking"];
    assert_eq!(report["session"]["frames"], FRAMES);
    assert_eq!(tracking["seams"][0]["is_smooth"], true, "{tracking}");
    assert!(tracking["overlap"].as_f64() > Some(0.93), "{tracking}");
    assert_eq!(report["timings"]["chunks"].as_array().map(Vec::len), Some(2));
    assert_eq!(report["parameters"]["seed"], 0);
    assert!(result("shape.json")?.len() > 100 && result("hull.ply")?.len() > 100);
    // a picture and a video of each camera
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("overlay.mp4");
    std::fs::write(&path, result("overlay_cam1.mp4")?)?;
    let mut reader = FrameReader::open(&video::Source::video(&path), &ReadOptions::default())?;
    assert_eq!(reader.size(), [402, 402]);
    let (mut frames, mut picture) = (0, reader.frame());
    while reader.read(&mut picture)? {
        assert!(green(&picture) > 100, "no outline in frame {frames}");
        frames += 1;
    }
    assert_eq!(frames, FRAMES);
    assert!(result("overlay_cam0.png")?.len() > 100);
    Ok(())
}

/// Pixels of about the colour of an outline that fits.
fn green(picture: &Image) -> usize {
    picture.rgb().chunks(3).filter(|p| p[1] > 150 && p[0] < 110 && p[2] < 190).count()
}

/// The attempts that the chunks of a run took together.
fn chunk_attempts(api: &Api, run: &str) -> Result<u64> {
    let run = api.get(run)?.json();
    let jobs = run["jobs"].as_array().context("no jobs")?;
    let jobs = jobs.iter().find(|j| j["kind"] == "track-chunk").context("no chunks")?;
    jobs["attempts"].as_u64().context("no attempts")
}

fn is_tracking(event: &Value) -> bool {
    event["phrase"].as_str().is_some_and(|phrase| phrase.contains("part "))
}

#[test]
fn neither_the_number_of_workers_nor_a_killed_one_changes_what_was_tracked() -> Result<()> {
    let take = take(0)?;
    let system = System::with_shape_init(2)?;
    system.set_staleness(Duration::from_secs(1))?;
    let api = system.project("p")?;
    let session = take.upload(&api)?;
    let finished = |run: &str| -> Result<Vec<(String, Vec<u8>)>> {
        let end = api.wait(run)?;
        ensure!(end["state"] == "succeeded", "{end}");
        api.motion_files(run)
    };
    let mut one = system.spawn(MAREY, "refinement", "one")?;
    let alone = finished(&api.start_run(&session, &in_chunks(false))?)?;
    assert!(alone.iter().any(|(name, _)| name == "motion.bvh") && alone.len() > 8, "{}", alone.len());

    // killed with a chunk in its hands; two others go on
    let run = api.start_run(&session, &in_chunks(false))?;
    let event = api.wait_until(&run, is_tracking)?;
    assert_eq!(event["state"], "running", "{event}");
    one.kill()?;
    let _others = [system.spawn(MAREY, "refinement", "two")?, system.spawn(MAREY, "refinement", "three")?];
    let again = finished(&run)?;
    assert!(chunk_attempts(&api, &run)? > 2, "no chunk was interrupted");
    for ((name, a), (other, b)) in alone.iter().zip(&again) {
        assert!(name == other && a == b, "{name} differs from {other}");
    }
    assert_eq!(alone.len(), again.len());
    Ok(())
}

#[test]
fn tracking_is_cancelled_and_a_person_who_is_not_there_yet_is_waited_for() -> Result<()> {
    let take = take(2)?;
    let system = System::with_cameras(1)?;
    let api = system.project("p")?;
    let session = take.upload(&api)?;
    let run = api.start_run(&session, &in_chunks(false))?;
    let event = api.wait_until(&run, is_tracking)?;
    assert_eq!(event["state"], "running", "{event}");
    api.make(&format!("{run}/cancel"), &json!({}))?;
    let end = api.wait(&run)?;
    assert_eq!(end["state"], "cancelled", "{end}");

    // nobody is in the first two frames
    let run = api.start_run(&session, &in_chunks(false))?;
    let end = api.wait(&run)?;
    assert_eq!(end["state"], "succeeded", "{end}");
    let report = api.get(&format!("{run}/results/run.json"))?.json();
    assert_eq!(report["tracking"]["frames_by_stage"]["unseen"], 2, "{}", report["tracking"]);
    let warnings = report["warnings"].to_string();
    assert!(warnings.contains("nobody was found in 2 of 11 frames (frames 0–1)"), "{warnings}");
    Ok(())
}

#[test]
fn a_person_in_pictures_is_followed_by_the_pattern_of_their_clothes_too() -> Result<()> {
    let take = take(0)?;
    let system = System::with_cameras(2)?;
    let api = system.project("p")?;
    let session = take.upload_pictures(&api)?;
    let tracked = |texture: bool| -> Result<Vec<u8>> {
        let parameters = json!({"texture": texture, "overlay": false, "frame_rate": 25});
        let run = api.start_run(&session, &json!({ "parameters": parameters }))?;
        let end = api.wait(&run)?;
        ensure!(end["state"] == "succeeded", "{end}");
        let joints = api.get(&format!("{run}/results/joints.csv"))?.body;
        let [mean, most] = take.errors(&points_csv::read(&joints)?.value)?;
        println!("texture {texture}: joints: mean {:.1} mm, largest {:.1} mm", 1e3 * mean, 1e3 * most);
        assert!(mean < 0.03 && most < 0.1, "{mean} {most}");
        Ok(joints)
    };
    assert!(tracked(true)? != tracked(false)?, "the pattern was not looked at");
    Ok(())
}
