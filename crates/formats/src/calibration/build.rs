//! From the cameras of a file to cameras in Marey's world.

use std::collections::HashSet;

use model::{Camera, Distortion, shown};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3};

use super::{FileCamera, FileCameras, MOST_CAMERAS, Options, UpAxis, check, up::Stated};
use crate::{Error, Place, Result, read::Warnings};

/// How far the rows of a rotation may be from orthonormal: files print six digits or more.
const ORTHONORMAL: f64 = 1e-3;

pub(super) fn cameras(found: FileCameras, options: &Options, warnings: &mut Warnings) -> Result<Vec<Camera>> {
    let FileCameras { cameras: files, up: stated, metres } = found;
    if files.is_empty() {
        return Err(Error::whole_file(
            "no camera",
            "at least one with a camera matrix, a rotation and a translation",
        ));
    }
    if files.len() > MOST_CAMERAS {
        return Err(Error::whole_file(format!("{} cameras", files.len()), format!("at most {MOST_CAMERAS}")));
    }
    let mut names = HashSet::new();
    if let Some(twice) = files.iter().find(|file| !names.insert(file.name.as_str())) {
        let found = format!("a second camera named {:?}", twice.name);
        return Err(unexpected(twice.place, found, "names to be unique"));
    }
    let metres = options.metres_per_unit.or(metres).unwrap_or(1.0);
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(Error::whole_file(format!("{} metres per unit", shown(metres)), "a positive number"));
    }
    let rotations = files.iter().map(rotation).collect::<Result<Vec<_>>>()?;
    let up = up_axis(stated, options.up, &rotations, warnings);
    let file_from_world = up.world_from_file().inverse();
    let place = |(file, camera_from_file): (&FileCamera, &Rotation3<f64>)| {
        let rotation = UnitQuaternion::from_rotation_matrix(&(camera_from_file * file_from_world));
        let translation = Translation3::from(file.translation * metres);
        camera(file, Isometry3::from_parts(translation, rotation), options.image_size, warnings)
    };
    let cameras = files.iter().zip(&rotations).map(place).collect::<Result<Vec<_>>>()?;
    let is_up_certain = options.up.is_none() && matches!(stated, Stated::Certain(_));
    check::check(&cameras, is_up_certain, warnings)?;
    Ok(cameras)
}

fn unexpected(place: Place, found: String, expected: impl Into<String>) -> Error {
    Error::Unexpected { place, found, expected: expected.into() }
}

/// The rotation of a camera, made orthonormal; refused if it isn't nearly so, or mirrors.
fn rotation(file: &FileCamera) -> Result<Rotation3<f64>> {
    let matrix = file.rotation;
    let fail = |found: String, expected: &str| {
        Err(unexpected(file.place, format!("camera {}: {found}", file.name), expected))
    };
    let miss = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    if miss.is_nan() || miss > ORTHONORMAL {
        return fail(
            format!("a rotation whose rows are not orthonormal (off by {miss:.3})"),
            "a rotation matrix or a rotation vector",
        );
    }
    if matrix.determinant() < 0.0 {
        return fail(
            "a rotation that mirrors (determinant -1)".into(),
            "a right-handed one (determinant +1): an axis of the world or of the camera is flipped",
        );
    }
    let svd = matrix.svd(true, true);
    match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => Ok(Rotation3::from_matrix_unchecked(u * v_t)),
        _ => fail("a rotation that can't be made orthonormal".into(), "a rotation matrix"),
    }
}

/// The axis that points up: as asked for, as the file says, as usual, or as the pictures' upper edges say.
fn up_axis(
    stated: Stated,
    asked: Option<UpAxis>,
    camera_from_file: &[Rotation3<f64>],
    warnings: &mut Warnings,
) -> UpAxis {
    let usual = match (asked, stated) {
        (Some(up), _) | (None, Stated::Certain(up)) => return up,
        (None, Stated::Usual(up)) => up,
    };
    let pictures_up: Vector3<f64> =
        camera_from_file.iter().map(|rotation| rotation.inverse() * -Vector3::y()).sum();
    match UpAxis::nearest(pictures_up) {
        Some(up) if up == usual => up,
        Some(up) => {
            let message = format!(
                "the file doesn't say which axis is up; taken as {up}, where the pictures' upper edges are \
                 (usual in this format: {usual})"
            );
            warnings.add(Place::File, message);
            up
        }
        None => {
            let message = format!(
                "the file doesn't say which axis is up, and the pictures' upper edges are near none; taken as {usual}"
            );
            warnings.add(Place::File, message);
            usual
        }
    }
}

fn camera(
    file: &FileCamera,
    camera_from_world: Isometry3<f64>,
    size: Option<[u32; 2]>,
    warnings: &mut Warnings,
) -> Result<Camera> {
    let named = |what: String| format!("camera {}: {what}", file.name);
    let matrix = &file.matrix;
    let bottom = matrix.row(2) - nalgebra::RowVector3::new(0.0, 0.0, 1.0);
    if !(bottom.amax() <= 1e-9 && matrix[(1, 0)].abs() <= 1e-9) {
        let found = named("a camera matrix that isn't upper triangular with 1 in the last place".into());
        return Err(unexpected(file.place, found, "fx, 0, cx; 0, fy, cy; 0, 0, 1"));
    }
    if matrix[(0, 1)] != 0.0 {
        let message = named(format!("a skew of {} pixels is taken as 0", matrix[(0, 1)]));
        warnings.add(file.place, message);
    }
    let principal = Vector2::new(matrix[(0, 2)], matrix[(1, 2)]);
    let camera = Camera {
        name: file.name.clone(),
        size: file.size.or(size).unwrap_or_else(|| {
            let size = [principal.x, principal.y].map(|centre| (2.0 * centre + 1.0).round() as u32);
            let message = named(format!(
                "the size of its pictures is not given; taken as {} x {} pixels, twice the principal point",
                size[0], size[1]
            ));
            warnings.add(file.place, message);
            size
        }),
        focal: Vector2::new(matrix[(0, 0)], matrix[(1, 1)]),
        principal,
        distortion: distortion(file)?,
        camera_from_world,
    };
    camera.check().map_err(|source| Error::Model { place: file.place, source })?;
    let [width, height] = camera.size.map(f64::from);
    if !((0.0..width).contains(&principal.x) && (0.0..height).contains(&principal.y)) {
        let message = named(format!(
            "the principal point ({:.0}, {:.0}) is outside the picture of {width} x {height} pixels",
            principal.x, principal.y
        ));
        warnings.add(file.place, message);
    }
    Ok(camera)
}

fn distortion(file: &FileCamera) -> Result<Distortion> {
    let at = |index: usize| file.distortion.get(index).copied().unwrap_or_default();
    if let Some(index) = (5..file.distortion.len()).find(|&index| at(index) != 0.0) {
        let found = format!(
            "camera {}: {} coefficients of distortion, number {} of them {}",
            file.name,
            file.distortion.len(),
            index + 1,
            at(index)
        );
        let expected = "at most five that are not 0: k1, k2, p1, p2, k3 (radial and tangential)";
        return Err(unexpected(file.place, found, expected));
    }
    Ok(Distortion { k1: at(0), k2: at(1), p1: at(2), p2: at(3), k3: at(4) })
}
