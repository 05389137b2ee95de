use nalgebra::{Matrix3, Vector3};

/// A turn, a scale and a shift that bring points to others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    pub rotation: Matrix3<f64>,
    pub scale: f64,
    pub translation: Vector3<f64>,
    /// true if a mirroring would have come nearer than any turn
    pub is_mirrored: bool,
    /// the turn about the vertical alone that brings them nearest, radians
    pub yaw: f64,
}

impl Rigid {
    pub fn apply(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point * self.scale + self.translation
    }
}

/// The similarity that brings the first points of pairs nearest to the second, in least squares (Kabsch 1976,
/// Umeyama 1991; docs/papers.md#other-sources).
pub fn rigid<'a>(pairs: impl Iterator<Item = (&'a Vector3<f64>, &'a Vector3<f64>)> + Clone) -> Rigid {
    let count = pairs.clone().count().max(1) as f64;
    let (from, to) = pairs
        .clone()
        .fold((Vector3::zeros(), Vector3::zeros()), |(from, to), (a, b)| (from + a / count, to + b / count));
    let (mut covariance, mut spread) = (Matrix3::zeros(), 0.0);
    for (a, b) in pairs {
        covariance += (b - to) * (a - from).transpose() / count;
        spread += (a - from).norm_squared() / count;
    }
    let c = &covariance;
    let yaw = (c[(0, 2)] - c[(2, 0)]).atan2(c[(0, 0)] + c[(2, 2)]);
    let is_mirrored = covariance.determinant() < 0.0;
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
    let mut signs = Vector3::repeat(1.0);
    if (u * v_t).determinant() < 0.0 {
        signs[svd.singular_values.imin()] = -1.0;
    }
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let scale = svd.singular_values.dot(&signs) / spread;
    Rigid { rotation, scale, translation: to - rotation * from * scale, is_mirrored, yaw }
}
