mod fit;

use nalgebra::Vector3;

use crate::{Error, Result};

/// Joints as weighted means of vertices: works on any mesh of the topology, at rest or posed.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRegressor {
    /// vertex and weight, shape `[joints, any]`; the weights of a joint sum to 1
    rows: Vec<Vec<(u32, f32)>>,
}

impl JointRegressor {
    /// From vertices and weights of every joint; the weights are brought to the sum 1.
    ///
    /// # Errors
    /// [`Error::Regressor`] if a joint has no vertices, a vertex isn't there, or weights don't sum to about 1.
    pub fn new(mut rows: Vec<Vec<(u32, f32)>>, num_vertices: usize) -> Result<Self> {
        for (joint, row) in rows.iter_mut().enumerate() {
            let fail = |what: String| Err(Error::Regressor { what: format!("joint {joint} {what}") });
            if let Some((vertex, _)) = row.iter().find(|(vertex, _)| *vertex as usize >= num_vertices) {
                return fail(format!("uses vertex {vertex}, expected indices below {num_vertices}"));
            }
            let sum: f64 = row.iter().map(|(_, weight)| f64::from(*weight)).sum();
            if (sum - 1.0).abs() > 0.01 || row.iter().any(|(_, weight)| !weight.is_finite()) {
                return fail(format!("has weights that sum to {sum}, expected 1"));
            }
            // Numbers already rounded must stay as they are, or a file would not be read as it was written.
            if (sum - 1.0).abs() > 1e-6 {
                for (_, weight) in row {
                    *weight = (f64::from(*weight) / sum) as f32;
                }
            }
        }
        Ok(Self { rows })
    }

    /// Fits non-negative weights to meshes whose joints are known: for every joint those of vertices around it, by least
    /// squares. One mesh is enough for its own joints; more tell how joints move with the shape.
    ///
    /// # Errors
    /// [`Error::Regressor`] if there is no mesh, or meshes and joints don't have the same counts throughout.
    pub fn fit(meshes: &[&[Vector3<f64>]], joints: &[&[Vector3<f64>]]) -> Result<Self> {
        fit::fit(meshes, joints)
    }

    /// Number of joints.
    pub fn num_joints(&self) -> usize {
        self.rows.len()
    }

    /// Vertices and weights of a joint.
    pub fn row(&self, joint: usize) -> &[(u32, f32)] {
        &self.rows[joint]
    }

    /// Positions of the joints in a mesh, metres, shape `[joints]`. `vertices` are at least as many as the regressor uses.
    pub fn joints(&self, vertices: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        (0..self.num_joints()).map(|joint| self.joint(joint, |vertex| vertices[vertex])).collect()
    }

    /// The weighted mean of something that vertices have.
    pub(crate) fn joint(&self, joint: usize, at_vertex: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        let (mut sum, mut weights) = (Vector3::zeros(), 0.0);
        for &(vertex, weight) in &self.rows[joint] {
            sum += at_vertex(vertex as usize) * f64::from(weight);
            weights += f64::from(weight);
        }
        // Weights in single precision sum to 1 only nearly: a body far from the origin would shift its joints.
        sum / weights
    }
}
