use nalgebra::DMatrix;

/// Principal components of weighted observations about 0, each at one standard deviation, largest first.
///
/// `observations`: shape `[n][numbers]`, already centred; `votes`: weight of each observation (any sum);
/// `importance`: weight of each number. At most `most` components, and none of negligible variance.
pub(crate) fn principal(
    observations: &[Vec<f64>],
    votes: &[f64],
    importance: &[f64],
    most: usize,
) -> Vec<Vec<f64>> {
    let n = observations.len();
    let total: f64 = votes.iter().sum();
    if n == 0 || total <= 0.0 {
        return Vec::new();
    }
    let scaled: Vec<Vec<f64>> = std::iter::zip(observations, votes)
        .map(|(x, vote)| {
            let root = (vote / total).sqrt();
            std::iter::zip(x, importance).map(|(x, w)| x * w * root).collect()
        })
        .collect();
    // Fewer observations than numbers: the Gram matrix has the same spectrum as the covariance.
    let gram = DMatrix::from_fn(n, n, |i, j| dot(&scaled[i], &scaled[j]));
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let largest = order.first().map_or(0.0, |&i| eigen.eigenvalues[i]);
    order
        .into_iter()
        .take(most)
        .filter(|&k| eigen.eigenvalues[k] > 1e-4 * largest)
        .map(|k| {
            let mut component = vec![0.0; importance.len()];
            for (i, row) in scaled.iter().enumerate() {
                let share = eigen.eigenvectors[(i, k)];
                component.iter_mut().zip(row).for_each(|(c, x)| *c += share * x);
            }
            // A component may as well be its negative: rounding must not decide which.
            let sign = component.iter().map(|c| c * c * c).sum::<f64>().signum();
            component.iter_mut().zip(importance).for_each(|(c, w)| *c *= sign / w);
            component
        })
        .collect()
}

/// How many deviations of a component an observation is away from 0.
pub(crate) fn score(observation: &[f64], component: &[f64], importance: &[f64]) -> f64 {
    let weighted = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(importance).map(|((a, b), w)| a * b * w * w).sum()
    };
    weighted(observation, component) / weighted(component, component).max(1e-300)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_components_of_an_ellipse_are_its_half_axes() {
        let points = [[3.0, 0.0], [-3.0, 0.0], [0.0, 1.0], [0.0, -1.0]].map(|p| p.to_vec());
        let found = principal(&points, &[1.0; 4], &[1.0, 2.0], 2);
        assert_eq!(found.len(), 2);
        assert!((found[0][0].abs() - 4.5f64.sqrt()).abs() < 1e-12 && found[0][1].abs() < 1e-12, "{found:?}");
        assert!((found[1][1].abs() - 0.5f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert!((score(&points[0], &found[0], &[1.0, 2.0]).abs() - 2f64.sqrt()).abs() < 1e-12);
    }
}
