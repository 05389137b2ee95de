//! A picture of a reconstruction: figures side by side, as time goes by.

use std::fmt::Write;

use kinematics::{Kinematics, Parametrisation};
use model::{Motion, PointTrajectories};
use nalgebra::Vector3;

/// Figures that are drawn.
const FIGURES: usize = 7;
/// Width and height of the picture, and the height at which the floor is drawn, pixels.
const SIZE: (f64, f64) = (1000.0, 360.0);
const FLOOR: f64 = 320.0;
/// Left free on both sides, pixels.
const MARGIN: f64 = 20.0;
/// Largest scale; people who go far are drawn smaller.
const PIXELS_PER_METRE: f64 = 150.0;
/// Distance between the figures beyond what was walked, metres.
const SPREAD_M: f64 = 0.35;
/// Those who go less far than this are seen along the z axis, metres.
const STANDING_M: f64 = 0.1;
/// Places nearer than this are the same, metres.
const SAME_M: f64 = 1e-6;

/// Measured points (red), the motion found from them (blue) and the true one (grey, behind it).
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// the motion that really was
    pub truth: &'a Motion,
    /// the motion that was found; its frames are those drawn
    pub found: &'a Motion,
    /// what it was found from, metres
    pub points: &'a PointTrajectories,
    /// one line of text below it
    pub caption: &'a str,
}

impl Picture<'_> {
    /// As SVG: from the side, along the direction walked, in seven moments from the first frame to the last.
    pub fn svg(&self) -> String {
        let (width, height) = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n<path d=\"M{MARGIN} {FLOOR}H{}\" stroke=\"#ccc\"/>\n",
            width - MARGIN
        );
        let view = View::new(self.truth);
        let last = self.found.num_frames().saturating_sub(1);
        for figure in 0..FIGURES {
            let frame = figure * last / (FIGURES - 1);
            let at = |rate: f64, frames: usize| {
                let same_time = frame as f64 / self.found.frame_rate() * rate;
                (same_time.round() as usize).min(frames.saturating_sub(1))
            };
            let project = |point| view.project(point, figure);
            let true_frame = at(self.truth.frame_rate(), self.truth.num_frames());
            draw_bones(&mut svg, self.truth, true_frame, "#bbb", 9.0, &project);
            draw_bones(&mut svg, self.found, frame, "#1c6dd0", 3.0, &project);
            let measured = at(self.points.frame_rate(), self.points.num_frames());
            for point in self.points.frame(measured).iter().filter(|point| point.x.is_finite()) {
                let (x, y) = project(*point);
                let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#e8442e\"/>");
            }
        }
        let caption = self.caption.replace('&', "&amp;").replace('<', "&lt;");
        let _ = writeln!(
            svg,
            "<text x=\"{MARGIN}\" y=\"346\" font-size=\"14\" fill=\"#444\">{caption}</text>\n</svg>"
        );
        svg
    }
}

/// From where it is seen.
struct View {
    /// the root in the first frame, metres
    first: Vector3<f64>,
    /// to the right of the picture
    along: Vector3<f64>,
    left: f64,
    pixels_per_metre: f64,
}

impl View {
    fn new(truth: &Motion) -> Self {
        let (first, last) = (root(truth, 0), root(truth, truth.num_frames().saturating_sub(1)));
        let way = Vector3::new(last.x - first.x, 0.0, last.z - first.z);
        let along = if way.norm() < STANDING_M { Vector3::x() } else { way.normalize() };
        let length = way.norm() + SPREAD_M * (FIGURES - 1) as f64;
        // somebody's arms stick out of the way
        let pixels_per_metre = PIXELS_PER_METRE.min((SIZE.0 - 2.0 * MARGIN) / (length + 0.5));
        Self { first, along, left: (SIZE.0 - length * pixels_per_metre) / 2.0, pixels_per_metre }
    }

    /// Where a point of the nth figure is drawn, pixels.
    fn project(&self, point: Vector3<f64>, figure: usize) -> (f64, f64) {
        let x = (point - self.first).dot(&self.along) + SPREAD_M * figure as f64;
        (self.left + x * self.pixels_per_metre, FLOOR - point.y * self.pixels_per_metre)
    }
}

fn root(motion: &Motion, frame: usize) -> Vector3<f64> {
    bones(motion, frame).first().map_or(Vector3::zeros(), |(from, _)| *from)
}

/// Both ends of every bone in a frame, in world space, metres; the first begins at the root. Bones lead from joints to their
/// tips, and to children that sit elsewhere than there, as in BVH files.
pub fn bones(motion: &Motion, frame: usize) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let skeleton = motion.skeleton();
    let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
    let mut state = kinematics.state();
    kinematics.update(motion.pose(frame), &mut state);
    let joints = skeleton.joints();
    let mut bones = Vec::with_capacity(joints.len());
    for (j, joint) in joints.iter().enumerate() {
        if let Some(parent) =
            joint.parent.filter(|&parent| (joints[parent].tip - joint.offset).norm() > SAME_M)
        {
            bones.push((state.positions[parent], state.positions[j]));
        }
        bones.push((state.positions[j], state.point(j, &joint.tip)));
    }
    bones
}

fn draw_bones(
    svg: &mut String,
    motion: &Motion,
    frame: usize,
    colour: &str,
    width: f64,
    project: &dyn Fn(Vector3<f64>) -> (f64, f64),
) {
    for (from, to) in bones(motion, frame) {
        let ((x1, y1), (x2, y2)) = (project(from), project(to));
        let _ = writeln!(
            svg,
            "<path d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>"
        );
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use model::Skeleton;
    use sample_motion::{Action, DrawOptions, Model};

    use super::*;
    use crate::control_trajectories;

    /// Numbers of an attribute in the order of the file.
    fn numbers(svg: &str, attribute: &str) -> Vec<f64> {
        let before = format!(" {attribute}=\"");
        let parts = svg.split(&before).skip(1);
        parts.map(|part| part.split('"').next().unwrap().parse().unwrap()).collect()
    }

    #[test]
    fn every_measured_point_of_seven_moments_is_in_the_picture_however_far_they_run() {
        for action in Action::ALL {
            let options = DrawOptions { frames: 240, subject: 1 };
            let motion = Model::bundled().draw(action, 7, &options).unwrap();
            let points = control_trajectories(&motion, &["left_wrist", "head"]).unwrap();
            let picture = Picture { truth: &motion, found: &motion, points: &points, caption: "a < b & c" };
            let svg = picture.svg();
            let (x, y) = (numbers(&svg, "cx"), numbers(&svg, "cy"));
            assert_eq!((x.len(), y.len()), (14, 14));
            assert!(x.iter().all(|x| (0.0..=1000.0).contains(x)), "{action}: {x:?}");
            assert!(y.iter().all(|y| (0.0..=FLOOR).contains(y)), "{action}: {y:?}");
            assert!(svg.contains(">a &lt; b &amp; c</text>") && svg.ends_with("</svg>\n"));
        }
    }

    #[test]
    fn joints_without_tips_are_joined_to_their_children() {
        let options = DrawOptions { frames: 8, subject: 1 };
        let motion = Model::bundled().draw(Action::Walk, 7, &options).unwrap();
        // as BVH files have them
        let mut joints = motion.skeleton().joints().to_vec();
        joints.iter_mut().for_each(|joint| joint.tip = Vector3::zeros());
        let bare = Arc::new(Skeleton::new("bare", joints).unwrap());
        let bare = Motion::new(bare, motion.frame_rate(), motion.values().to_vec()).unwrap();
        let long = |motion: &Motion| -> Vec<(Vector3<f64>, Vector3<f64>)> {
            bones(motion, 5).into_iter().filter(|(from, to)| (to - from).norm() > 0.01).collect()
        };
        let (own, found) = (long(&motion), long(&bare));
        assert!(found.len() > 15, "{}", found.len());
        for (from, to) in &found {
            let is_same = |(a, b): &(Vector3<f64>, Vector3<f64>)| (a - from).norm() + (b - to).norm() < 1e-9;
            assert!(own.iter().any(is_same), "{from} {to}");
        }
    }

    #[test]
    fn frames_of_other_rates_are_those_of_the_same_time() {
        let options = DrawOptions { frames: 241, subject: 1 };
        let truth = Model::bundled().draw(Action::Walk, 7, &options).unwrap();
        let half: Vec<f64> = truth.poses().step_by(2).flatten().copied().collect();
        let found = Motion::new(truth.skeleton().clone(), 30.0, half).unwrap();
        let points = control_trajectories(&truth, &["head"]).unwrap();
        let picture = |found| Picture { truth: &truth, found, points: &points, caption: "" }.svg();
        assert_eq!(picture(&found), picture(&truth));
    }
}
