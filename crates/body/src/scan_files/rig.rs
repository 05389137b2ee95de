//! What all scans have in common: a rig and a skin, given with the scans or those of the shipped model.

use formats::archive::Entry;
use nalgebra::Vector3;

use crate::{Error, Result, RigFile, Skin, Template, TemplateParts};

/// The files of a rig.
#[derive(Default)]
pub(crate) struct RigEntries<'a> {
    pub rig: Option<&'a Entry>,
    pub skin_joints: Option<&'a Entry>,
    pub skin_weights: Option<&'a Entry>,
}

/// Puts a template together from a mesh and what came with it; says what had to be computed.
pub(crate) fn template(
    rest: &[Vector3<f64>],
    faces: &[[u32; 3]],
    entries: &RigEntries<'_>,
    warnings: &mut Vec<String>,
) -> Result<Template> {
    let parse = |entry: &Entry| RigFile::parse(&entry.bytes).map_err(Error::in_rig(&entry.name));
    let rig = entries.rig.map(parse).transpose()?;
    let skin = match (entries.skin_joints, entries.skin_weights) {
        (Some(joints), Some(weights)) => Some(given_skin(joints, weights)?),
        _ => None,
    };
    if rig.is_some() && skin.is_none() {
        warnings.push(
            "no skin_joints.npy and skin_weights.npy: weights were computed by heat from the bones".into(),
        );
    }
    let parts = TemplateParts { faces, rest, rig: rig.as_ref(), skin: skin.as_ref(), known_joints: &[] };
    Template::new(parts)
}

/// A skin from two arrays of shape `[vertices, 4]`.
fn given_skin(joints: &Entry, weights: &Entry) -> Result<Skin> {
    let rows = |entry: &Entry| -> Result<Vec<[f64; 4]>> {
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
    let (indices, shares) = (rows(joints)?, rows(weights)?);
    if let Some(found) = indices.iter().flatten().find(|j| !(0.0..256.0).contains(*j)) {
        return Err(Error::content(&joints.name, found.to_string(), "indices of joints"));
    }
    // checked just now; a cast saturates
    let indices: Vec<[u8; 4]> = indices.iter().map(|row| row.map(|j| j as u8)).collect();
    let shares: Vec<[f32; 4]> = shares.iter().map(|row| row.map(|w| w as f32)).collect();
    let num_joints = indices.iter().flatten().max().map_or(0, |last| usize::from(*last) + 1);
    Skin::new(&indices, &shares, num_joints).map_err(Error::in_rig(&weights.name))
}
