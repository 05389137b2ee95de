use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::{MatMut, MatRef, Par};

/// Share of the largest principal variance below which a direction is rounding.
const NEGLIGIBLE: f64 = 1e-10;

/// Principal components of rows that are centred and weighted, X̃ (shape `[K, width]`): X̃ = Σ_i √λ_i u_i b_iᵀ, in the
/// order of falling λ. The eigenvectors are those of the smaller of X̃X̃ᵀ and X̃ᵀX̃.
pub struct Principal {
    gram: Vec<f64>,
    vectors: Vec<f64>,
    values: Vec<f64>,
    memory: MemBuffer,
    /// λ_i, shape `[count]`
    pub variances: Vec<f64>,
    /// u_i, row-major, shape `[count, K]`
    pub scores: Vec<f64>,
    /// b_i, row-major, shape `[count, width]`
    pub directions: Vec<f64>,
}

impl Principal {
    /// Memory for `rows` rows of `width` numbers.
    pub fn new(rows: usize, width: usize) -> Self {
        let side = rows.min(width);
        let scratch =
            self_adjoint_evd_scratch::<f64>(side, ComputeEigenvectors::Yes, Par::Seq, Default::default());
        Self {
            gram: vec![0.0; side * side],
            vectors: vec![0.0; side * side],
            values: vec![0.0; side],
            memory: MemBuffer::new(scratch),
            variances: Vec::with_capacity(side),
            scores: vec![0.0; side * rows],
            directions: vec![0.0; side * width],
        }
    }

    /// Number of components.
    pub fn len(&self) -> usize {
        self.variances.len()
    }

    /// Finds the components of `rows`, row-major, shape `[count, width]`. There are none where all rows are zero or
    /// one is not a number.
    pub fn decompose(&mut self, rows: &[f64], count: usize, width: usize) {
        let is_tall = count > width;
        let side = count.min(width);
        self.variances.clear();
        let x = MatRef::from_row_major_slice(rows, count, width);
        let mut gram = MatMut::from_column_major_slice_mut(&mut self.gram[..side * side], side, side);
        let (left, right) = if is_tall { (x.transpose(), x) } else { (x, x.transpose()) };
        faer::linalg::matmul::matmul(gram.as_mut(), faer::Accum::Replace, left, right, 1.0, Par::Seq);
        let found = self_adjoint_evd(
            gram.as_ref(),
            DiagMut::from_slice_mut(&mut self.values[..side]),
            Some(MatMut::from_column_major_slice_mut(&mut self.vectors[..side * side], side, side)),
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        let largest = self.values[side - 1];
        let is_found = found.is_ok() && largest.is_finite();
        if !is_found {
            return;
        }
        // Eigenvalues rise.
        for i in (0..side).rev() {
            let variance = self.values[i];
            let counts = variance > NEGLIGIBLE * largest && variance > f64::MIN_POSITIVE;
            if !counts {
                break;
            }
            let n = self.variances.len();
            self.variances.push(variance);
            let vector = &self.vectors[i * side..(i + 1) * side];
            let (score, direction) = (
                &mut self.scores[n * count..(n + 1) * count],
                &mut self.directions[n * width..(n + 1) * width],
            );
            let scale = variance.sqrt().recip();
            if is_tall {
                direction.copy_from_slice(vector);
                for (s, row) in score.iter_mut().zip(rows.chunks_exact(width)) {
                    *s = scale * row.iter().zip(vector).map(|(a, b)| a * b).sum::<f64>();
                }
            } else {
                score.copy_from_slice(vector);
                direction.fill(0.0);
                for (u, row) in vector.iter().zip(rows.chunks_exact(width)) {
                    direction.iter_mut().zip(row).for_each(|(b, v)| *b += scale * u * v);
                }
            }
        }
    }

    /// The component `i`: λ_i, u_i over `count` rows, b_i over `width` numbers.
    pub fn component(&self, i: usize, count: usize, width: usize) -> (f64, &[f64], &[f64]) {
        let (u, b) = (&self.scores[i * count..(i + 1) * count], &self.directions[i * width..(i + 1) * width]);
        (self.variances[i], u, b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_put_the_rows_together_again() {
        for (count, width) in [(5, 9), (9, 5), (1, 3), (4, 4), (64, 62), (64, 142), (100, 62)] {
            let rows: Vec<f64> =
                (0..count * width).map(|i| (i as f64 * 0.7 + (i as f64).sqrt()).sin()).collect();
            let mut principal = Principal::new(count + 3, width);
            principal.decompose(&rows, count, width);
            assert!(principal.variances.is_sorted_by(|a, b| a >= b));
            for (i, row) in rows.chunks_exact(width).enumerate() {
                for (j, expected) in row.iter().enumerate() {
                    let found: f64 = (0..principal.len())
                        .map(|n| principal.component(n, count, width))
                        .map(|(variance, u, b)| variance.sqrt() * u[i] * b[j])
                        .sum();
                    // Components are left out below 1e-5 of the largest standard deviation.
                    assert!((found - expected).abs() < 1e-4, "{count} × {width}: {found} {expected}");
                }
            }
        }
    }

    #[test]
    fn rows_of_zeros_have_no_component() {
        let mut principal = Principal::new(4, 3);
        principal.decompose(&[0.0; 12], 4, 3);
        assert_eq!(principal.len(), 0);
    }
}
