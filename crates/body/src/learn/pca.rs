use nalgebra::{DMatrix, SymmetricEigen, Vector3};

use crate::extremes::lowest_and_highest;

/// Mean and principal components of shapes of one topology.
pub struct Principal {
    /// shape `[vertices]`
    pub mean: Vec<Vector3<f64>>,
    /// displacements of one standard deviation, shape `[components, vertices]`
    pub components: Vec<Vec<Vector3<f64>>>,
    /// shape `[shapes, components]`, in standard deviations
    pub scores: Vec<Vec<f64>>,
    /// share of the variance that the first 1, 2, … components keep
    pub variance_kept: Vec<f64>,
    /// sum of the variances of all coordinates, of the sample covariance
    pub variance_m2: f64,
}

/// Principal components by way of the n × n matrix of inner products: shapes are few, coordinates are many.
///
/// With X the centred shapes as rows and `X Xᵀ = U Λ Uᵀ`, component i is `Xᵀ u_i / √(n−1)` and the scores of the shapes are
/// `√(n−1) u_i`. Its sign is the one with which the body grows taller.
pub fn principal_components(shapes: &[&[Vector3<f64>]], most: usize) -> Principal {
    let n = shapes.len();
    let vertices = shapes[0].len();
    let width = 3 * vertices;
    let mut mean = vec![Vector3::zeros(); vertices];
    for shape in shapes {
        for (sum, vertex) in mean.iter_mut().zip(*shape) {
            *sum += vertex;
        }
    }
    for vertex in &mut mean {
        *vertex /= n as f64;
    }
    let rows: Vec<f64> = shapes
        .iter()
        .flat_map(|shape| shape.iter().zip(&mean).flat_map(|(vertex, mean)| <[f64; 3]>::from(vertex - mean)))
        .collect();
    let mut gram = vec![0.0; n * n];
    dense::gram(&rows, n, width, &mut gram, n);
    let inner = DMatrix::from_fn(n, n, |i, j| gram[i.min(j) * n + i.max(j)]);
    let trace = inner.trace();
    let eigen = SymmetricEigen::new(inner);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // Shapes that are all the same have no components.
    let is_there = |&i: &usize| eigen.eigenvalues[i] > 1e-12 * trace;
    let order: Vec<usize> = order.into_iter().take(most.min(n - 1)).filter(is_there).collect();
    let [lowest, highest] = lowest_and_highest(&mean);
    let root = ((n - 1) as f64).sqrt();
    let (mut components, mut signed) = (Vec::new(), Vec::new());
    for &i in &order {
        let u = eigen.eigenvectors.column(i);
        let mut numbers = vec![0.0; width];
        let weights: Vec<f64> = u.iter().map(|x| x / root).collect();
        dense::weighted_sum(&rows, width, &weights, &mut numbers);
        let mut component: Vec<_> = numbers.as_chunks::<3>().0.iter().map(|&d| Vector3::from(d)).collect();
        let sign = if component[highest].y < component[lowest].y { -1.0 } else { 1.0 };
        component.iter_mut().for_each(|d| *d *= sign);
        components.push(component);
        signed.push((i, sign));
    }
    let score =
        |shape: usize| signed.iter().map(|&(i, sign)| sign * root * eigen.eigenvectors[(shape, i)]).collect();
    let mut kept = 0.0;
    let share = |&i: &usize| {
        kept += eigen.eigenvalues[i] / trace;
        kept
    };
    Principal {
        scores: (0..n).map(score).collect(),
        variance_kept: order.iter().map(share).collect(),
        variance_m2: trace / (n - 1) as f64,
        mean,
        components,
    }
}
