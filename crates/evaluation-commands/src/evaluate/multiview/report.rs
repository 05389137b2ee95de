//! What was measured, as a table and as JSON.

use evaluation::{
    Distribution,
    tables::{Cell, Table},
};
use serde::{Serialize, Serializer};
use tracking::Stage;

use super::joints::{JointErrors, Joints};

/// A limb that is farther off was lost, millimetres.
const LOST_MM: f64 = 100.0;

/// What is known of one frame.
#[derive(Serialize)]
pub struct FrameReport {
    pub frame: u32,
    #[serde(serialize_with = "by_name")]
    pub stage: Stage,
    #[serde(flatten)]
    pub errors: JointErrors,
    pub iou: f64,
    pub misaligned: Vec<String>,
    pub limb_error_mm: f64,
    pub effective_sample_size: Option<f64>,
    pub prepare_ms: f64,
    pub track_ms: f64,
    pub local_only: JointErrors,
    pub local_only_iou: f64,
    pub kept: JointErrors,
}

fn by_name<S: Serializer>(stage: &Stage, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(stage.name())
}

/// Times that belong to no frame.
#[derive(Default)]
pub struct Times {
    /// finding pose and shape in the first frame, seconds
    pub fit_shape_s: f64,
    /// searches over all DOFs whose result wasn't used, milliseconds
    pub search_ms: Vec<f64>,
    /// finding points in the pictures of a frame and matching them, milliseconds
    pub features_ms: Vec<f64>,
    /// points found again, in all
    pub matches: usize,
}

#[derive(Serialize)]
pub struct Settings {
    pub cameras: Vec<String>,
    pub noise_seed: Option<u64>,
    pub prior_poses: usize,
    pub prior_is_recorded: bool,
    pub alpha: Vec<f64>,
}

#[derive(Serialize)]
struct Stages {
    local: usize,
    particles: usize,
    misaligned: usize,
    unseen: usize,
}

/// Mean and largest distance of joints over all frames, millimetres, and the silhouettes' overlap.
#[derive(Serialize)]
struct Baseline {
    joint_mean_mm: f64,
    joint_max_mm: f64,
    frames_lost: usize,
    iou_mean: Option<f64>,
}

#[derive(Serialize)]
pub struct Report {
    joint_mean_mm: f64,
    joint_max_mm: f64,
    misaligned_frames: usize,
    iou_mean: f64,
    /// of a frame without particles: preparation, local optimisation, judging; mean
    local_ms_per_frame: Option<f64>,
    /// one search over all DOFs with the tracker's particles and iterations, mean
    global_ms_per_frame: Option<f64>,
    /// what particles add to a frame that they are used in: all searches and the local optimisation after them, mean
    repair_ms_per_frame: Option<f64>,
    frames: usize,
    /// frames with a joint that is more than 100 mm off
    frames_lost: usize,
    joints_left_out: Vec<String>,
    stages: Stages,
    local_ms: Option<Distribution>,
    prepare_ms: Option<Distribution>,
    /// of one search over all DOFs
    search_ms: Option<Distribution>,
    /// of the frames with pictures: finding points and matching them; not part of `local_ms_per_frame`
    features_ms: Option<Distribution>,
    /// points that cameras found again, in all frames
    matches: usize,
    fit_shape_s: f64,
    local_only: Baseline,
    first_pose_kept: Baseline,
    #[serde(flatten)]
    settings: Settings,
    per_frame: Vec<FrameReport>,
}

fn mean(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    Distribution::from_figures(numbers).map(|numbers| numbers.mean)
}

fn baseline(
    frames: &[FrameReport],
    errors: impl Fn(&FrameReport) -> &JointErrors,
    iou: Option<f64>,
) -> Baseline {
    let lost = frames.iter().filter(|frame| errors(frame).max_mm > LOST_MM);
    Baseline {
        joint_mean_mm: mean(frames.iter().map(|frame| errors(frame).mean_mm)).unwrap_or_default(),
        joint_max_mm: frames.iter().map(|frame| errors(frame).max_mm).fold(0.0, f64::max),
        frames_lost: lost.count(),
        iou_mean: iou,
    }
}

impl Report {
    pub fn new(joints: Joints, frames: Vec<FrameReport>, times: &Times, settings: Settings) -> Self {
        let all = |frame: &FrameReport| frame.prepare_ms + frame.track_ms;
        let at_stage = |stage: Stage| frames.iter().filter(move |frame| frame.stage == stage);
        let local_ms = Distribution::from_figures(at_stage(Stage::Local).map(all));
        let searched: Vec<f64> = frames
            .iter()
            .filter(|frame| frame.effective_sample_size.is_some())
            .map(|frame| all(frame) - local_ms.map_or(0.0, |local| local.mean))
            .collect();
        let own = baseline(&frames, |frame| &frame.errors, mean(frames.iter().map(|frame| frame.iou)));
        let alone = mean(frames.iter().map(|frame| frame.local_only_iou));
        Self {
            joint_mean_mm: own.joint_mean_mm,
            joint_max_mm: own.joint_max_mm,
            misaligned_frames: at_stage(Stage::Misaligned).count(),
            iou_mean: own.iou_mean.unwrap_or_default(),
            local_ms_per_frame: local_ms.map(|local| local.mean),
            global_ms_per_frame: mean(times.search_ms.iter().copied()),
            repair_ms_per_frame: mean(searched.into_iter()),
            frames: frames.len(),
            frames_lost: own.frames_lost,
            joints_left_out: joints.left_out,
            stages: Stages {
                local: at_stage(Stage::Local).count(),
                particles: at_stage(Stage::Particles).count(),
                misaligned: at_stage(Stage::Misaligned).count(),
                unseen: at_stage(Stage::Unseen).count(),
            },
            local_ms,
            prepare_ms: Distribution::from_figures(frames.iter().map(|frame| frame.prepare_ms)),
            search_ms: Distribution::from_figures(times.search_ms.iter().copied()),
            features_ms: Distribution::from_figures(times.features_ms.iter().copied()),
            matches: times.matches,
            fit_shape_s: times.fit_shape_s,
            local_only: baseline(&frames, |frame| &frame.local_only, alone),
            first_pose_kept: baseline(&frames, |frame| &frame.kept, None),
            settings,
            per_frame: frames,
        }
    }

    pub fn print(&self) {
        let Self { stages, local_only, first_pose_kept, .. } = self;
        let columns = ["", "Marey", "local only", "first pose moved along rigidly", "paper"];
        let mut table = Table::new("", "", 1, columns);
        let row = |name: &str, [own, local, kept]: [Cell; 3], paper: &str| {
            vec![Cell::text(name), own, local, kept, Cell::text(paper)]
        };
        let mm = |value: f64| Cell::text(format!("{value:.1} mm"));
        let baselines = [local_only, first_pose_kept];
        let [a, b] = baselines.map(|other| mm(other.joint_mean_mm));
        table.push(row("joints, mean", [mm(self.joint_mean_mm), a, b], ""));
        let [a, b] = baselines.map(|other| mm(other.joint_max_mm));
        table.push(row("joints, largest", [mm(self.joint_max_mm), a, b], ""));
        let count = |count: usize| Cell::text(count.to_string());
        let [a, b] = baselines.map(|other| count(other.frames_lost));
        table.push(row("frames with a joint off by > 100 mm", [count(self.frames_lost), a, b], ""));
        let iou = Cell::maybe(local_only.iou_mean, 3);
        table.push(row("overlap (IoU), mean", [Cell::Number(self.iou_mean, 3), iou, Cell::Empty], ""));
        let ms = |value: Option<f64>| value.map_or(Cell::Empty, |ms| Cell::text(format!("{ms:.0} ms")));
        let [none, nothing] = [Cell::Empty, Cell::Empty];
        table.push(row("local step, a frame", [ms(self.local_ms_per_frame), none, nothing], "8-10 s"));
        let [none, nothing] = [Cell::Empty, Cell::Empty];
        table.push(row(
            "one search by particles",
            [ms(self.global_ms_per_frame), none, nothing],
            "180-300 s",
        ));
        print!("{}", table.text());
        println!(
            "\n{} frames, {} views: {} local, {} fixed by particles, {} misaligned, {} without anybody",
            self.frames,
            self.settings.cameras.len(),
            stages.local,
            stages.particles,
            stages.misaligned,
            stages.unseen
        );
        if let Some(repair_ms) = self.repair_ms_per_frame {
            println!(
                "a frame that particles were needed in: {repair_ms:.0} ms more, for all searches and what follows"
            );
        }
        let times = [
            ("a frame without particles", self.local_ms),
            ("one search over all DOFs", self.search_ms),
            ("points in the pictures of a frame", self.features_ms),
        ];
        for (name, times) in times {
            if let Some(Distribution { median, percentile_90, .. }) = times {
                println!("{name}: median {median:.0} ms, 90 % within {percentile_90:.0} ms");
            }
        }
        if self.matches > 0 {
            println!("{} points of pictures found again", self.matches);
        }
        if !self.joints_left_out.is_empty() {
            println!("joints left out: {}", self.joints_left_out.join(", "));
        }
        let worst = self.per_frame.iter().max_by(|a, b| a.errors.max_mm.total_cmp(&b.errors.max_mm));
        if let Some(FrameReport { frame, errors: JointErrors { worst_joint, max_mm, .. }, .. }) = worst {
            println!("worst: {worst_joint} in frame {frame}, {max_mm:.0} mm");
        }
        println!("(paper: no true joints, its own captures, 8 views, two cores of 3 GHz of 2008)");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(stage: Stage, track_ms: f64, searched: bool) -> FrameReport {
        FrameReport {
            frame: 0,
            stage,
            errors: JointErrors {
                mean_mm: 5.0,
                max_mm: if searched { 120.0 } else { 9.0 },
                worst_joint: String::new(),
            },
            iou: 0.95,
            misaligned: Vec::new(),
            limb_error_mm: 1.0,
            effective_sample_size: searched.then_some(8.0),
            prepare_ms: 10.0,
            track_ms,
            local_only: JointErrors::default(),
            local_only_iou: 0.9,
            kept: JointErrors::default(),
        }
    }

    #[test]
    fn a_search_and_what_particles_add_to_a_frame_are_told_apart() {
        let report = |frames| {
            let joints = Joints::default();
            let settings = Settings {
                cameras: Vec::new(),
                noise_seed: None,
                prior_poses: 3,
                prior_is_recorded: false,
                alpha: Vec::new(),
            };
            let times = Times { fit_shape_s: 1.0, search_ms: vec![300.0], ..Times::default() };
            Report::new(joints, frames, &times, settings)
        };
        let local = || vec![frame(Stage::Local, 50.0, false), frame(Stage::Local, 70.0, false)];
        let without = report(local());
        assert_eq!((without.local_ms_per_frame, without.global_ms_per_frame), (Some(70.0), Some(300.0)));
        assert_eq!(without.repair_ms_per_frame, None);
        let mut frames = local();
        frames.push(frame(Stage::Particles, 460.0, true));
        let with = report(frames);
        assert_eq!((with.global_ms_per_frame, with.repair_ms_per_frame), (Some(300.0), Some(400.0)));
        assert_eq!((with.frames_lost, with.stages.particles, with.misaligned_frames), (1, 1, 0));
        let json = serde_json::to_value(&with).unwrap();
        for key in [
            "joint_mean_mm",
            "joint_max_mm",
            "misaligned_frames",
            "iou_mean",
            "local_ms_per_frame",
            "global_ms_per_frame",
            "frames",
            "fit_shape_s",
        ] {
            assert!(json[key].is_number(), "{key}");
        }
        assert_eq!(json["per_frame"][2]["stage"], "particles");
    }
}
