use pulp::{Arch, Simd, WithSimd};

use crate::products::block;
use crate::{PAD, ROWS};

/// Cholesky factor and forward substitution in one pass.
///
/// `m` holds `[A | B]` row by row, `stride` numbers from one row to the next: the upper triangle of a positive definite A of
/// size n first, then any number of columns. It becomes `[U | U⁻ᵀ B]` with `UᵀU = A` (below U's diagonal: nothing of use).
/// n is a multiple of [`ROWS`] (pad A with ones on its diagonal); the number of columns that are worked on is that of whole
/// multiples of [`PAD`] in `stride`. If `identity` names a column where an identity matrix begins (which becomes the lower
/// triangular `U⁻ᵀ`), its zeros are not multiplied.
///
/// A square of a pivot below `floor`, or that is not a number, is taken to be `floor`: the result then is `false`.
pub fn eliminate(m: &mut [f64], n: usize, stride: usize, identity: Option<usize>, floor: f64) -> bool {
    assert!(n.is_multiple_of(ROWS) && n <= stride && m.len() >= n * stride);
    Arch::new().dispatch(Eliminate { m: &mut m[..n * stride], stride, identity, floor })
}

struct Eliminate<'a> {
    m: &'a mut [f64],
    stride: usize,
    identity: Option<usize>,
    floor: f64,
}

impl WithSimd for Eliminate<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let Self { m, stride, identity, floor } = self;
        let n = m.len() / stride;
        let chunk = 2 * S::F64_LANES;
        let columns = stride / PAD * PAD;
        let mut is_positive = true;
        for i in (0..n).step_by(ROWS) {
            let (above, rows) = m.split_at_mut(i * stride);
            let (corner, inverse, is_good) = corner(above, rows, stride, i, floor);
            is_positive &= is_good;
            let (row_0, rest) = rows.split_at_mut(stride);
            let (row_1, rest) = rest.split_at_mut(stride);
            let (row_2, rest) = rest.split_at_mut(stride);
            let rows = [row_0, row_1, row_2, &mut rest[..stride]];
            for j in (i / chunk * chunk..columns).step_by(chunk) {
                let from = match identity {
                    // Columns of the identity that no row has reached yet.
                    Some(first) if (first + i + ROWS..first + n).contains(&j) => continue,
                    Some(first) if j >= first && j < first + n => j - first,
                    _ => 0,
                };
                let above = above.get(from * stride..).unwrap_or_default();
                let sums = block(simd, (above, stride, i), (above, stride, j));
                let mut solved = [[simd.splat_f64s(0.0); 2]; ROWS];
                for r in 0..ROWS {
                    let (values, _) = S::as_mut_simd_f64s(&mut rows[r][j..j + chunk]);
                    for c in 0..2 {
                        let mut value = simd.sub_f64s(values[c], sums[r][c]);
                        for q in 0..r {
                            let factor = simd.splat_f64s(-corner[q][r]);
                            value = simd.mul_add_e_f64s(factor, solved[q][c], value);
                        }
                        solved[r][c] = simd.mul_f64s(value, simd.splat_f64s(inverse[r]));
                        values[c] = solved[r][c];
                    }
                }
            }
        }
        is_positive
    }
}

/// The factor's block on the diagonal at row `i` (its upper triangle), the inverses of its pivots, and whether all of them
/// were positive.
#[inline(always)]
fn corner(
    above: &[f64],
    rows: &[f64],
    stride: usize,
    i: usize,
    floor: f64,
) -> ([[f64; ROWS]; ROWS], [f64; ROWS], bool) {
    let mut sums = [[0.0; ROWS]; ROWS];
    for row in above.chunks_exact(stride) {
        let factors = &row[i..i + ROWS];
        for r in 0..ROWS {
            for s in 0..ROWS {
                sums[r][s] += factors[r] * factors[s];
            }
        }
    }
    let mut u = [[0.0; ROWS]; ROWS];
    let mut inverse = [0.0; ROWS];
    let mut is_good = true;
    for r in 0..ROWS {
        for s in r..ROWS {
            let known: f64 = (0..r).map(|q| u[q][r] * u[q][s]).sum();
            u[r][s] = rows[r * stride + i + s] - sums[r][s] - known;
        }
        // Also where it is not a number.
        let is_above = u[r][r] > floor;
        if !is_above {
            is_good = false;
            u[r][r] = floor;
        }
        inverse[r] = 1.0 / u[r][r].sqrt();
        u[r][r..].iter_mut().for_each(|v| *v *= inverse[r]);
    }
    (u, inverse, is_good)
}

/// Solves `U x = b` in place for the factor that [`eliminate`] left in `m`.
pub fn solve_upper(m: &[f64], n: usize, stride: usize, b: &mut [f64]) {
    for i in (0..n).rev() {
        let row = &m[i * stride..][..n];
        let known: f64 = row[i + 1..].iter().zip(&b[i + 1..n]).map(|(u, x)| u * x).sum();
        b[i] = (b[i] - known) / row[i];
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use faer::prelude::Solve;

    use super::*;
    use crate::tests_numbers::numbers;

    /// A of size n (padded), columns B, and an identity.
    fn system(n: usize, columns: usize) -> (Vec<f64>, usize, usize, usize) {
        let size = crate::padded(n, ROWS);
        let right = crate::padded(n, PAD);
        let identity = right + crate::padded(columns, PAD);
        let stride = crate::stride(identity + crate::padded(n, PAD));
        let root = numbers(n * n, 5);
        let mut m = vec![0.0; size * stride];
        for i in 0..size {
            for j in i..n {
                m[i * stride + j] = (0..n).map(|p| root[p * n + i] * root[p * n + j]).sum::<f64>();
            }
            m[i * stride + i] += 1.0;
            m[i * stride + identity + i] = 1.0;
        }
        for (i, row) in numbers(n * columns, 6).chunks_exact(columns).enumerate() {
            m[i * stride + right..][..columns].copy_from_slice(row);
        }
        (m, size, right, identity)
    }

    #[test]
    fn factor_and_inverse_are_those_of_a_large_library() {
        for (n, columns) in [(1, 1), (3, 2), (18, 5), (63, 17), (64, 63)] {
            let (mut m, size, right, identity) = system(n, columns);
            let stride = m.len() / size;
            let a = Mat::<f64>::from_fn(n, n, |i, j| m[i.min(j) * stride + i.max(j)]);
            let b = Mat::<f64>::from_fn(n, columns, |i, j| m[i * stride + right + j]);
            assert!(eliminate(&mut m, size, stride, Some(identity), 1e-12));
            let factor = a.llt(faer::Side::Lower).unwrap();
            let lower = factor.L();
            let solved = lower.partial_piv_lu().solve(&b);
            let inverse = lower.partial_piv_lu().solve(Mat::<f64>::identity(n, n));
            for i in 0..n {
                let row = &m[i * stride..][..stride];
                for j in i..n {
                    assert!((row[j] - lower[(j, i)]).abs() < 1e-9, "factor {i} {j} of {n}");
                }
                for j in 0..columns {
                    assert!((row[right + j] - solved[(i, j)]).abs() < 1e-9, "right side {i} {j} of {n}");
                }
                for j in 0..n {
                    assert!((row[identity + j] - inverse[(i, j)]).abs() < 1e-9, "inverse {i} {j} of {n}");
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_is_noticed() {
        for bad in [-1.0, 0.0, f64::NAN] {
            let mut m = vec![0.0; ROWS * PAD];
            (0..ROWS).for_each(|i| m[i * PAD + i] = 1.0);
            m[2 * PAD + 2] = bad;
            assert!(!eliminate(&mut m, ROWS, PAD, None, 1e-12), "{bad}");
        }
    }
}
