use nalgebra::{Isometry3, Matrix2x3, Vector2, Vector3};

use crate::{Error, Result};

/// A calibrated pinhole camera with radial–tangential lens distortion (Brown 1966, as in OpenCV;
/// docs/papers.md#other-sources).
///
/// In camera space x points right, y down and z forward; metres. In the image u points right and v down, pixels, and
/// (0, 0) is the centre of the top-left pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// name, unique in a capture
    pub name: String,
    /// width and height of the image, pixels
    pub size: [u32; 2],
    /// focal lengths along u and v, pixels
    pub focal: Vector2<f64>,
    /// where the optical axis meets the image, pixels
    pub principal: Vector2<f64>,
    /// lens distortion
    pub distortion: Distortion,
    /// takes points of the world (metres, y up) into the camera
    pub camera_from_world: Isometry3<f64>,
}

/// Coefficients of radial (k) and tangential (p) distortion, as in OpenCV's first five.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Distortion {
    /// radial, of r²
    pub k1: f64,
    /// radial, of r⁴
    pub k2: f64,
    /// radial, of r⁶
    pub k3: f64,
    /// tangential
    pub p1: f64,
    /// tangential
    pub p2: f64,
}

impl Distortion {
    /// True for a lens that doesn't distort.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }

    /// Where the lens puts a point of the plane z = 1.
    pub fn distort(&self, ideal: Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        Vector2::new(
            x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
            y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
        )
    }

    /// Derivative of [`distort`](Self::distort) with respect to the point, row-major.
    fn jacobian(&self, ideal: Vector2<f64>) -> [[f64; 2]; 2] {
        let (x, y) = (ideal.x, ideal.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3));
        // d radial / d r², times 2 because d r²/dx = 2x
        let slope = 2.0 * (self.k1 + r2 * (2.0 * self.k2 + 3.0 * self.k3 * r2));
        let mixed = slope * x * y + 2.0 * self.p1 * x + 2.0 * self.p2 * y;
        [
            [radial + slope * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x, mixed],
            [mixed, radial + slope * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x],
        ]
    }

    /// The point of the plane z = 1 that the lens puts here: Newton's method from the distorted point itself. `None` where
    /// the distortion folds over, so that no point is.
    pub fn undistort(&self, distorted: Vector2<f64>) -> Option<Vector2<f64>> {
        if self.is_zero() {
            return Some(distorted);
        }
        let mut ideal = distorted;
        for _ in 0..20 {
            let miss = self.distort(ideal) - distorted;
            if miss.norm_squared() < 1e-24 {
                return Some(ideal);
            }
            let [[a, b], [c, d]] = self.jacobian(ideal);
            let determinant = a * d - b * c;
            if determinant.is_nan() || determinant <= 1e-6 {
                return None;
            }
            ideal -= Vector2::new(d * miss.x - b * miss.y, a * miss.y - c * miss.x) / determinant;
        }
        ((self.distort(ideal) - distorted).norm() < 1e-9).then_some(ideal)
    }
}

impl Camera {
    /// Checks that all numbers are finite, the focal lengths positive and the image not empty.
    ///
    /// # Errors
    /// [`Error::Camera`] says what is wrong.
    pub fn check(&self) -> Result<()> {
        let fail = |what: String| Err(Error::Camera { name: self.name.clone(), what });
        if self.size.contains(&0) || self.size.iter().any(|&side| side > 1 << 15) {
            return fail(format!(
                "the image is {} x {} pixels, expected 1 to 32768",
                self.size[0], self.size[1]
            ));
        }
        if !(self.focal.min() > 0.0 && self.focal.max().is_finite()) {
            return fail(format!(
                "focal lengths are {} and {}, expected positive numbers",
                self.focal.x, self.focal.y
            ));
        }
        let Distortion { k1, k2, k3, p1, p2 } = self.distortion;
        let numbers = [self.principal.x, self.principal.y, k1, k2, k3, p1, p2];
        let pose = self.camera_from_world.to_homogeneous();
        if numbers.iter().chain(pose.iter()).any(|number| !number.is_finite()) {
            return fail("a number of the calibration is not finite".into());
        }
        Ok(())
    }

    /// Position of the camera in the world, metres.
    pub fn position(&self) -> Vector3<f64> {
        self.camera_from_world.inverse().translation.vector
    }

    /// Direction in which the camera looks, in the world, unit vector.
    pub fn direction(&self) -> Vector3<f64> {
        self.camera_from_world.rotation.inverse() * Vector3::z()
    }

    /// Pixel of a point of the world, metres; `None` if it isn't in front of the camera.
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let in_camera = self.camera_from_world.rotation * point + self.camera_from_world.translation.vector;
        (in_camera.z > 1e-6).then(|| self.pixel(in_camera.xy() / in_camera.z))
    }

    /// Pixel of a point of the world and its derivative with respect to the point, pixels a metre; `None` if the point
    /// isn't in front of the camera.
    pub fn project_with_jacobian(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let rotation = self.camera_from_world.rotation.to_rotation_matrix();
        let in_camera = rotation * point + self.camera_from_world.translation.vector;
        if in_camera.z <= 1e-6 {
            return None;
        }
        let ideal = in_camera.xy() / in_camera.z;
        let [[a, b], [c, d]] = self.distortion.jacobian(ideal);
        let (fx, fy, depth) = (self.focal.x, self.focal.y, in_camera.z);
        let from_camera = Matrix2x3::new(
            fx * a / depth,
            fx * b / depth,
            -fx * (a * ideal.x + b * ideal.y) / depth,
            fy * c / depth,
            fy * d / depth,
            -fy * (c * ideal.x + d * ideal.y) / depth,
        );
        Some((self.pixel(ideal), from_camera * rotation.matrix()))
    }

    /// Direction, in the world, of the ray through a pixel, unit vector; it starts at [`position`](Self::position). `None`
    /// where the distortion folds over.
    pub fn ray(&self, pixel: Vector2<f64>) -> Option<Vector3<f64>> {
        let distorted = (pixel - self.principal).component_div(&self.focal);
        let ideal = self.distortion.undistort(distorted)?;
        Some(self.camera_from_world.rotation.inverse() * Vector3::new(ideal.x, ideal.y, 1.0).normalize())
    }

    fn pixel(&self, ideal: Vector2<f64>) -> Vector2<f64> {
        self.distortion.distort(ideal).component_mul(&self.focal) + self.principal
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    fn camera() -> Camera {
        Camera {
            name: "left".into(),
            size: [1920, 1080],
            focal: Vector2::new(1400.0, 1390.0),
            principal: Vector2::new(950.0, 545.0),
            distortion: Distortion { k1: -0.2, k2: 0.05, k3: -0.01, p1: 0.001, p2: -0.002 },
            camera_from_world: Isometry3::from_parts(
                Vector3::new(0.1, 0.9, 3.0).into(),
                UnitQuaternion::from_euler_angles(3.0, 0.2, 0.1),
            ),
        }
    }

    #[test]
    fn the_ray_of_a_pixel_meets_the_point() {
        let camera = camera();
        let point = Vector3::new(0.4, 1.3, 0.2);
        let ray = camera.ray(camera.project(&point).unwrap()).unwrap();
        let to_point = point - camera.position();
        assert!(ray.cross(&to_point).norm() < 1e-9);
        assert!(ray.dot(&to_point) > 0.0 && camera.direction().dot(&to_point) > 0.0);
    }

    #[test]
    fn the_jacobian_is_that_of_differences() {
        let camera = camera();
        let point = Vector3::new(-0.5, 0.3, 0.6);
        let (pixel, jacobian) = camera.project_with_jacobian(&point).unwrap();
        assert!((pixel - camera.project(&point).unwrap()).norm() < 1e-9);
        for axis in 0..3 {
            let mut step = Vector3::zeros();
            step[axis] = 1e-6;
            let after = camera.project(&(point + step)).unwrap();
            let before = camera.project(&(point - step)).unwrap();
            assert!(((after - before) / 2e-6 - jacobian.column(axis)).norm() < 1e-4);
        }
    }

    #[test]
    fn what_is_behind_the_camera_has_no_pixel() {
        let camera = camera();
        assert_eq!(camera.project(&(camera.position() - camera.direction())), None);
    }

    #[test]
    fn a_lens_that_folds_over_has_no_ray_there() {
        let lens = Distortion { k1: -0.5, ..Distortion::default() };
        assert_eq!(lens.undistort(Vector2::new(2.0, 0.0)), None);
        let ideal = lens.undistort(Vector2::new(0.3, 0.1)).unwrap();
        assert!((lens.distort(ideal) - Vector2::new(0.3, 0.1)).norm() < 1e-9);
    }

    #[test]
    fn a_camera_without_a_focal_length_is_refused() {
        let mut camera = camera();
        camera.focal.x = 0.0;
        assert!(camera.check().unwrap_err().to_string().contains("focal lengths are 0"));
    }
}
