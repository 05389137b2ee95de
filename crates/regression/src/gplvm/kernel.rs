use faer::Mat;

/// `exp(−γ/2 ‖x_i − x_j‖²)` of latent points, row-major.
pub fn smooth_kernel(latent: &[f64], dims: usize, inverse_width: f64) -> Mat<f64> {
    let count = latent.len() / dims;
    Mat::from_fn(count, count, |i, j| {
        let (a, b) = (&latent[i * dims..(i + 1) * dims], &latent[j * dims..(j + 1) * dims]);
        let squared: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
        (-0.5 * inverse_width * squared).exp()
    })
}
