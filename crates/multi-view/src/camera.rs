use model::{Camera, Distortion};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A camera as jobs hand it on: the numbers of [`Camera`], to the bit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// name, unique in the session
    pub name: String,
    /// width and height of the image, pixels
    pub size: [u32; 2],
    /// focal lengths along u and v, pixels
    pub focal: [f64; 2],
    /// where the optical axis meets the image, pixels
    pub principal: [f64; 2],
    /// k1, k2, p1, p2, k3, as OpenCV orders them
    pub distortion: [f64; 5],
    /// unit quaternion x, y, z, w that takes directions of the world into the camera
    pub rotation: [f64; 4],
    /// the world's origin in the camera, metres
    pub translation: [f64; 3],
}

impl From<&Camera> for CameraRecord {
    fn from(camera: &Camera) -> Self {
        let Distortion { k1, k2, k3, p1, p2 } = camera.distortion;
        Self {
            name: camera.name.clone(),
            size: camera.size,
            focal: camera.focal.into(),
            principal: camera.principal.into(),
            distortion: [k1, k2, p1, p2, k3],
            rotation: camera.camera_from_world.rotation.coords.into(),
            translation: camera.camera_from_world.translation.vector.into(),
        }
    }
}

impl CameraRecord {
    /// The camera.
    ///
    /// # Errors
    /// As [`Camera::check`].
    pub fn camera(&self) -> Result<Camera, model::Error> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let [x, y, z, w] = self.rotation;
        let camera = Camera {
            name: self.name.clone(),
            size: self.size,
            focal: Vector2::from(self.focal),
            principal: Vector2::from(self.principal),
            distortion: Distortion { k1, k2, k3, p1, p2 },
            // it was of unit length when it was written, and is to stay the same to the bit
            camera_from_world: Isometry3::from_parts(
                Vector3::from(self.translation).into(),
                UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
            ),
        };
        camera.check()?;
        Ok(camera)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_comes_back_from_json_to_the_bit() {
        let camera = Camera {
            name: "left".into(),
            size: [1920, 1080],
            focal: Vector2::new(1400.1, 1390.2),
            principal: Vector2::new(950.3, 545.7),
            distortion: Distortion { k1: -0.2, k2: 0.05, k3: -0.01, p1: 0.001, p2: -0.002 },
            camera_from_world: Isometry3::from_parts(
                Vector3::new(0.1, 0.9, 3.0).into(),
                UnitQuaternion::from_euler_angles(3.0, 0.2, 0.1),
            ),
        };
        let text = serde_json::to_string(&CameraRecord::from(&camera)).unwrap();
        let record: CameraRecord = serde_json::from_str(&text).unwrap();
        assert_eq!(record.camera().unwrap(), camera);
    }
}
