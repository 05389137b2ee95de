use nalgebra::{DMatrix, DVector};

/// What measured frames say of the offsets: a Gaussian in information form.
pub struct ZeroPoseInformation {
    /// shape `[dofs, dofs]`
    pub precision: DMatrix<f64>,
    /// shape `[dofs]`
    pub vector: DVector<f64>,
}

impl ZeroPoseInformation {
    /// Nothing is known yet.
    pub fn none(dofs: usize) -> Self {
        Self { precision: DMatrix::zeros(dofs, dofs), vector: DVector::zeros(dofs) }
    }
}
