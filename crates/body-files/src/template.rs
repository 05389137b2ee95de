//! What all scans have in common: a rig and a skin, given with the scans or those of the shipped model.

use body::{BodyModel, JointRegressor, Rig, RigFile, Skin, Template, heat_skin};
use formats::archive::Entry;
use nalgebra::Vector3;

use crate::{Error, Result};

/// The files of a rig.
#[derive(Default)]
pub(crate) struct RigEntries<'a> {
    pub rig: Option<&'a Entry>,
    pub skin_joints: Option<&'a Entry>,
    pub skin_weights: Option<&'a Entry>,
}

/// Puts a template together from a mesh and what came with it.
pub(crate) fn template(
    rest: Vec<Vector3<f64>>,
    faces: Vec<[u32; 3]>,
    entries: &RigEntries<'_>,
    warnings: &mut Vec<String>,
) -> Result<Template> {
    let Some(entry) = entries.rig else { return of_shipped(rest, faces) };
    let in_rig = Error::in_rig(&entry.name);
    let file = RigFile::parse(&entry.bytes).map_err(&in_rig)?;
    let rig = file.rig().map_err(&in_rig)?;
    let Some(regressor) = file.regressor(rest.len()).map_err(&in_rig)? else {
        return Err(Error::content(
            &entry.name,
            "no joint_regressor",
            "for every joint the vertices and weights that its position follows from",
        ));
    };
    let skin = match (entries.skin_joints, entries.skin_weights) {
        (Some(joints), Some(weights)) => given_skin(joints, weights, &rig)?,
        _ => {
            warnings.push(
                "no skin_joints.npy and skin_weights.npy: weights were computed by heat from the bones"
                    .into(),
            );
            computed_skin(&rest, &faces, &rig, &regressor)?
        }
    };
    Ok(Template { faces, rest, rig, regressor, skin })
}

/// Rig and skin of the shipped model, for meshes of its topology.
fn of_shipped(rest: Vec<Vector3<f64>>, faces: Vec<[u32; 3]>) -> Result<Template> {
    let shipped = BodyModel::shipped();
    if rest.len() != shipped.num_vertices() || faces.len() != shipped.faces().len() {
        return Err(Error::Set {
            found: format!("no rig.json, and a mesh of {} vertices and {} faces", rest.len(), faces.len()),
            expected: format!(
                "a rig.json with joints, joint_regressor and dofs, or the topology of the shipped model ({} vertices, {} \
                 faces)",
                shipped.num_vertices(),
                shipped.faces().len()
            ),
        });
    }
    Ok(Template {
        faces,
        rest,
        rig: shipped.rig().clone(),
        regressor: shipped.regressor().clone(),
        skin: shipped.skin().clone(),
    })
}

fn computed_skin(
    rest: &[Vector3<f64>],
    faces: &[[u32; 3]],
    rig: &Rig,
    regressor: &JointRegressor,
) -> Result<Skin> {
    Ok(heat_skin(rest, faces, rig, &regressor.joints(rest))?)
}

/// A skin from two arrays of shape `[vertices, 4]`.
fn given_skin(joints: &Entry, weights: &Entry, rig: &Rig) -> Result<Skin> {
    let of = |entry: &Entry| -> Result<Vec<[f64; 4]>> {
        let array = formats::npy::read(&entry.bytes).map_err(Error::in_file(&entry.name))?;
        match array.shape[..] {
            [_, 4] => Ok(array.values.chunks_exact(4).map(|row| [row[0], row[1], row[2], row[3]]).collect()),
            _ => Err(Error::content(
                &entry.name,
                format!("an array of shape {:?}", array.shape),
                "shape [vertices, 4]",
            )),
        }
    };
    let (indices, shares) = (of(joints)?, of(weights)?);
    if let Some(found) = indices.iter().flatten().find(|j| !(0.0..256.0).contains(*j)) {
        return Err(Error::content(&joints.name, found.to_string(), "indices of joints"));
    }
    // checked just now; a cast saturates
    let indices: Vec<[u8; 4]> = indices.iter().map(|row| row.map(|j| j as u8)).collect();
    let shares: Vec<[f32; 4]> = shares.iter().map(|row| row.map(|w| w as f32)).collect();
    Skin::new(&indices, &shares, rig.num_joints()).map_err(Error::in_rig(&weights.name))
}
