//! The few dense operations of a step, on row-major slices; the matrices are at most 18 × 18.

/// Solves `A x = b` for a symmetric positive definite A of size n, row-major, of which the lower triangle is read. A
/// becomes its Cholesky factor, `b` the solution. `false` if a pivot is not positive.
pub fn solve_positive_definite(a: &mut [f64], n: usize, b: &mut [f64]) -> bool {
    if !cholesky(a, n) {
        return false;
    }
    solve_lower(a, n, b);
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|j| a[j * n + i] * b[j]).sum();
        b[i] = (b[i] - sum) / a[i * n + i];
    }
    true
}

/// Cholesky factor in the lower triangle.
pub fn cholesky(a: &mut [f64], n: usize) -> bool {
    for j in 0..n {
        let square: f64 = a[j * n..j * n + j].iter().map(|v| v * v).sum();
        let pivot = a[j * n + j] - square;
        // Also where it is not a number.
        let is_positive = pivot > 0.0;
        if !is_positive {
            return false;
        }
        let pivot = pivot.sqrt();
        a[j * n + j] = pivot;
        for i in j + 1..n {
            let product: f64 = (0..j).map(|k| a[i * n + k] * a[j * n + k]).sum();
            a[i * n + j] = (a[i * n + j] - product) / pivot;
        }
    }
    true
}

/// `b ← L⁻¹ b`.
pub fn solve_lower(a: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let sum: f64 = (0..i).map(|j| a[i * n + j] * b[j]).sum();
        b[i] = (b[i] - sum) / a[i * n + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_system_is_solved() {
        let mut a = [4.0, 0.0, 0.0, 2.0, 5.0, 0.0, 1.0, 3.0, 6.0];
        let mut b = [4.0 + 2.0 * 2.0 + 3.0, 2.0 + 5.0 * 2.0 + 9.0, 1.0 + 6.0 + 18.0];
        assert!(solve_positive_definite(&mut a, 3, &mut b));
        for (found, expected) in b.iter().zip([1.0, 2.0, 3.0]) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn an_indefinite_matrix_is_noticed() {
        assert!(!solve_positive_definite(&mut [1.0, 2.0, 2.0, 1.0], 2, &mut [0.0, 0.0]));
        assert!(!solve_positive_definite(&mut [f64::NAN], 1, &mut [0.0]));
    }
}
