//! Cameras for pictures of another size than that of the calibration.

use model::{Camera, Distortion};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use crate::{Error, Place, Read, Result, read::Warnings};

/// Largest difference of the sides' ratios for which bars are assumed.
const MOST_BARS: f64 = 0.1;

/// The camera of pictures of `[width, height]` pixels, which may differ from the size that was calibrated, with a warning
/// that says what was assumed:
///
/// - the same sides, exchanged: the picture was turned by a quarter, to where the world's up is up in it;
/// - the same ratio of the sides, to a pixel: the picture was scaled;
/// - a ratio that differs by at most 10 %: the picture was scaled until it fitted, and the rest filled with equal bars on
///   both sides (1088 x 1920 in 1080 x 1920 pixels: scaled by 0.9926, bars of 7 pixels at top and bottom).
///
/// # Errors
/// If the sides' ratios differ by more, or an exchange of the sides leaves the sense of the turn open.
pub fn fit_to_image(camera: &Camera, size: [u32; 2]) -> Result<Read<Camera>> {
    let mut warnings = Warnings::default();
    if camera.size == size {
        return Ok(warnings.beside(camera.clone()));
    }
    let sizes = format!(
        "camera {}: the picture is {} x {} pixels, the calibration {} x {}",
        camera.name, size[0], size[1], camera.size[0], camera.size[1]
    );
    if size.contains(&0) || size.iter().any(|&side| side > 1 << 15) {
        return Err(Error::whole_file(sizes, "a picture of 1 to 32768 pixels a side"));
    }
    let is_portrait = |[width, height]: [u32; 2]| height > width;
    let mut camera = camera.clone();
    let mut assumed = Vec::new();
    if is_portrait(size) != is_portrait(camera.size)
        && ratio(size, [camera.size[1], camera.size[0]]) < MOST_BARS
    {
        let is_clockwise = sense_of_turn(&camera).ok_or_else(|| {
            Error::whole_file(sizes.clone(), "the size of the calibration, or a camera that lies on its side")
        })?;
        let turns = if is_clockwise { 1 } else { 3 };
        camera = (0..turns).fold(camera, |camera, _| turned_clockwise(&camera));
        assumed.push(if is_clockwise { "turned clockwise" } else { "turned counter-clockwise" }.to_owned());
    }
    let [scale_x, scale_y] = [0, 1].map(|side| f64::from(size[side]) / f64::from(camera.size[side]));
    let off = ratio(size, camera.size);
    if off >= MOST_BARS {
        return Err(Error::whole_file(
            sizes,
            "the calibration's size, or one with nearly the same ratio of the sides",
        ));
    }
    if camera.size != size {
        let scale = scale_x.min(scale_y);
        // sides are whole, so that a scaled picture may be off by one pixel
        let is_scaled = (f64::from(size[0]) - scale * f64::from(camera.size[0])).abs() <= 1.0
            && (f64::from(size[1]) - scale * f64::from(camera.size[1])).abs() <= 1.0;
        let (scale, bars) = if is_scaled {
            assumed.push(format!("scaled by {scale_x:.4}"));
            (Vector2::new(scale_x, scale_y), Vector2::zeros())
        } else {
            let content = [0, 1].map(|side| scale * f64::from(camera.size[side]));
            let bars = Vector2::new(f64::from(size[0]) - content[0], f64::from(size[1]) - content[1]) / 2.0;
            let sides = if bars.y > bars.x { "top and bottom" } else { "left and right" };
            assumed.push(format!("scaled by {scale:.4}, with bars of {:.1} pixels at {sides}", bars.max()));
            (Vector2::repeat(scale), bars)
        };
        // pixel (0, 0) is the centre of a pixel, half a pixel from the corner, from which scaling starts
        let half = Vector2::repeat(0.5);
        camera.focal.component_mul_assign(&scale);
        camera.principal = (camera.principal + half).component_mul(&scale) - half + bars;
        camera.size = size;
    }
    warnings.add(Place::File, format!("{sizes}; taken as the same picture {}", assumed.join(", ")));
    Ok(warnings.beside(camera))
}

/// By which part the ratios of the sides of two pictures differ.
fn ratio(a: [u32; 2], b: [u32; 2]) -> f64 {
    let [a, b] = [a, b].map(|[width, height]| f64::from(width) / f64::from(height));
    (a / b).max(b / a) - 1.0
}

/// True if a quarter clockwise turns the world's up to the picture's upper edge, false if one counter-clockwise does;
/// `None` if the camera doesn't lie on its side.
fn sense_of_turn(camera: &Camera) -> Option<bool> {
    let up = camera.camera_from_world.rotation * Vector3::y();
    (up.x.abs() > 2.0 * up.y.abs()).then_some(up.x < 0.0)
}

/// The camera of the pictures turned clockwise by a quarter: pixel (u, v) is at (height - 1 - v, u).
fn turned_clockwise(camera: &Camera) -> Camera {
    let [width, height] = camera.size;
    let Distortion { k1, k2, k3, p1, p2 } = camera.distortion;
    let turn = Rotation3::from_matrix_unchecked(Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0));
    let turn = Isometry3::from_parts(Vector3::zeros().into(), UnitQuaternion::from_rotation_matrix(&turn));
    Camera {
        name: camera.name.clone(),
        size: [height, width],
        focal: camera.focal.yx(),
        principal: Vector2::new(f64::from(height) - 1.0 - camera.principal.y, camera.principal.x),
        distortion: Distortion { k1, k2, k3, p1: p2, p2: -p1 },
        camera_from_world: turn * camera.camera_from_world,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let rotation =
            UnitQuaternion::from_matrix(&Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0));
        Camera {
            name: "left".into(),
            size: [1088, 1920],
            focal: Vector2::new(1680.0, 1682.0),
            principal: Vector2::new(530.0, 950.0),
            distortion: Distortion { k1: -0.05, k2: 0.1, k3: 0.01, p1: 0.002, p2: -0.003 },
            camera_from_world: Isometry3::from_parts(Vector3::new(0.0, 1.0, 3.5).into(), rotation),
        }
    }

    const POINT: Vector3<f64> = Vector3::new(0.3, 1.2, 0.2);

    #[test]
    fn a_picture_of_half_the_size_has_its_pixels_at_half_the_distance_from_the_corner() {
        let fitted = fit_to_image(&camera(), [544, 960]).unwrap();
        let (whole, half) = (camera().project(&POINT).unwrap(), fitted.value.project(&POINT).unwrap());
        assert!(((whole.add_scalar(0.5)) / 2.0 - half.add_scalar(0.5)).norm() < 1e-9);
        assert_eq!(
            fitted.warnings[0].to_string(),
            "camera left: the picture is 544 x 960 pixels, the calibration 1088 x 1920; taken as the same picture scaled by 0.5000"
        );
        assert!(fit_to_image(&camera(), [1088, 1920]).unwrap().warnings.is_empty());
    }

    #[test]
    fn bars_are_found_where_a_width_of_1088_was_made_1080() {
        let fitted = fit_to_image(&camera(), [1080, 1920]).unwrap();
        let (calibrated, seen) = (camera().project(&POINT).unwrap(), fitted.value.project(&POINT).unwrap());
        // measured on the videos of a real capture: x 1.0075, y 1.0075 and -7.25
        let measured = Vector2::new(1.0075 * seen.x, 1.0075 * seen.y - 7.25);
        assert!((measured - calibrated).norm() < 0.2, "{measured} {calibrated}");
        let warning = fitted.warnings[0].to_string();
        assert!(
            warning.ends_with("scaled by 0.9926, with bars of 7.1 pixels at top and bottom"),
            "{warning}"
        );
    }

    #[test]
    fn a_turned_picture_shows_the_same_point_where_it_was_turned_to() {
        let mut lying = camera();
        lying = turned_clockwise(&lying);
        let fitted = fit_to_image(&lying, [1088, 1920]).unwrap();
        assert!(fitted.warnings[0].to_string().ends_with("turned counter-clockwise"));
        assert!((fitted.value.project(&POINT).unwrap() - camera().project(&POINT).unwrap()).norm() < 1e-9);
        let (before, after) = (camera().project(&POINT).unwrap(), lying.project(&POINT).unwrap());
        assert!((after - Vector2::new(1919.0 - before.y, before.x)).norm() < 1e-9);
        let other = (0..2).fold(lying, |camera, _| turned_clockwise(&camera));
        let fitted = fit_to_image(&other, [544, 960]).unwrap();
        assert!(fitted.warnings[0].to_string().ends_with("turned clockwise, scaled by 0.5000"));
    }

    #[test]
    fn sizes_that_nothing_explains_are_refused() {
        for size in [[1920, 1088], [1000, 1000], [0, 5], [1088, 40000]] {
            let error = fit_to_image(&camera(), size).unwrap_err().to_string();
            assert!(error.contains("the calibration 1088 x 1920"), "{error}");
        }
    }
}
