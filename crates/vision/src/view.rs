use model::Camera;
use nalgebra::{Matrix3, Vector2, Vector3};

/// A camera made ready for projecting many points, at full or reduced resolution.
///
/// At scale s a pixel of the view is a block of s × s pixels of the camera's image, and its centre is the centre of that
/// block: pixel (X, Y) of the view lies at (sX + (s − 1)/2, sY + (s − 1)/2) of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// width and height, pixels of the view
    pub size: [usize; 2],
    /// pixels of the camera's image along a side of a pixel of the view
    pub scale: usize,
    /// the same camera with the pixels of the view
    pub camera: Camera,
    /// position of the camera in the world, metres
    pub position: Vector3<f64>,
    rotation: Matrix3<f64>,
    translation: Vector3<f64>,
    is_distorted: bool,
    /// squared distance from the axis, on the plane z = 1, from which on the lens folds over
    folds_at: f64,
}

/// Nearest that a point may be to the plane of the camera, metres.
const NEAR_M: f64 = 0.01;

impl View {
    /// The view of a camera at the resolution of its image.
    pub fn new(camera: &Camera) -> Self {
        Self::reduced(camera, 1)
    }

    /// The view of a camera with `scale` times fewer pixels along each side (rounded up).
    ///
    /// # Panics
    /// If `scale` is 0.
    pub fn reduced(camera: &Camera, scale: usize) -> Self {
        assert!(scale > 0, "a view has a scale of at least 1");
        let size = camera.size.map(|side| (side as usize).div_ceil(scale));
        let mut camera = camera.clone();
        camera.size = size.map(|side| side as u32);
        camera.focal /= scale as f64;
        camera.principal = reduced_pixel(camera.principal, scale);
        Self {
            size,
            scale,
            position: camera.position(),
            rotation: *camera.camera_from_world.rotation.to_rotation_matrix().matrix(),
            translation: camera.camera_from_world.translation.vector,
            is_distorted: !camera.distortion.is_zero(),
            folds_at: folds_at(&camera),
            camera,
        }
    }

    /// Pixel of the view and depth (metres along the axis) of a point of the world; `None` for points less than a
    /// centimetre in front of the camera, and where the lens folds over.
    #[inline]
    pub fn project(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, f64)> {
        let in_camera = self.rotation * point + self.translation;
        if in_camera.z < NEAR_M {
            return None;
        }
        let inverse = 1.0 / in_camera.z;
        let mut ideal = Vector2::new(in_camera.x * inverse, in_camera.y * inverse);
        if self.is_distorted {
            if ideal.norm_squared() >= self.folds_at {
                return None;
            }
            ideal = self.camera.distortion.distort(ideal);
        }
        Some((ideal.component_mul(&self.camera.focal) + self.camera.principal, in_camera.z))
    }
}

/// Where a pixel of an image lies in the image with `scale` times fewer pixels along each side.
pub fn reduced_pixel(pixel: Vector2<f64>, scale: usize) -> Vector2<f64> {
    (pixel - Vector2::repeat((scale - 1) as f64 / 2.0)) / scale as f64
}

/// First r² where r times the radial factor stops growing.
fn folds_at(camera: &Camera) -> f64 {
    let lens = camera.distortion;
    let slope = |r2: f64| 1.0 + r2 * (3.0 * lens.k1 + r2 * (5.0 * lens.k2 + r2 * 7.0 * lens.k3));
    // steps of r up to 84 degrees from the axis, finer than any lens bends
    (1..2000)
        .map(|i| f64::from(i) * 0.005)
        .map(|r| r * r)
        .find(|&r2| slope(r2) <= 0.0)
        .unwrap_or(f64::INFINITY)
}
