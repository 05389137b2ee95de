use pulp::{Arch, Simd, WithSimd};

/// Rows of a block.
const R: usize = 4;

/// Upper triangle of `A Aᵀ` into `out[i · stride + j]`, j ≥ i. `rows` is A, shape `[count, width]`.
pub fn gram(rows: &[f64], count: usize, width: usize, out: &mut [f64], stride: usize) {
    assert!(rows.len() >= count * width && stride >= count && out.len() + stride >= count * stride + count);
    Arch::new().dispatch(Gram { rows, count, width, out, stride });
}

struct Gram<'a> {
    rows: &'a [f64],
    count: usize,
    width: usize,
    out: &'a mut [f64],
    stride: usize,
}

impl WithSimd for Gram<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, count, width, out, stride } = self;
        let row = |i: usize| &rows[i * width..(i + 1) * width];
        if count < R {
            for i in 0..count {
                for j in i..count {
                    out[i * stride + j] = inner::<S, 1, 1>(simd, [row(i)], [row(j)])[0][0];
                }
            }
            return;
        }
        // The last blocks overlap those before: every product is the same sum, whichever block it is in.
        for i in (0..count).step_by(R).map(|i| i.min(count - R)) {
            let left = [row(i), row(i + 1), row(i + 2), row(i + 3)];
            for j in (i..count).step_by(2).map(|j| j.min(count - 2)) {
                let found = inner::<S, R, 2>(simd, left, [row(j), row(j + 1)]);
                for (r, found) in found.into_iter().enumerate() {
                    for (c, found) in found.into_iter().enumerate() {
                        if j + c >= i + r {
                            out[(i + r) * stride + j + c] = found;
                        }
                    }
                }
            }
        }
    }
}

/// Inner products of some rows with others, all of one length.
#[inline(always)]
fn inner<S: Simd, const M: usize, const N: usize>(
    simd: S,
    left: [&[f64]; M],
    right: [&[f64]; N],
) -> [[f64; N]; M] {
    let left = left.map(|row| S::as_simd_f64s(row));
    let right = right.map(|row| S::as_simd_f64s(row));
    let steps = left[0].0.len();
    let left_heads = left.map(|(head, _)| &head[..steps]);
    let right_heads = right.map(|(head, _)| &head[..steps]);
    let mut sums = [[simd.splat_f64s(0.0); N]; M];
    for p in 0..steps {
        let b = right_heads.map(|row| row[p]);
        for r in 0..M {
            let a = left_heads[r][p];
            for c in 0..N {
                sums[r][c] = simd.mul_add_e_f64s(a, b[c], sums[r][c]);
            }
        }
    }
    let mut out = [[0.0; N]; M];
    for r in 0..M {
        for c in 0..N {
            let rest: f64 = left[r].1.iter().zip(right[c].1).map(|(a, b)| a * b).sum();
            out[r][c] = simd.reduce_sum_f64s(sums[r][c]) + rest;
        }
    }
    out
}

/// Inner products of the rows of A with a vector: `out[i] = A_i · v`. `rows` is A, shape `[out, v]`.
pub fn products(rows: &[f64], v: &[f64], out: &mut [f64]) {
    assert!(rows.len() >= out.len() * v.len());
    Arch::new().dispatch(Products { rows, v, out });
}

struct Products<'a> {
    rows: &'a [f64],
    v: &'a [f64],
    out: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, v, out } = self;
        let row = |i: usize| &rows[i * v.len()..(i + 1) * v.len()];
        if out.len() < R {
            for (i, out) in out.iter_mut().enumerate() {
                *out = inner::<S, 1, 1>(simd, [row(i)], [v])[0][0];
            }
            return;
        }
        let last = out.len() - R;
        for i in (0..out.len()).step_by(R).map(|i| i.min(last)) {
            let found = inner::<S, R, 1>(simd, [row(i), row(i + 1), row(i + 2), row(i + 3)], [v]);
            for (out, found) in out[i..i + R].iter_mut().zip(found) {
                *out = found[0];
            }
        }
    }
}

/// `LᵀB` into `out`, shape `[n, columns]`, for a lower triangular L of size n (zeros above the diagonal stored).
///
/// L and B are columns `left` and `right` onwards of one matrix `m` of n rows at a distance of `stride` numbers.
pub fn transposed_product(
    m: &[f64],
    n: usize,
    stride: usize,
    [left, right]: [usize; 2],
    columns: usize,
    out: &mut [f64],
) {
    assert!(left + n <= stride && right + columns <= stride);
    assert!(m.len() >= n * stride && out.len() >= n * columns);
    Arch::new().dispatch(TransposedProduct { m: &m[..n * stride], n, stride, left, right, columns, out });
}

struct TransposedProduct<'a> {
    m: &'a [f64],
    n: usize,
    stride: usize,
    left: usize,
    right: usize,
    columns: usize,
    out: &'a mut [f64],
}

impl WithSimd for TransposedProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { m, n, stride, left, right, columns, out } = self;
        let chunk = 2 * S::F64_LANES;
        if n < R || columns < chunk {
            for i in 0..n {
                for j in 0..columns {
                    let terms = m.chunks_exact(stride).skip(i).map(|row| row[left + i] * row[right + j]);
                    out[i * columns + j] = terms.sum();
                }
            }
            return;
        }
        for i in (0..n).step_by(R).map(|i| i.min(n - R)) {
            let from = &m[i * stride..];
            for j in (0..columns).step_by(chunk).map(|j| j.min(columns - chunk)) {
                let sums = block(simd, (from, stride, left + i), (from, stride, right + j));
                store(&mut out[i * columns..], columns, j, sums, simd);
            }
        }
    }
}

/// `EᵀE` into `out`, shape `[columns, columns]`. `rows` is E, shape `[any, columns]`.
pub fn self_product(rows: &[f64], columns: usize, out: &mut [f64]) {
    assert!(columns > 0 && rows.len().is_multiple_of(columns) && out.len() == columns * columns);
    Arch::new().dispatch(SelfProduct { rows, columns, out });
    for i in 0..columns {
        for j in 0..i {
            out[i * columns + j] = out[j * columns + i];
        }
    }
}

struct SelfProduct<'a> {
    rows: &'a [f64],
    columns: usize,
    out: &'a mut [f64],
}

impl WithSimd for SelfProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { rows, columns, out } = self;
        let chunk = 2 * S::F64_LANES;
        if columns < chunk.max(R) {
            for i in 0..columns {
                for j in i..columns {
                    out[i * columns + j] = rows.chunks_exact(columns).map(|row| row[i] * row[j]).sum();
                }
            }
            return;
        }
        for i in (0..columns).step_by(R).map(|i| i.min(columns - R)) {
            for j in (i..columns).step_by(chunk).map(|j| j.min(columns - chunk)) {
                let sums = block(simd, (rows, columns, i), (rows, columns, j));
                store(&mut out[i * columns..], columns, j, sums, simd);
            }
        }
    }
}

/// `A B` for three rows A of which only the columns `chosen` are not zero. `a` has shape `[3, n]`, `b` `[n, columns]`, `out`
/// `[3, columns]`.
pub fn selected_product(a: &[f64], chosen: &[usize], b: &[f64], columns: usize, out: &mut [f64]) {
    let n = a.len() / 3;
    assert!(a.len() == 3 * n && b.len() == n * columns && out.len() == 3 * columns);
    Arch::new().dispatch(SelectedProduct { a, chosen, b, columns, out });
}

struct SelectedProduct<'a> {
    a: &'a [f64],
    chosen: &'a [usize],
    b: &'a [f64],
    columns: usize,
    out: &'a mut [f64],
}

impl WithSimd for SelectedProduct<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { a, chosen, b, columns, out } = self;
        let n = a.len() / 3;
        let rows = [&a[..n], &a[n..2 * n], &a[2 * n..]];
        let chunk = 2 * S::F64_LANES;
        if columns < chunk {
            for (row, out) in rows.iter().zip(out.chunks_exact_mut(columns)) {
                for (j, out) in out.iter_mut().enumerate() {
                    *out = chosen.iter().map(|&d| row[d] * b[d * columns + j]).sum();
                }
            }
            return;
        }
        for j in (0..columns).step_by(chunk).map(|j| j.min(columns - chunk)) {
            let mut sums = [[simd.splat_f64s(0.0); 2]; 3];
            for &d in chosen {
                let (values, _) = S::as_simd_f64s(&b[d * columns + j..][..chunk]);
                for r in 0..3 {
                    let factor = simd.splat_f64s(rows[r][d]);
                    for c in 0..2 {
                        sums[r][c] = simd.mul_add_e_f64s(factor, values[c], sums[r][c]);
                    }
                }
            }
            for (row, sums) in out.chunks_exact_mut(columns).zip(sums) {
                let (head, _) = S::as_mut_simd_f64s(&mut row[j..j + chunk]);
                head.copy_from_slice(&sums);
            }
        }
    }
}

/// Sums over the rows of `a[i + r] · b[j..]`, two vectors wide. A matrix comes with the distance of its rows and the
/// column to begin at.
#[inline(always)]
pub(crate) fn block<S: Simd>(
    simd: S,
    (a, a_stride, i): (&[f64], usize, usize),
    (b, b_stride, j): (&[f64], usize, usize),
) -> [[S::f64s; 2]; R] {
    let mut sums = [[simd.splat_f64s(0.0); 2]; R];
    for (a, b) in a.chunks(a_stride).zip(b.chunks(b_stride)) {
        let factors = &a[i..i + R];
        let (values, _) = S::as_simd_f64s(&b[j..j + 2 * S::F64_LANES]);
        for r in 0..R {
            let factor = simd.splat_f64s(factors[r]);
            for c in 0..2 {
                sums[r][c] = simd.mul_add_e_f64s(factor, values[c], sums[r][c]);
            }
        }
    }
    sums
}

#[inline(always)]
fn store<S: Simd>(out: &mut [f64], stride: usize, j: usize, sums: [[S::f64s; 2]; R], _: S) {
    for (row, sums) in out.chunks_mut(stride).zip(sums) {
        let (head, _) = S::as_mut_simd_f64s(&mut row[j..j + 2 * S::F64_LANES]);
        head.copy_from_slice(&sums);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests_numbers::numbers;

    #[test]
    fn products_of_rows_are_their_inner_products() {
        for (count, width) in [(1, 1), (3, 5), (4, 8), (7, 19), (64, 142)] {
            let (a, v) = (numbers(count * width, 1), numbers(width, 2));
            let row = |i: usize| &a[i * width..(i + 1) * width];
            let inner = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            let mut found = vec![0.0; count * count];
            gram(&a, count, width, &mut found, count);
            for i in 0..count {
                for j in i..count {
                    assert!(
                        (found[i * count + j] - inner(row(i), row(j))).abs() < 1e-12,
                        "{i} {j} of {count}"
                    );
                }
            }
            let mut found = vec![0.0; count];
            products(&a, &v, &mut found);
            for (i, found) in found.into_iter().enumerate() {
                assert!((found - inner(row(i), &v)).abs() < 1e-12, "{i} of {count}");
            }
        }
    }

    #[test]
    fn products_of_columns_are_sums_over_the_rows() {
        for (rows, columns) in [(1, 1), (3, 3), (5, 8), (64, 62), (6, 17)] {
            let e = numbers(rows * columns, 3);
            let mut found = vec![f64::NAN; columns * columns];
            self_product(&e, columns, &mut found);
            for i in 0..columns {
                for j in 0..columns {
                    let expected: f64 = e.chunks_exact(columns).map(|row| row[i] * row[j]).sum();
                    assert!((found[i * columns + j] - expected).abs() < 1e-12, "{i} {j} of {columns}");
                }
            }
        }
    }

    #[test]
    fn columns_that_are_zero_are_left_out() {
        for columns in [3, 8, 62] {
            let (n, chosen) = (11, [1, 2, 5, 10]);
            let (mut a, b) = (numbers(3 * n, 7), numbers(n * columns, 8));
            (0..3 * n).filter(|i| !chosen.contains(&(i % n))).for_each(|i| a[i] = 0.0);
            let mut found = vec![f64::NAN; 3 * columns];
            selected_product(&a, &chosen, &b, columns, &mut found);
            for i in 0..3 {
                for j in 0..columns {
                    let expected: f64 = (0..n).map(|p| a[i * n + p] * b[p * columns + j]).sum();
                    assert!((found[i * columns + j] - expected).abs() < 1e-12, "{i} {j} of {columns}");
                }
            }
        }
    }

    #[test]
    fn a_triangle_is_multiplied_from_its_diagonal_on() {
        for (n, columns) in [(1, 1), (5, 3), (12, 18), (64, 62)] {
            let stride = crate::stride(n + columns);
            let mut m = numbers(n * stride, 4);
            for i in 0..n {
                m[i * stride + i + 1..i * stride + n].fill(0.0);
            }
            let mut found = vec![f64::NAN; n * columns];
            transposed_product(&m, n, stride, [0, n], columns, &mut found);
            for i in 0..n {
                for j in 0..columns {
                    let terms = (i..n).map(|p| m[p * stride + i] * m[p * stride + n + j]);
                    let expected: f64 = terms.sum();
                    assert!((found[i * columns + j] - expected).abs() < 1e-12, "{i} {j} of {n}");
                }
            }
        }
    }
}
