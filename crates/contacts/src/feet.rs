use kinematics::{ControlPoint, Kinematics, Parametrisation, PointSet, control_points};
use model::{Motion, Skeleton};
use nalgebra::Vector3;

use crate::{Contacts, Error, Result};

/// Points of both feet: left ankle, left ball, right ankle, right ball.
pub const POINTS: usize = 4;

/// Ankle and ball of both feet, in the order left ankle, left ball, right ankle, right ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Feet {
    points: [ControlPoint; POINTS],
}

impl Feet {
    /// The feet of a skeleton: the ankles are the control points of that name, the ball is where the next joint hangs from
    /// the foot or, without one, the end of its bone.
    ///
    /// # Errors
    /// [`Error::NoFoot`] if an ankle is not known or nothing hangs from it.
    pub fn find(skeleton: &Skeleton) -> Result<Self> {
        let [left, right] = [("left_ankle", "left"), ("right_ankle", "right")].map(|(name, side)| {
            let missing = || Error::NoFoot { skeleton: skeleton.name().to_owned(), side };
            let ankle =
                control_points(skeleton, &[name]).ok().and_then(|mut p| p.pop()).ok_or_else(missing)?;
            let child = skeleton.joints().iter().find(|j| j.parent == Some(ankle.joint));
            let tip = child.map_or(skeleton.joints()[ankle.joint].tip, |child| child.offset);
            if tip.norm() < 1e-3 {
                return Err(missing());
            }
            let ball = ControlPoint { name: format!("{side}_ball"), joint: ankle.joint, offset: tip };
            Ok((ankle, ball))
        });
        let ((left_ankle, left_ball), (right_ankle, right_ball)) = (left?, right?);
        Ok(Self { points: [left_ankle, left_ball, right_ankle, right_ball] })
    }

    /// The points.
    pub fn points(&self) -> &[ControlPoint; POINTS] {
        &self.points
    }

    /// Paths of the points in a motion on the same skeleton.
    pub fn tracks(&self, motion: &Motion) -> FootTracks {
        let skeleton = motion.skeleton();
        let kinematics = Kinematics::new(skeleton, Parametrisation::channels(skeleton));
        let points = PointSet::new(&kinematics, self.points.to_vec());
        let mut state = kinematics.state();
        let mut positions = vec![[Vector3::zeros(); POINTS]; motion.num_frames()];
        for (pose, out) in motion.poses().zip(&mut positions) {
            points.positions(&kinematics, pose, &mut state, out);
        }
        FootTracks { frame_rate: motion.frame_rate(), positions }
    }
}

/// Paths of the points of both feet.
#[derive(Debug, Clone, PartialEq)]
pub struct FootTracks {
    /// frames per second
    pub frame_rate: f64,
    /// metres, y up, in the order of [`Feet::points`]; not a number where it is not known; shape `[frames]`
    pub positions: Vec<[Vector3<f64>; POINTS]>,
}

impl FootTracks {
    /// Mean speed over the floor of the points that stand according to `contacts` (which may be those of another motion,
    /// such as the true one), centimetres a second; `None` if none stands for two frames.
    pub fn slide_cm_s(&self, contacts: &Contacts) -> Option<f64> {
        let (mut sum, mut count) = (0.0, 0.0);
        for contact in contacts.all() {
            let end = contact.frames.end.min(self.positions.len());
            for frame in contact.frames.start + 1..end {
                let speed = self.step_cm_s(frame, contact.point);
                if speed.is_finite() {
                    sum += speed;
                    count += 1.0;
                }
            }
        }
        (count > 0.0).then(|| sum / count)
    }

    /// Speed over the floor from the frame before to `frame` of the fastest point that stands in both, centimetres a
    /// second; `None` if none does. Shape `[frames]`.
    pub fn slides_cm_s(&self, contacts: &Contacts) -> Vec<Option<f64>> {
        let mut slides = vec![None; self.positions.len()];
        for contact in contacts.all() {
            let end = contact.frames.end.min(self.positions.len());
            let begin = contact.frames.start + 1;
            let standing = slides.iter_mut().enumerate().take(end).skip(begin);
            for (frame, slide) in standing {
                let speed = self.step_cm_s(frame, contact.point);
                let slide: &mut Option<f64> = slide;
                *slide = Some(slide.map_or(speed, |other| other.max(speed)));
            }
        }
        slides
    }

    fn step_cm_s(&self, frame: usize, point: usize) -> f64 {
        let step = self.positions[frame][point] - self.positions[frame - 1][point];
        step.x.hypot(step.z) * self.frame_rate * 100.0
    }
}
