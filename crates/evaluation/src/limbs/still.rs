use std::sync::Arc;

use body::{BodyModel, Posed, Shape};
use inverse_kinematics::{Evidence, ImageView, Outcome, Solver, Support};
use model::Silhouette;
use nalgebra::Vector3;
use vision::{DistanceField, Rasteriser, Topology, View};

use super::{FollowedLimb, Limbs, Method, cameras, heading, limb};
use crate::Result;
use crate::recording::{LIMBS, rig_joints};

/// One limb in one frame, to be solved again and again from the same start: what is timed.
#[derive(Debug, Clone)]
pub struct Still {
    solver: Solver,
    start: Vec<f64>,
    x: Vec<f64>,
    targets: Vec<Option<Vector3<f64>>>,
    views: Vec<ImageView>,
    posture: Vec<f64>,
}

impl Still {
    /// The left limb of a body in `pose` (shape `[dofs of the rig]`), its inner joint 0.4 rad away from where the method
    /// finds it and its end 5 cm away from its target. Solves take all the method's steps.
    ///
    /// # Errors
    /// If the method's options don't fit the limb.
    pub fn new(
        model: &BodyModel,
        shape: &Shape,
        pose: &[f64],
        limbs: Limbs,
        method: &Method,
    ) -> Result<Self> {
        let index = limbs.indices()[0];
        let mut posed = Posed::default();
        shape.pose(model, pose, &mut posed);
        let topology = Topology::new(model.faces(), model.num_vertices());
        let mut rasteriser = Rasteriser::new();
        let [base, _, end] = rig_joints(model, LIMBS[index].1)?.map(|joint| posed.joints[joint]);
        let cameras = cameras();
        let views = method.cameras.iter().map(|&camera| {
            let camera = cameras[camera].clone();
            let view = View::new(&camera);
            let mut silhouette = Silhouette::empty(view.size[0], view.size[1]);
            rasteriser.silhouette(&view, &posed.vertices, &topology, &mut silhouette);
            let field = Arc::new(DistanceField::new(&silhouette, 1));
            let support = Support::seen_at(field, &camera, &base, method.width);
            ImageView { camera, support }
        });
        let views: Vec<_> = views.collect();
        let mut limb = FollowedLimb::new(model, shape, limbs, index, method)?;
        limb.solve(&base, &end, heading(model, limbs, &posed)?, &views)?;
        let FollowedLimb { limb, solver, x: mut start, posture, .. } = limb;
        limb.swivel(&mut start, &(end - base), 0.4);
        let mut targets = vec![None; solver.chain().points().len()];
        targets[limb::END] = Some(end + Vector3::repeat(0.03));
        Ok(Self { x: start.clone(), solver, start, targets, views, posture })
    }

    /// Solves it once; takes no memory.
    ///
    /// # Errors
    /// As [`Solver::solve`].
    pub fn solve(&mut self) -> Result<Outcome> {
        self.x.copy_from_slice(&self.start);
        let evidence = Evidence { targets: &self.targets, views: &self.views, posture: &self.posture };
        Ok(self.solver.solve(&mut self.x, &evidence)?)
    }
}
