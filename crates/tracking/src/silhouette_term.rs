use body::{BodyModel, Posed, Shape};
use model::Silhouette;
use vision::{Chamfer, Rasteriser, Topology};

use crate::ObservedFrame;

/// E_S: how far the drawn body's silhouettes are from the observed ones (docs/papers.md#particle-search, eq. 11),
/// both ways, the mean of all views. Keeps its buffers: once it has seen a frame's sizes, it takes no memory.
#[derive(Debug, Default)]
pub struct SilhouetteTerm {
    posed: Posed,
    rasteriser: Rasteriser,
    /// of every view
    drawn: Vec<Silhouette>,
    chamfer: Chamfer,
}

impl SilhouetteTerm {
    /// E_S of a pose, millimetres at the distance of the person.
    ///
    /// # Panics
    /// As [`Shape::pose`].
    pub fn energy_mm(
        &mut self,
        model: &BodyModel,
        topology: &Topology,
        shape: &Shape,
        frame: &ObservedFrame,
        pose: &[f64],
    ) -> f64 {
        shape.pose(model, pose, &mut self.posed);
        self.drawn.resize_with(frame.views.len().max(self.drawn.len()), || Silhouette::empty(0, 0));
        let mut sum = 0.0;
        for (view, drawn) in frame.views.iter().zip(&mut self.drawn) {
            let bounds = self.rasteriser.silhouette(&view.reduced, &self.posed.vertices, topology, drawn);
            let depth = (self.posed.joints[0] - view.reduced.position).norm();
            let pixel_mm = 1000.0 * depth / view.reduced.camera.focal.mean();
            sum += self.chamfer.difference(drawn, bounds, &view.observed).symmetric_px() * pixel_mm;
        }
        sum / frame.views.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use model::Mesh;
    use vision::scene::{Ring, silhouettes};

    use super::*;

    #[test]
    fn the_true_pose_costs_least_and_a_warm_term_takes_no_memory() {
        let model = BodyModel::shipped();
        let topology = Topology::new(model.faces(), model.num_vertices());
        let shape = model.shape(&[0.5, -0.5]);
        let truth = vec![0.0; model.rig().num_dofs()];
        let mut posed = Posed::default();
        shape.pose(&model, &truth, &mut posed);
        let mesh = Mesh::new(posed.vertices.clone(), model.faces().to_vec()).unwrap();
        let cameras = Ring { cameras: 3, size: 502, focal: 663.0, ..Ring::default() }.cameras();
        let views: Vec<_> = cameras.iter().cloned().zip(silhouettes(&mesh, &cameras)).collect();
        let frame = ObservedFrame::new(0, &views).unwrap();
        let mut term = SilhouetteTerm::default();
        let mut energy = |degrees: f64| {
            let mut pose = truth.clone();
            pose[model.rig().dof_index("l_shoulder_abd").unwrap()] += degrees.to_radians();
            term.energy_mm(&model, &topology, &shape, &frame, &pose)
        };
        let [right, near, far] = [0.0, 20.0, 60.0].map(&mut energy);
        assert!(right < 0.5 && near > right + 1.0 && far > near + 1.0, "{right} {near} {far}");
        let mut pose = truth.clone();
        let taken = allocation_counter::measure(|| {
            pose[6] += 0.1;
            term.energy_mm(&model, &topology, &shape, &frame, &pose);
        });
        assert_eq!(taken.count_total, 0);
    }
}
