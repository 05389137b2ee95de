use pulp::{Arch, Simd, WithSimd};

/// `sum += factor · row`, of equal length.
pub fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (s, v) in sum.iter_mut().zip(row) {
        *s += factor * v;
    }
}

/// `a · b`, in four lanes; of equal length.
pub fn inner_product(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        for i in 0..4 {
            lanes[i] += x[i] * y[i];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

/// `out[j] += Σ_k weights[k] · rows[k, j]`. `rows` has shape `[weights, out]` at a distance of `stride` numbers.
pub fn weighted_sum(rows: &[f64], stride: usize, weights: &[f64], out: &mut [f64]) {
    assert!(weights.is_empty() || rows.len() >= (weights.len() - 1) * stride + out.len());
    Arch::new().dispatch(WeightedSum { rows, stride, weights, out });
}

struct WeightedSum<'a> {
    rows: &'a [f64],
    stride: usize,
    weights: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for WeightedSum<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, stride, weights, out } = self;
        for (row, weight) in rows.chunks(stride).zip(weights) {
            let factor = simd.splat_f64s(*weight);
            let row = &row[..out.len()];
            let (sums, sums_rest) = S::as_mut_simd_f64s(out);
            let (values, values_rest) = S::as_simd_f64s(row);
            for (s, v) in sums.iter_mut().zip(values) {
                *s = simd.mul_add_e_f64s(factor, *v, *s);
            }
            for (s, v) in sums_rest.iter_mut().zip(values_rest) {
                *s += weight * v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_summed_with_their_weights() {
        let rows: Vec<f64> = (0..60).map(f64::from).collect();
        let mut out = [1.0; 19];
        weighted_sum(&rows, 20, &[1.0, -2.0, 0.5], &mut out);
        for (j, found) in out.into_iter().enumerate() {
            let j = j as f64;
            assert!((found - (1.0 + j - 2.0 * (20.0 + j) + 0.5 * (40.0 + j))).abs() < 1e-12);
        }
    }
}
