use dense::{add_scaled, inner_product};

/// Singular values of a task, relative to the greatest, below which a direction still counts as free for the tasks after it.
const RANK: f64 = 1e-6;

/// Tasks of strict priorities, solved one level after the other (Baerlocher and Boulic 2004;
/// docs/papers.md#image-constrained-inverse-kinematics):
///
/// ```text
/// J̃ᵢ = Jᵢ Pᵢ₋₁     Δθᵢ = Δθᵢ₋₁ + J̃ᵢ⁺ (Δxᵢ − Jᵢ Δθᵢ₋₁)     Pᵢ = Pᵢ₋₁ − J̃ᵢ⁺ J̃ᵢ     P₀ = I
/// ```
///
/// J̃⁺ in the middle is damped near singularities (Nakamura and Hanafusa 1986; Wampler 1986): `J̃ᵀ (J̃J̃ᵀ + λ²I)⁻¹` with
/// λ² = damping² (1 − σ²/σ₀²) where σ < σ₀. The smallest pivot of J̃J̃ᵀ stands for σ².
#[derive(Debug, Clone)]
pub struct Priorities {
    dofs: usize,
    /// projector onto what is still free, symmetric, shape `[dofs, dofs]`
    projector: Vec<f64>,
    /// J̃, shape `[rows, dofs]`
    projected: Vec<f64>,
    /// J̃J̃ᵀ and its factors, shape `[rows, rows]`
    gram: Vec<f64>,
    factor: Vec<f64>,
    rest: Vec<f64>,
    column: Vec<f64>,
    /// (J̃J̃ᵀ)⁻¹ J̃, shape `[rows, dofs]`
    inverse: Vec<f64>,
    damping: f64,
    damped_below: f64,
}

impl Priorities {
    /// Memory for up to `dofs` coordinates and levels of up to `rows` rows; see the type for the damping.
    pub fn new(dofs: usize, rows: usize, damping: f64, damped_below: f64) -> Self {
        Self {
            dofs,
            projector: vec![0.0; dofs * dofs],
            projected: vec![0.0; rows * dofs],
            gram: vec![0.0; rows * rows],
            factor: vec![0.0; rows * rows],
            rest: vec![0.0; rows],
            column: vec![0.0; rows],
            inverse: vec![0.0; rows * dofs],
            damping,
            damped_below,
        }
    }

    /// Begins with everything free; from now on there are `dofs` coordinates.
    ///
    /// # Panics
    /// If they are more than there is memory for.
    pub fn start(&mut self, dofs: usize) {
        self.dofs = dofs;
        let projector = &mut self.projector[..dofs * dofs];
        projector.fill(0.0);
        projector.iter_mut().step_by(dofs + 1).for_each(|v| *v = 1.0);
    }

    /// Adds the next level to `change` (shape `[dofs]`): `jacobian` has shape `[rows, dofs]`, `wanted` (shape `[rows]`) is
    /// Δx. What the levels before it need is left as it is.
    pub fn add_level(&mut self, jacobian: &[f64], wanted: &[f64], change: &mut [f64]) {
        let (dofs, rows) = (self.dofs, wanted.len());
        if rows == 0 || dofs == 0 {
            return;
        }
        for (row, out) in jacobian.chunks_exact(dofs).zip(self.projected.chunks_exact_mut(dofs)).take(rows) {
            out.fill(0.0);
            for (&weight, projector) in row.iter().zip(self.projector.chunks_exact(dofs)) {
                if weight != 0.0 {
                    add_scaled(out, weight, projector);
                }
            }
        }
        let projected = &self.projected[..rows * dofs];
        let mut greatest = 0.0f64;
        for i in 0..rows {
            for j in 0..=i {
                let value =
                    inner_product(&projected[i * dofs..(i + 1) * dofs], &projected[j * dofs..(j + 1) * dofs]);
                self.gram[i * rows + j] = value;
            }
            greatest = greatest.max(self.gram[i * rows + i]);
        }
        if greatest < 1e-16 {
            return;
        }
        let floor = greatest * RANK * RANK;
        let pivot = factorise(&self.gram, rows, floor, &mut self.factor);
        // what a level of rank lower than its rows takes from the projector: directions far above the floor
        for column in 0..dofs {
            for row in 0..rows {
                self.column[row] = projected[row * dofs + column];
            }
            solve(&self.factor, rows, &mut self.column[..rows]);
            for row in 0..rows {
                self.inverse[row * dofs + column] = self.column[row];
            }
        }
        let limit = self.damped_below * self.damped_below;
        if pivot < limit {
            let damping = self.damping * self.damping * (1.0 - (pivot / limit).max(0.0));
            factorise(&self.gram, rows, damping.max(floor), &mut self.factor);
        }
        for (row, rest) in self.rest[..rows].iter_mut().enumerate() {
            *rest = wanted[row] - inner_product(&jacobian[row * dofs..(row + 1) * dofs], &change[..dofs]);
        }
        solve(&self.factor, rows, &mut self.rest[..rows]);
        for (row, &weight) in self.rest[..rows].iter().enumerate() {
            add_scaled(&mut change[..dofs], weight, &projected[row * dofs..(row + 1) * dofs]);
        }
        for row in 0..rows {
            for i in 0..dofs {
                let weight = -projected[row * dofs + i];
                let inverse = &self.inverse[row * dofs..(row + 1) * dofs];
                add_scaled(&mut self.projector[i * dofs..(i + 1) * dofs], weight, inverse);
            }
        }
    }

    /// The part of `direction` (shape `[dofs]`) that no level so far notices, into `out`.
    pub fn project(&self, direction: &[f64], out: &mut [f64]) {
        for (out, row) in out.iter_mut().zip(self.projector.chunks_exact(self.dofs.max(1))).take(self.dofs) {
            *out = inner_product(row, &direction[..self.dofs]);
        }
    }
}

/// Cholesky factor of the lower triangle of `matrix` + `shift` on its diagonal, shape `[n, n]`. Returns the smallest pivot,
/// less the shift.
fn factorise(matrix: &[f64], n: usize, shift: f64, factor: &mut [f64]) -> f64 {
    let mut smallest = f64::INFINITY;
    for i in 0..n {
        for j in 0..=i {
            let sum = inner_product(&factor[i * n..i * n + j], &factor[j * n..j * n + j]);
            let value = matrix[i * n + j] - sum;
            factor[i * n + j] = if i == j {
                // rounding may take a pivot below the shift, never the true one
                let pivot = (value + shift).max(shift);
                smallest = smallest.min(pivot - shift);
                pivot.sqrt()
            } else {
                value / factor[j * n + j]
            };
        }
    }
    smallest
}

/// Solves with the factor of [`factorise`], in place.
fn solve(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let sum = inner_product(&factor[i * n..i * n + i], &b[..i]);
        b[i] = (b[i] - sum) / factor[i * n + i];
    }
    for i in (0..n).rev() {
        b[i] /= factor[i * n + i];
        let value = b[i];
        for j in 0..i {
            b[j] -= factor[i * n + j] * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic numbers in [-1, 1].
    fn numbers(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        (0..count).map(|_| next()).collect()
    }

    fn applied(jacobian: &[f64], change: &[f64]) -> Vec<f64> {
        jacobian.chunks_exact(change.len()).map(|row| inner_product(row, change)).collect()
    }

    #[test]
    fn every_level_is_met_where_there_is_freedom_enough() {
        let mut priorities = Priorities::new(9, 3, 0.05, 0.05);
        let levels: Vec<_> = (0..3).map(|i| (numbers(27, i + 1), numbers(3, 10 + i))).collect();
        let mut change = vec![0.0; 9];
        priorities.start(9);
        for (jacobian, wanted) in &levels {
            priorities.add_level(jacobian, wanted, &mut change);
        }
        for (level, (jacobian, wanted)) in levels.iter().enumerate() {
            for (found, wanted) in applied(jacobian, &change).iter().zip(wanted) {
                assert!((found - wanted).abs() < 1e-4, "level {level}: {found}, {wanted}");
            }
        }
    }

    #[test]
    fn a_later_level_never_disturbs_an_earlier_one() {
        let (first, second) = (numbers(12, 3), numbers(12, 4));
        let (wanted, other) = (numbers(3, 5), numbers(3, 6));
        let mut priorities = Priorities::new(4, 3, 0.05, 0.05);
        let mut change = vec![0.0; 4];
        priorities.start(4);
        priorities.add_level(&first, &wanted, &mut change);
        let before = applied(&first, &change);
        // three more rows on the one direction that is left: they conflict
        priorities.add_level(&second, &other, &mut change);
        for (after, before) in applied(&first, &change).iter().zip(&before) {
            assert!((after - before).abs() < 1e-5, "{after} {before}");
        }
        let mut free = vec![0.0; 4];
        priorities.project(&numbers(4, 8), &mut free);
        assert!(free.iter().all(|v| v.abs() < 1e-3), "{free:?}");
    }

    #[test]
    fn steps_stay_bounded_at_singularities() {
        // two rows that are nearly the same and want opposite things
        let jacobian = [1.0, 0.5, 0.0, 1.0, 0.5, 1e-7];
        let mut priorities = Priorities::new(3, 2, 0.05, 0.05);
        let mut change = vec![0.0; 3];
        priorities.start(3);
        priorities.add_level(&jacobian, &[1.0, -1.0], &mut change);
        assert!(change.iter().all(|v| v.abs() < 1.0), "{change:?}");
    }

    #[test]
    fn what_is_projected_is_free() {
        let jacobian = numbers(18, 9);
        let mut priorities = Priorities::new(6, 3, 0.05, 0.05);
        let mut change = vec![0.0; 6];
        priorities.start(6);
        priorities.add_level(&jacobian, &[0.0; 3], &mut change);
        let mut free = vec![0.0; 6];
        priorities.project(&numbers(6, 11), &mut free);
        assert!(applied(&jacobian, &free).iter().all(|v| v.abs() < 1e-6));
        assert!(free.iter().any(|v| v.abs() > 0.1));
    }
}
