//! Whether cameras can stand as a calibration says.

use model::{Camera, counted};
use nalgebra::{Matrix3, Vector3};

use crate::{Error, Place, Result, read::Warnings};

/// How far cameras may stand from what they look at, metres.
const DISTANCES: std::ops::RangeInclusive<f64> = 0.1..=100.0;

/// The largest angle between where a camera looks and the point that all look at: the diagonal half of a wide lens.
const WIDEST: f64 = 45.0;

const INVERTED: &str =
    "x_camera = R x + t; the file seems to have the cameras' poses in the world, the other way round";

/// Checks unit, common point, floor and upper sides of cameras in Marey's world.
pub(super) fn check(cameras: &[Camera], is_up_certain: bool, warnings: &mut Warnings) -> Result<()> {
    let rays: Vec<_> = cameras.iter().map(|camera| (camera.position(), camera.direction())).collect();
    let common = common_point(&rays);
    check_unit(cameras, &rays, common)?;
    match common {
        Some(point) => check_directions(cameras, &rays, &point, warnings)?,
        None if cameras.len() > 1 => {
            warnings
                .add(Place::File, "the cameras look in parallel; whether they see the same is not checked");
        }
        None => {}
    }
    check_upper_sides(cameras, is_up_certain, warnings)?;
    for (camera, (position, _)) in cameras.iter().zip(&rays) {
        if position.y < 0.0 {
            let message = format!(
                "camera {}: it stands {:.2} m below the floor (y = 0); is the floor elsewhere?",
                camera.name, -position.y
            );
            warnings.add(Place::File, message);
        }
    }
    Ok(())
}

/// The point nearest to all optical axes; `None` for a single camera and for parallel ones.
fn common_point(rays: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Vector3<f64>> {
    let (mut sum, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (position, direction) in rays {
        let across = Matrix3::identity() - direction * direction.transpose();
        sum += across;
        right += across * position;
    }
    let smallest = sum.symmetric_eigenvalues().min() / rays.len() as f64;
    (smallest > 1e-3).then(|| sum.lu().solve(&right)).flatten()
}

/// Cameras stand metres from people.
fn check_unit(
    cameras: &[Camera],
    rays: &[(Vector3<f64>, Vector3<f64>)],
    common: Option<Vector3<f64>>,
) -> Result<()> {
    let from = common.unwrap_or_default();
    let mut distances: Vec<_> = rays.iter().map(|(position, _)| (position - from).norm()).collect();
    distances.sort_by(f64::total_cmp);
    let distance = distances[distances.len() / 2];
    // a single camera may be the origin of the world
    if DISTANCES.contains(&distance) || common.is_none() && distance < *DISTANCES.start() {
        return Ok(());
    }
    // poses given the other way round put all cameras at one place
    if distance < *DISTANCES.start() && look_inwards_if_inverted(cameras) {
        return Err(Error::whole_file(
            format!("cameras that stand {distance:.4} m from each other"),
            INVERTED,
        ));
    }
    let looks_like = match distance {
        _ if distance > 1000.0 => "looks like millimetres",
        _ if distance > 100.0 => "looks like centimetres",
        _ => "the unit is too large, or the calibration has no scale",
    };
    Err(Error::whole_file(
        format!("cameras that stand {distance:.4} from what they look at: {looks_like}"),
        "metres; give the file's unit if it is another",
    ))
}

fn check_directions(
    cameras: &[Camera],
    rays: &[(Vector3<f64>, Vector3<f64>)],
    point: &Vector3<f64>,
    warnings: &mut Warnings,
) -> Result<()> {
    let off = |(position, direction): &(Vector3<f64>, Vector3<f64>)| {
        direction.angle(&(point - position)).to_degrees()
    };
    let away: Vec<_> = cameras.iter().zip(rays.iter().map(off)).filter(|(_, off)| *off > WIDEST).collect();
    if 2 * away.len() > cameras.len() {
        let found = format!(
            "{} of {} that look away from the common point",
            away.len(),
            counted(cameras.len(), "camera")
        );
        let hint = "cameras that look at the same, with x_camera = R x + t and z forward";
        let is_inverted = look_inwards_if_inverted(cameras);
        let hint = if is_inverted { INVERTED } else { hint };
        return Err(Error::whole_file(found, hint));
    }
    for (camera, off) in away {
        let message =
            format!("camera {}: it looks {off:.0} degrees past what the others look at", camera.name);
        warnings.add(Place::File, message);
    }
    Ok(())
}

/// True if the cameras looked at a common point were their poses given the other way round.
fn look_inwards_if_inverted(cameras: &[Camera]) -> bool {
    let rays: Vec<_> = cameras
        .iter()
        .map(|camera| {
            let pose = &camera.camera_from_world;
            (pose.translation.vector, pose.rotation * Vector3::z())
        })
        .collect();
    common_point(&rays).is_some_and(|point| {
        rays.iter().all(|(position, direction)| direction.angle(&(point - position)).to_degrees() <= WIDEST)
    })
}

fn check_upper_sides(cameras: &[Camera], is_up_certain: bool, warnings: &mut Warnings) -> Result<()> {
    let upper_side = |camera: &Camera| (camera.camera_from_world.rotation.inverse() * -Vector3::y()).y;
    let down: Vec<_> = cameras.iter().filter(|camera| upper_side(camera) < -0.5).collect();
    if is_up_certain && 2 * down.len() > cameras.len() {
        return Err(Error::whole_file(
            format!("{} of {} upside down", down.len(), counted(cameras.len(), "camera")),
            "the floor below the cameras; give the axis that points up if the file has another",
        ));
    }
    for camera in down {
        let message = format!("camera {}: it is upside down; is its picture turned?", camera.name);
        warnings.add(Place::File, message);
    }
    for camera in cameras.iter().filter(|camera| {
        let right = camera.camera_from_world.rotation.inverse() * Vector3::x();
        right.y.abs() > 0.8
    }) {
        let message = format!("camera {}: it lies on its side; is its picture turned?", camera.name);
        warnings.add(Place::File, message);
    }
    Ok(())
}
