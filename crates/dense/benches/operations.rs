//! The operations of a frame at their usual sizes, beside the same by a large library. K = 64 examples of 142 numbers, 62
//! coordinates.

use divan::Bencher;
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};

fn main() {
    divan::main();
}

const K: usize = 64;
const WIDTH: usize = 142;
const DOFS: usize = 62;

fn wave(count: usize) -> Vec<f64> {
    (0..count).map(|i| (i as f64 * 0.71 + (i as f64).sqrt()).sin()).collect()
}

#[divan::bench]
fn gram(bencher: Bencher) {
    let (rows, mut out) = (wave(K * WIDTH), vec![0.0; K * K]);
    bencher.bench_local(|| dense::gram(&rows, K, WIDTH, &mut out, K));
}

#[divan::bench]
fn gram_by_faer(bencher: Bencher) {
    let (rows, mut out) = (wave(K * WIDTH), vec![0.0; K * K]);
    bencher.bench_local(|| {
        let a = MatRef::from_row_major_slice(&rows, K, WIDTH);
        let out = MatMut::from_row_major_slice_mut(&mut out, K, K);
        matmul(out, Accum::Replace, a, a.transpose(), 1.0, Par::Seq);
    });
}

#[divan::bench]
fn self_product(bencher: Bencher) {
    let (rows, mut out) = (wave(K * DOFS), vec![0.0; DOFS * DOFS]);
    bencher.bench_local(|| dense::self_product(&rows, DOFS, &mut out));
}

#[divan::bench]
fn self_product_by_faer(bencher: Bencher) {
    let (rows, mut out) = (wave(K * DOFS), vec![0.0; DOFS * DOFS]);
    bencher.bench_local(|| {
        let e = MatRef::from_row_major_slice(&rows, K, DOFS);
        let out = MatMut::from_row_major_slice_mut(&mut out, DOFS, DOFS);
        matmul(out, Accum::Replace, e.transpose(), e, 1.0, Par::Seq);
    });
}

/// Cholesky factor, forward substitution of 63 columns, and the factor's inverse.
#[divan::bench]
fn eliminate(bencher: Bencher) {
    let stride = dense::stride(3 * K);
    let mut start = vec![0.0; K * stride];
    for (i, row) in start.chunks_exact_mut(stride).enumerate() {
        row[K..2 * K].copy_from_slice(&wave(K));
        (row[i], row[2 * K + i]) = (2.0, 1.0);
    }
    let mut m = start.clone();
    bencher.bench_local(|| {
        m.copy_from_slice(&start);
        dense::eliminate(&mut m, K, stride, Some(2 * K), 1e-12)
    });
}

#[divan::bench]
fn transposed_product(bencher: Bencher) {
    let stride = dense::stride(2 * K);
    let (m, mut out) = (wave(K * stride), vec![0.0; K * DOFS]);
    bencher.bench_local(|| dense::transposed_product(&m, K, stride, [0, K], DOFS, &mut out));
}
