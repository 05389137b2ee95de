//! A body over what a camera saw.

use body::{BodyModel, Limb};
use model::{Camera, Image, Silhouette};
use nalgebra::Vector3;
use tracking::{Stage, Tracked};
use vision::{Rasteriser, Topology, View};

/// Colour of a body that fits.
pub(crate) const FITS: [u8; 3] = [0, 255, 120];
/// Colour of a body that particles had to find.
const SEARCHED: [u8; 3] = [70, 170, 255];
/// Colour of a body with misaligned limbs.
const DOUBTFUL: [u8; 3] = [255, 200, 0];
/// Colour of its misaligned limbs.
const MISALIGNED: [u8; 3] = [255, 40, 40];

/// Draws bodies of a model into the pictures of one camera.
pub(crate) struct Drawer {
    view: View,
    whole: Topology,
    /// in the order of [`Limb::ALL`]
    limbs: Vec<Topology>,
    rasteriser: Rasteriser,
    drawn: Silhouette,
}

impl Drawer {
    pub fn new(model: &BodyModel, camera: &Camera) -> Self {
        let topology = |limb: Limb| {
            let is_own = |face: &&[u32; 3]| face.iter().any(|&corner| model.limbs()[corner as usize] == limb);
            let faces: Vec<[u32; 3]> = model.faces().iter().filter(is_own).copied().collect();
            Topology::new(&faces, model.num_vertices())
        };
        let size = camera.size.map(|side| side as usize);
        Self {
            view: View::new(camera),
            whole: Topology::new(model.faces(), model.num_vertices()),
            limbs: Limb::ALL.map(topology).into(),
            rasteriser: Rasteriser::new(),
            drawn: Silhouette::empty(size[0], size[1]),
        }
    }

    /// The outline of a posed body, metres.
    pub fn outline(&mut self, picture: &mut Image, vertices: &[Vector3<f64>], colour: [u8; 3]) {
        self.rasteriser.silhouette(&self.view, vertices, &self.whole, &mut self.drawn);
        shape_fit::draw_outline(picture, &self.drawn, colour);
    }

    /// The outline of a body that was followed, in the colour of what gave its pose, and its misaligned limbs. Nothing where
    /// nobody was found.
    pub fn tracked(&mut self, picture: &mut Image, vertices: &[Vector3<f64>], tracked: &Tracked) {
        let colour = match tracked.stage {
            Stage::Unseen => return,
            Stage::Local => FITS,
            Stage::Particles => SEARCHED,
            Stage::Misaligned => DOUBTFUL,
        };
        self.outline(picture, vertices, colour);
        for (limb, topology) in tracked.misalignment.limbs.iter().zip(&self.limbs) {
            if limb.is_misaligned {
                self.rasteriser.silhouette(&self.view, vertices, topology, &mut self.drawn);
                shape_fit::draw_outline(picture, &self.drawn, MISALIGNED);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use body::Posed;
    use tracking::Misalignment;
    use vision::scene::Ring;

    #[test]
    fn misaligned_limbs_are_red_and_nobody_is_drawn_where_nobody_was_found() {
        let model = BodyModel::shipped();
        let shape = model.shape(&[]);
        let mut posed = Posed::default();
        let pose = vec![0.0; model.rig().num_dofs()];
        shape.pose(&model, &pose, &mut posed);
        let camera = Ring { cameras: 2, size: 200, focal: 260.0, ..Ring::default() }.cameras().remove(0);
        let mut drawer = Drawer::new(&model, &camera);
        let mut errors = [0.0; 10];
        errors[3] = 0.1;
        let mut tracked = Tracked {
            frame: 0,
            pose,
            joints: posed.joints.clone(),
            ious: vec![Some(0.5)],
            misalignment: Misalignment::from_errors(errors, 0.01),
            stage: Stage::Misaligned,
            effective_sample_size: None,
        };
        let mut count = |tracked: &Tracked, colour: [u8; 3]| {
            let mut picture = Image::black(200, 200);
            drawer.tracked(&mut picture, &posed.vertices, tracked);
            picture.rgb().chunks(3).filter(|pixel| *pixel == colour).count()
        };
        let (doubtful, red) = (count(&tracked, DOUBTFUL), count(&tracked, MISALIGNED));
        assert!(doubtful > 100 && red > 20 && red < doubtful, "{doubtful} {red}");
        tracked.stage = Stage::Unseen;
        assert_eq!(count(&tracked, [0, 0, 0]), 200 * 200);
    }
}
