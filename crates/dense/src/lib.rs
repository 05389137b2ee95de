//! The few operations on small dense matrices that a frame consists of, in double precision and without memory of
//! their own.
//!
//! Matrices are row-major slices. Each operation is compiled for several instruction sets and takes the best that the
//! processor has ([`pulp`]); the order of sums depends on that alone, never on the number of threads, so that one kind of
//! processor always gives the same bits.
//!
//! - [`gram`], [`products`]: inner products of rows.
//! - [`eliminate`]: Cholesky factor and forward substitution in one pass.
//! - [`transposed_product`], [`self_product`]: `AᵀB` and `AᵀA`.
//! - [`selected_product`]: a product with a matrix of few columns that are not zero.
//! - [`add_scaled`], [`weighted_sum`], [`inner_product`]: sums of rows.
//!
//! Kernels of large matrix libraries may end with the upper halves of the vector registers in use, and all that is compiled
//! for older processors then runs at a third of its speed until something clears them. These clear them.
//!
//! ```
//! // [4 2; 2 5] x = [8; 9], written as rows [A | b], padded to four rows and a multiple of PAD columns.
//! let stride = 2 * dense::PAD;
//! let mut m = vec![0.0; 4 * stride];
//! (m[0], m[1], m[stride + 1]) = (4.0, 2.0, 5.0);
//! (m[2 * stride + 2], m[3 * stride + 3]) = (1.0, 1.0);
//! (m[dense::PAD], m[stride + dense::PAD]) = (8.0, 9.0);
//! assert!(dense::eliminate(&mut m, 4, stride, None, 1e-12));
//! let mut x = [m[dense::PAD], m[stride + dense::PAD]];
//! dense::solve_upper(&m, 2, stride, &mut x);
//! assert!((x[0] - 1.375).abs() < 1e-12 && (x[1] - 1.25).abs() < 1e-12);
//! ```

mod eliminate;
mod products;
mod rows;

pub use eliminate::{eliminate, solve_upper};
pub use products::{gram, products, selected_product, self_product, transposed_product};
pub use rows::{add_scaled, inner_product, weighted_sum};

/// What numbers of columns are padded to where a function says so.
pub const PAD: usize = 16;
/// What numbers of rows are padded to in [`eliminate`].
pub const ROWS: usize = 4;

/// `count` rounded up to a multiple of `of`.
pub const fn padded(count: usize, multiple: usize) -> usize {
    count.div_ceil(multiple) * multiple
}

/// A stride of at least `columns` for which the rows do not fall on the same few lines of a cache: an odd number of
/// lines of eight.
pub const fn stride(columns: usize) -> usize {
    let lines = columns.div_ceil(8);
    8 * (lines + (lines + 1) % 2)
}

#[cfg(test)]
mod tests_numbers {
    /// Deterministic numbers in [-1, 1].
    pub fn numbers(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }
}
