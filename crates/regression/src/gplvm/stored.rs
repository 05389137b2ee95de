/// What a model is made of: what training finds and files hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    pub dofs: usize,
    pub latent_dims: usize,
    /// γ
    pub inverse_width: f64,
    /// β⁻¹
    pub noise: f64,
    /// μ, shape `[features]`; a feature is a number of the pose or, after them, of the velocity
    pub mean: Vec<f64>,
    /// w_k⁻², shape `[features]`; 0 where a feature takes no part
    pub variances: Vec<f64>,
    /// x_i, row-major, shape `[active, latent_dims]`
    pub latent: Vec<f64>,
    /// Y − μ, row-major, shape `[active, features]`
    pub features: Vec<f64>,
}
