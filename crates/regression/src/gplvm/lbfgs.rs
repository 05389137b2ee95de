use std::collections::VecDeque;

/// Steps that the curvature is remembered of.
const MEMORY: usize = 20;
/// Least decrease of a step, relative to what the gradient promises (Armijo).
const SUFFICIENT: f64 = 1e-4;

/// Whether to take another step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// yes
    GoOn,
    /// no
    Stop,
}

/// A step `s`, the change of the gradient `y` along it, and `sᵀy`.
struct Curvature {
    s: Vec<f64>,
    y: Vec<f64>,
    sy: f64,
}

/// Minimiser of smooth functions: L-BFGS (Nocedal & Wright 2006, algorithm 7.5; docs/papers.md#latent-variable-model) with a
/// backtracking line search.
pub struct Lbfgs {
    past: VecDeque<Curvature>,
    gradient: Vec<f64>,
    direction: Vec<f64>,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
}

impl Lbfgs {
    /// Memory for `unknowns` unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self {
            past: VecDeque::with_capacity(MEMORY),
            gradient: vec![0.0; unknowns],
            direction: vec![0.0; unknowns],
            trial: vec![0.0; unknowns],
            trial_gradient: vec![0.0; unknowns],
        }
    }

    /// Minimises from `x`, which receives the best point found. `function` fills the gradient and returns the value
    /// (anything not finite is too far); `after` is called after every step with their number.
    pub fn minimise(
        &mut self,
        x: &mut [f64],
        max_steps: usize,
        function: &mut dyn FnMut(&[f64], &mut [f64]) -> f64,
        after: &mut dyn FnMut(usize) -> Verdict,
    ) -> f64 {
        let mut value = function(x, &mut self.gradient);
        for step in 1..=max_steps {
            self.set_direction();
            let mut slope = dot(&self.direction, &self.gradient);
            // Also where it is not a number.
            let is_descent = slope < 0.0;
            if !is_descent {
                self.past.clear();
                self.set_direction();
                slope = dot(&self.direction, &self.gradient);
            }
            let first = if self.past.is_empty() { (1.0 / (-slope).sqrt()).min(1.0) } else { 1.0 };
            let Some((length, trial_value)) = self.line_search(x, value, slope, first, function) else {
                if self.past.is_empty() {
                    break;
                }
                // The curvature misleads: down the gradient once.
                self.past.clear();
                continue;
            };
            self.remember(length);
            x.copy_from_slice(&self.trial);
            std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
            let decrease = value - trial_value;
            value = trial_value;
            if after(step) == Verdict::Stop || decrease <= 1e-9 * value.abs() {
                break;
            }
        }
        value
    }

    /// `direction ← −H gradient` by the two loops over what is remembered.
    fn set_direction(&mut self) {
        self.direction.iter_mut().zip(&self.gradient).for_each(|(d, g)| *d = -g);
        let mut factors = [0.0; MEMORY];
        for (past, factor) in self.past.iter().zip(&mut factors).rev() {
            *factor = dot(&past.s, &self.direction) / past.sy;
            add_scaled(&mut self.direction, -*factor, &past.y);
        }
        if let Some(last) = self.past.back() {
            let scale = last.sy / dot(&last.y, &last.y);
            self.direction.iter_mut().for_each(|d| *d *= scale);
        }
        for (past, factor) in self.past.iter().zip(&factors) {
            let other = dot(&past.y, &self.direction) / past.sy;
            add_scaled(&mut self.direction, factor - other, &past.s);
        }
    }

    /// A length that lowers the function enough, and the value there; the point is left in `trial`.
    fn line_search(
        &mut self,
        x: &[f64],
        value: f64,
        slope: f64,
        first: f64,
        function: &mut dyn FnMut(&[f64], &mut [f64]) -> f64,
    ) -> Option<(f64, f64)> {
        let mut length = first;
        for _ in 0..30 {
            for ((t, x), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
                *t = x + length * d;
            }
            let trial = function(&self.trial, &mut self.trial_gradient);
            if trial.is_finite() && trial <= value + SUFFICIENT * length * slope {
                return Some((length, trial));
            }
            // To the bottom of the parabola through what is known, within bounds.
            let curvature = trial - value - length * slope;
            let bottom = -0.5 * slope * length * length / curvature;
            length = if bottom.is_finite() { bottom.clamp(0.1 * length, 0.5 * length) } else { 0.1 * length };
        }
        None
    }

    fn remember(&mut self, length: f64) {
        let s: Vec<f64> = self.direction.iter().map(|d| length * d).collect();
        let y: Vec<f64> = self.trial_gradient.iter().zip(&self.gradient).map(|(a, b)| a - b).collect();
        let sy = dot(&s, &y);
        // Only steps along which the function curves upwards keep H positive definite.
        if sy > 1e-10 * dot(&y, &y) {
            if self.past.len() == MEMORY {
                self.past.pop_front();
            }
            self.past.push_back(Curvature { s, y, sy });
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add_scaled(sum: &mut [f64], factor: f64, row: &[f64]) {
    sum.iter_mut().zip(row).for_each(|(s, v)| *s += factor * v);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The curved valley of Rosenbrock, in ten dimensions.
    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let mut function = |x: &[f64], gradient: &mut [f64]| {
            gradient.fill(0.0);
            let mut value = 0.0;
            for i in 0..x.len() - 1 {
                let (a, b) = (x[i + 1] - x[i] * x[i], 1.0 - x[i]);
                value += 100.0 * a * a + b * b;
                gradient[i] += -400.0 * a * x[i] - 2.0 * b;
                gradient[i + 1] += 200.0 * a;
            }
            value
        };
        let mut x = vec![-0.5; 10];
        let mut lbfgs = Lbfgs::new(10);
        let value = lbfgs.minimise(&mut x, 500, &mut function, &mut |_| Verdict::GoOn);
        assert!(value < 1e-10, "{value}");
        assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-4), "{x:?}");
    }

    #[test]
    fn where_the_function_is_not_a_number_the_step_is_shortened() {
        let mut function = |x: &[f64], gradient: &mut [f64]| {
            gradient[0] = 1.0 - 1.0 / x[0];
            x[0] - x[0].ln()
        };
        let mut x = [9.0];
        Lbfgs::new(1).minimise(&mut x, 100, &mut function, &mut |_| Verdict::GoOn);
        assert!((x[0] - 1.0).abs() < 1e-5, "{x:?}");
    }
}
