//! Which limbs are not where the silhouettes say.

use body::{BodyModel, Limb, ROOT_DOFS};
use model::Silhouette;
use nalgebra::{Vector2, Vector3};
use rayon::prelude::*;
use vision::{Rasteriser, RimPoint, Topology, find_rim};

use crate::{ObservedFrame, observed_frame::ObservedView};

/// Every how manyth vertex is looked at.
const EVERY: usize = 4;
/// Contours that are farther than this outside the rim of the drawn body are explained by no part of it, metres.
const UNEXPLAINED_M: f64 = 0.03;
/// Farther than this counts no more, metres: what is there may be no part of the person.
const FARTHEST_M: f64 = 0.30;
/// Length of outline, metres, over which what is unexplained is spread: that of a forearm.
const LIMB_OUTLINE_M: f64 = 0.5;
/// How far a point just outside the rim is looked at, pixels.
const REACH_PX: f64 = 1.5;

/// How a limb fits the silhouettes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimbError {
    /// which limb
    pub limb: Limb,
    /// mean of the two views where it is largest, metres; in a view, the larger of: how far the limb's surface lies outside
    /// the observed silhouette on average, and how much of the observed contours nothing drawn explains
    pub error_m: f64,
    /// its own error is above the threshold, or that of a limb it hangs from
    pub is_misaligned: bool,
}

/// How all limbs fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Misalignment {
    /// in the order of [`Limb::ALL`]
    pub limbs: [LimbError; 10],
}

impl Misalignment {
    /// From each limb's error, metres: a limb above the threshold marks all limbs below it in the tree.
    pub fn from_errors(errors: [f64; 10], threshold_m: f64) -> Self {
        let mut limbs = Limb::ALL.map(|limb| LimbError { limb, error_m: 0.0, is_misaligned: false });
        for i in 0..limbs.len() {
            // parents come first
            let inherited =
                limbs[i].limb.parent().is_some_and(|parent| limbs[position(parent)].is_misaligned);
            limbs[i].error_m = errors[i];
            limbs[i].is_misaligned = inherited || errors[i] > threshold_m;
        }
        Self { limbs }
    }

    /// True if a limb is misaligned.
    pub fn any(&self) -> bool {
        self.limbs.iter().any(|limb| limb.is_misaligned)
    }

    /// The misaligned limbs, parents first.
    pub fn misaligned(&self) -> impl Iterator<Item = Limb> {
        self.limbs.iter().filter(|limb| limb.is_misaligned).map(|limb| limb.limb)
    }

    /// The largest error, metres.
    pub fn worst_m(&self) -> f64 {
        self.limbs.iter().map(|limb| limb.error_m).fold(0.0, f64::max)
    }

    /// Sum of all errors, metres: what is less is the better pose.
    pub fn total_m(&self) -> f64 {
        self.limbs.iter().map(|limb| limb.error_m).sum()
    }

    /// Indices of the DOFs that move misaligned limbs: their own, and the twist of the limb above, which only shows in them; all
    /// DOFs if the torso is misaligned.
    pub fn dofs(&self, model: &BodyModel) -> Vec<usize> {
        let limbs = Limb::for_joints(model.rig());
        let is_misaligned = |limb: Limb| self.limbs[position(limb)].is_misaligned;
        let all = model.rig().dofs().iter().enumerate();
        let is_wanted = |(d, dof): &(usize, &body::Dof)| {
            let limb = limbs[dof.joint];
            let is_below = |below: &Limb| below.parent() == Some(limb) && is_misaligned(*below);
            is_misaligned(limb)
                || *d >= ROOT_DOFS && dof.name.ends_with("twist") && Limb::ALL.iter().any(is_below)
        };
        all.filter(is_wanted).map(|(d, _)| d).collect()
    }
}

fn position(limb: Limb) -> usize {
    Limb::ALL.iter().position(|other| *other == limb).unwrap_or_default()
}

/// Measures a posed body; keeps the buffers of every view.
#[derive(Debug, Default)]
pub struct Judge {
    views: Vec<Buffers>,
}

#[derive(Debug, Default)]
struct Buffers {
    rasteriser: Rasteriser,
    drawn: Option<Silhouette>,
    rim: Vec<RimPoint>,
    /// limb and pixel of vertices
    seen: Vec<(usize, Vector2<f64>)>,
}

impl Judge {
    /// Errors of all limbs, metres, in the order of [`Limb::ALL`].
    pub fn errors(
        &mut self,
        model: &BodyModel,
        topology: &Topology,
        frame: &ObservedFrame,
        vertices: &[Vector3<f64>],
    ) -> [f64; 10] {
        self.views.resize_with(frame.views.len().max(self.views.len()), Buffers::default);
        let found: Vec<[f64; 10]> = frame
            .views
            .par_iter()
            .zip(&mut self.views)
            .map(|(view, buffers)| buffers.errors(model, topology, view, vertices))
            .collect();
        std::array::from_fn(|limb| {
            let (mut first, mut second) = (0.0f64, 0.0f64);
            for error in found.iter().map(|errors| errors[limb]) {
                second = second.max(error.min(first));
                first = first.max(error);
            }
            if found.len() < 2 { first } else { (first + second) / 2.0 }
        })
    }
}

impl Buffers {
    fn errors(
        &mut self,
        model: &BodyModel,
        topology: &Topology,
        view: &ObservedView,
        vertices: &[Vector3<f64>],
    ) -> [f64; 10] {
        let level = &view.observation.levels[0];
        let focal = level.view.camera.focal.mean();
        // of the limb's surface, outside
        let (mut sums, mut counts) = ([0.0; 10], [0usize; 10]);
        let mut depths = 0.0;
        self.seen.clear();
        let sampled = vertices.iter().zip(model.limbs()).step_by(EVERY);
        for (vertex, &limb) in sampled {
            let limb = position(limb);
            let Some((pixel, depth)) = view.reduced.project(vertex) else { continue };
            if !view.observed.distances().contains(pixel) {
                continue;
            }
            let outside = (-view.observed.distances().sample(pixel)).max(0.0);
            let metres = depth / view.reduced.camera.focal.mean();
            sums[limb] += (outside * metres).min(FARTHEST_M);
            counts[limb] += 1;
            depths += depth;
            self.seen.push((limb, pixel));
        }
        let mut errors: [f64; 10] = std::array::from_fn(|limb| sums[limb] / counts[limb].max(1) as f64);
        if self.seen.is_empty() {
            return errors;
        }
        let drawn = self.drawn.get_or_insert_with(|| Silhouette::empty(0, 0));
        self.rasteriser.silhouette(&level.view, vertices, topology, drawn);
        find_rim(&level.view, vertices, topology, drawn, REACH_PX, &mut self.rim);
        let metres = depths / self.seen.len() as f64 / focal;
        let to_reduced = level.view.scale as f64 / view.reduced.scale as f64;
        let mut unexplained = [0.0; 10];
        for pixel in &level.outline.pixels {
            // the outlines of holes in the silhouette lie on the body
            if drawn.contains(pixel.x.round() as isize, pixel.y.round() as isize) {
                continue;
            }
            let distances = self.rim.iter().map(|point| (point.pixel - pixel).norm_squared());
            let nearest = distances.fold(f64::INFINITY, f64::min);
            let miss = (nearest.sqrt() * metres).min(FARTHEST_M) - UNEXPLAINED_M;
            if miss > 0.0 {
                let limb = limb_at(&self.seen, &(pixel * to_reduced));
                unexplained[limb] += miss * level.outline.step_px * metres / LIMB_OUTLINE_M;
            }
        }
        errors.iter_mut().zip(unexplained).for_each(|(error, unexplained)| *error = error.max(unexplained));
        errors
    }
}

/// The limb that reaches nearest to a pixel, of vertices with their limbs. The torso doesn't reach out of itself: what sticks
/// out is a limb.
fn limb_at(seen: &[(usize, Vector2<f64>)], pixel: &Vector2<f64>) -> usize {
    let limbs = seen.iter().filter(|(limb, _)| *limb != 0);
    let nearest = limbs.min_by(|a, b| (a.1 - pixel).norm_squared().total_cmp(&(b.1 - pixel).norm_squared()));
    nearest.map_or(0, |(limb, _)| *limb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misaligned_limb_marks_all_below_it_and_their_dofs() {
        let model = BodyModel::shipped();
        let mut errors = [0.0; 10];
        errors[position(Limb::LeftUpperArm)] = 0.05;
        let found = Misalignment::from_errors(errors, 0.03);
        assert_eq!(found.misaligned().collect::<Vec<_>>(), [Limb::LeftUpperArm, Limb::LeftLowerArm]);
        let names: Vec<_> = found.dofs(&model).iter().map(|&d| model.rig().dofs()[d].name.clone()).collect();
        assert!(names.len() == 4 && names.iter().all(|name| name.starts_with("l_")), "{names:?}");
        errors[0] = 0.04;
        let whole = Misalignment::from_errors(errors, 0.03);
        assert_eq!(whole.dofs(&model).len(), model.rig().num_dofs());
        assert_eq!(whole.misaligned().count(), 10);
    }

    #[test]
    fn a_forearm_is_searched_with_the_twist_above_it() {
        let model = BodyModel::shipped();
        let mut errors = [0.0; 10];
        errors[position(Limb::RightLowerArm)] = 0.05;
        let found = Misalignment::from_errors(errors, 0.03);
        let names: Vec<_> = found.dofs(&model).iter().map(|&d| model.rig().dofs()[d].name.clone()).collect();
        assert_eq!(names, ["r_shoulder_twist", "r_elbow"]);
    }
}
