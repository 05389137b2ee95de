use model::Mesh;
use nalgebra::Vector3;

use crate::population::Population;
use crate::{Error, JointRegressor, Limb, Result, Rig, Skin};

/// Most principal components of a model.
pub const MAX_COMPONENTS: usize = 20;
/// Most vertices of a model: faces are stored in 16 bits.
pub const MAX_VERTICES: usize = 1 << 16;

/// Largest coordinate of a vertex, metres: what is larger is not a person.
const MOST_M: f64 = 10.0;

/// What a model is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelParts {
    /// who it was learned from and by whom, for people to read
    pub description: String,
    /// corners of every triangle, counter-clockwise seen from outside
    pub faces: Vec<[u32; 3]>,
    /// m₀: the mean, metres, shape `[vertices]`
    pub mean: Vec<Vector3<f64>>,
    /// m_i: displacements of one standard deviation, metres, shape `[components, vertices]`
    pub components: Vec<Vec<Vector3<f64>>>,
    /// share of the population's variance that the first 1, 2, … components keep, shape `[components]`
    pub variance_kept: Vec<f64>,
    /// joints and degrees of freedom
    pub rig: Rig,
    /// joints from vertices
    pub regressor: JointRegressor,
    /// what moves the vertices
    pub skin: Skin,
}

/// A morphable body; immutable.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyModel {
    pub(crate) description: String,
    pub(crate) faces: Vec<[u32; 3]>,
    /// of single precision, as in the file
    pub(crate) mean: Vec<Vector3<f64>>,
    pub(crate) components: Vec<Component>,
    pub(crate) variance_kept: Vec<f64>,
    pub(crate) rig: Rig,
    pub(crate) regressor: JointRegressor,
    pub(crate) skin: Skin,
    pub(crate) joint_mean: Vec<Vector3<f64>>,
    /// displacements of the joints for one standard deviation, metres, shape `[components, joints]`
    pub(crate) joint_components: Vec<Vec<Vector3<f64>>>,
    limbs: Vec<Limb>,
    /// how measurements and shape go together among the people it was learned from
    pub(crate) population: Population,
}

/// One principal component, in 16 bits a number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Component {
    /// metres a step; of single precision, as in the file
    pub scale: f64,
    /// shape `[vertices]`
    pub steps: Vec<[i16; 3]>,
}

impl Component {
    fn new(displacements: &[Vector3<f64>]) -> Self {
        let largest = displacements.iter().fold(0.0, |most: f64, d| most.max(d.amax()));
        let scale = f64::from((largest / f64::from(i16::MAX)) as f32);
        // A cast to an integer saturates, so a scale rounded down does no harm.
        let step = |x: f64| if scale > 0.0 { (x / scale).round() as i16 } else { 0 };
        Self { scale, steps: displacements.iter().map(|d| [step(d.x), step(d.y), step(d.z)]).collect() }
    }

    /// Displacement of a vertex for one standard deviation, metres.
    pub fn displacement(&self, vertex: usize) -> Vector3<f64> {
        Vector3::from(self.steps[vertex].map(f64::from)) * self.scale
    }
}

/// Whether all coordinates are finite and no larger than a person's.
fn is_near(v: &Vector3<f64>) -> bool {
    // Not by `amax`, which passes over what is not a number.
    v.iter().all(|x| x.abs() <= MOST_M)
}

impl BodyModel {
    /// Checks that the parts fit together, and rounds the numbers as the file does: a model that was written and read
    /// is the same to the bit.
    ///
    /// # Errors
    /// [`Error::Model`] names the first part that is wrong.
    pub fn new(parts: ModelParts) -> Result<Self> {
        let components = parts.components.iter();
        if let Some((index, bad)) = components.enumerate().find(|(_, c)| c.len() != parts.mean.len()) {
            let what = format!(
                "component {index} has {} vertices, expected the mean's {}",
                bad.len(),
                parts.mean.len()
            );
            return Err(Error::Model { what });
        }
        if parts.components.iter().flatten().any(|d| !is_near(d)) {
            let what = format!("a component moves a vertex by more than {MOST_M} m or not finitely");
            return Err(Error::Model { what });
        }
        let components = parts.components.iter().map(|c| Component::new(c)).collect();
        Self::assemble(parts, components)
    }

    /// The same with components that are rounded already; those of `parts` are not looked at.
    pub(crate) fn assemble(parts: ModelParts, components: Vec<Component>) -> Result<Self> {
        let ModelParts { description, faces, mean, components: _, variance_kept, rig, regressor, skin } =
            parts;
        let n = mean.len();
        let fail = |what: String| Err(Error::Model { what });
        if n == 0 || n > MAX_VERTICES || components.len() > MAX_COMPONENTS {
            return fail(format!(
                "{n} vertices and {} components, expected 1 to {MAX_VERTICES} and at most {MAX_COMPONENTS}",
                components.len()
            ));
        }
        if let Some(vertex) = mean.iter().position(|v| !is_near(v)) {
            return fail(format!("vertex {vertex} of the mean is beyond {MOST_M} m"));
        }
        if let Some(face) = faces.iter().position(|face| face.iter().any(|&corner| corner as usize >= n)) {
            return fail(format!("face {face} has corners {:?}, expected indices below {n}", faces[face]));
        }
        if skin.num_vertices() != n || regressor.num_joints() != rig.num_joints() {
            return fail(format!(
                "skin of {} vertices and regressor of {} joints, expected {n} and {}",
                skin.num_vertices(),
                regressor.num_joints(),
                rig.num_joints()
            ));
        }
        let joints = 0..rig.num_joints();
        let is_beyond = |vertex: u32| vertex as usize >= n;
        if joints.clone().any(|j| regressor.row(j).iter().any(|(vertex, _)| is_beyond(*vertex)))
            || skin.joints().iter().flatten().any(|&joint| usize::from(joint) >= rig.num_joints())
        {
            return fail("skin or regressor are those of another mesh or rig".into());
        }
        if variance_kept.len() != components.len() || variance_kept.iter().any(|kept| !kept.is_finite()) {
            return fail(format!(
                "variances kept of {} components, expected {}",
                variance_kept.len(),
                components.len()
            ));
        }
        let mean: Vec<_> = mean.iter().map(|v| v.map(|x| f64::from(x as f32))).collect();
        let joint_mean = regressor.joints(&mean);
        let joint_displacements = |c: &Component| -> Vec<_> {
            joints.clone().map(|joint| regressor.joint(joint, |vertex| c.displacement(vertex))).collect()
        };
        let joint_components = components.iter().map(joint_displacements).collect();
        let limbs_of_joints = Limb::for_joints(&rig);
        let limbs = skin.joints().iter().map(|joints| limbs_of_joints[usize::from(joints[0])]).collect();
        Ok(Self {
            description,
            faces,
            mean,
            components,
            variance_kept,
            rig,
            regressor,
            skin,
            joint_mean,
            joint_components,
            limbs,
            population: Population::default(),
        })
    }

    /// Who the model was learned from and by whom.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Corners of every triangle, counter-clockwise seen from outside.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// m₀: the mean, metres, shape `[vertices]`.
    pub fn mean(&self) -> &[Vector3<f64>] {
        &self.mean
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.mean.len()
    }

    /// Number of components: the length of α.
    pub fn num_components(&self) -> usize {
        self.components.len()
    }

    /// Displacement of a vertex for one standard deviation of a component, metres.
    pub fn displacement(&self, component: usize, vertex: usize) -> Vector3<f64> {
        self.components[component].displacement(vertex)
    }

    /// Share of the population's variance that the first 1, 2, … components keep, shape `[components]`.
    pub fn variance_kept(&self) -> &[f64] {
        &self.variance_kept
    }

    /// Joints and degrees of freedom.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Joints from vertices.
    pub fn regressor(&self) -> &JointRegressor {
        &self.regressor
    }

    /// What moves the vertices.
    pub fn skin(&self) -> &Skin {
        &self.skin
    }

    /// Limb of every vertex: that of the joint with the largest weight, shape `[vertices]`.
    pub fn limbs(&self) -> &[Limb] {
        &self.limbs
    }

    /// The body of coefficients `alpha` in its rest pose; missing coefficients are 0.
    ///
    /// # Panics
    /// If there are more coefficients than components.
    pub fn shape(&self, alpha: &[f64]) -> Shape {
        let mut shape = Shape { alpha: Vec::new(), vertices: Vec::new(), joints: Vec::new() };
        self.shape_into(alpha, &mut shape);
        shape
    }

    /// The same into a shape that is there; takes no memory if it is of this model.
    ///
    /// # Panics
    /// If there are more coefficients than components.
    pub fn shape_into(&self, alpha: &[f64], shape: &mut Shape) {
        let components = self.components.len();
        assert!(alpha.len() <= components, "{} coefficients, expected at most {components}", alpha.len());
        shape.alpha.clear();
        shape.alpha.extend_from_slice(alpha);
        shape.alpha.resize(components, 0.0);
        shape.vertices.clone_from(&self.mean);
        shape.joints.clone_from(&self.joint_mean);
        for (i, &a) in alpha.iter().enumerate() {
            let factor = a * self.components[i].scale;
            for (vertex, steps) in shape.vertices.iter_mut().zip(&self.components[i].steps) {
                for axis in 0..3 {
                    vertex[axis] += factor * f64::from(steps[axis]);
                }
            }
            for (joint, displacement) in shape.joints.iter_mut().zip(&self.joint_components[i]) {
                *joint += displacement * a;
            }
        }
    }
}

/// A body of one shape in its rest pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// the coefficients, in standard deviations, shape `[components]`
    pub alpha: Vec<f64>,
    /// metres, shape `[vertices]`
    pub vertices: Vec<Vector3<f64>>,
    /// metres, shape `[joints]`
    pub joints: Vec<Vector3<f64>>,
}

impl Shape {
    /// The body at rest as a mesh.
    pub fn mesh(&self, model: &BodyModel) -> Mesh {
        Mesh { vertices: self.vertices.clone(), faces: model.faces.clone() }
    }
}
