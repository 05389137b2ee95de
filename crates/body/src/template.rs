use model::counted;
use nalgebra::Vector3;

use crate::mesh_check::check_template;
use crate::{BodyModel, Error, JointRegressor, Result, Rig, RigFile, Skin, heat_skin};

/// What all scans have in common: topology, skeleton and skin.
#[derive(Debug, Clone, PartialEq)]
pub struct Template {
    /// corners of every triangle, counter-clockwise seen from outside; a closed mesh
    pub faces: Vec<[u32; 3]>,
    /// a body in the base pose, metres, y up, facing +z, shape `[vertices]`
    pub rest: Vec<Vector3<f64>>,
    /// joints and degrees of freedom
    pub rig: Rig,
    /// joints from vertices
    pub regressor: JointRegressor,
    /// what moves the vertices
    pub skin: Skin,
}

/// A mesh of the topology and its joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownJoints<'a> {
    /// metres, shape `[vertices]`
    pub vertices: &'a [Vector3<f64>],
    /// metres, shape `[joints]`
    pub joints: &'a [Vector3<f64>],
}

/// What there is of a template; the rest is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemplateParts<'a> {
    /// corners of every triangle
    pub faces: &'a [[u32; 3]],
    /// a body in the base pose, metres, shape `[vertices]`
    pub rest: &'a [Vector3<f64>],
    /// the skeleton; not needed for a mesh of the shipped model's topology
    pub rig: Option<&'a RigFile>,
    /// skinning weights; computed by [`heat_skin`] if `None`
    pub skin: Option<&'a Skin>,
    /// meshes whose joints are known; used if the rig doesn't say how joints follow from vertices
    pub known_joints: &'a [KnownJoints<'a>],
}

impl Template {
    /// Checks what is there and computes what isn't.
    ///
    /// Joints from vertices: the rig's, else fitted to `known_joints`, else to the rest positions that the rig gives. The
    /// skin: the one given, else [`heat_skin`]'s. A mesh of the shipped model's topology takes what is missing from there.
    ///
    /// # Errors
    /// [`Error::Template`] says what is wrong or missing; [`Error::Rig`], [`Error::Regressor`], [`Error::Skin`].
    pub fn new(parts: TemplateParts<'_>) -> Result<Self> {
        let TemplateParts { faces, rest, .. } = parts;
        check_template(rest, faces)?;
        let Some(file) = parts.rig else { return Self::from_shipped(parts) };
        let rig = file.rig()?;
        let at_rest = file.rest_joints();
        let regressor = match (file.regressor(rest.len())?, &at_rest) {
            (Some(regressor), _) => regressor,
            (None, _) if !parts.known_joints.is_empty() => {
                let (meshes, joints): (Vec<_>, Vec<_>) =
                    parts.known_joints.iter().map(|known| (known.vertices, known.joints)).unzip();
                JointRegressor::fit(&meshes, &joints)?
            }
            (None, Some(joints)) => JointRegressor::fit(&[rest], &[joints])?,
            (None, None) => {
                return Err(Error::Template {
                    what: "the rig has neither a joint regressor nor rest positions of its joints, and no joints of the \
                           scans are given"
                        .into(),
                });
            }
        };
        if regressor.num_joints() != rig.num_joints() {
            let (found, expected) = (regressor.num_joints(), rig.num_joints());
            let what = format!("positions of {}, expected the rig's {expected}", counted(found, "joint"));
            return Err(Error::Regressor { what });
        }
        let skin = match parts.skin {
            Some(skin) => skin.clone(),
            None => heat_skin(rest, faces, &rig, &regressor.joints(rest))?,
        };
        if skin.num_vertices() != rest.len() {
            let what = format!("skin has {} vertices, the mesh {}", skin.num_vertices(), rest.len());
            return Err(Error::Template { what });
        }
        Ok(Self { faces: faces.to_vec(), rest: rest.to_vec(), rig, regressor, skin })
    }

    fn from_shipped(parts: TemplateParts<'_>) -> Result<Self> {
        let shipped = BodyModel::shipped();
        if shipped.faces != parts.faces || shipped.mean.len() != parts.rest.len() {
            return Err(Error::Template {
                what: "no rig: a mesh of another topology than the shipped model's needs a rig.json with joints (name, \
                       parent, rest position or joint_regressor) and dofs"
                    .into(),
            });
        }
        let BodyModel { faces, rig, regressor, skin, .. } = shipped;
        let skin = parts.skin.cloned().unwrap_or(skin);
        Ok(Self { faces, rest: parts.rest.to_vec(), rig, regressor, skin })
    }
}
