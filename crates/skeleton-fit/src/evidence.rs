use nalgebra::{Matrix3, Vector3};

use crate::FitSettings;
use crate::shapes::{Shapes, position};

/// Recordings less likely than the likeliest by this factor (logarithm) are passed over in derivatives.
const NEGLIGIBLE: f64 = 18.0;

/// Observed points of a span: `None` where not measured; in the order of [`crate::shapes::SPAN`] and then of the points.
pub type Observed = Vec<Option<Vector3<f64>>>;

/// The logarithm of the probability of what was observed, as a function of the scales of the limbs, up to a constant:
///
/// ```text
/// L(θ) = ¼ Σ_w log Σ_n exp(−P d²_wn(θ) / 2h²) − ½ θᵀ C⁻¹ θ,     scale = exp(θ)
/// ```
///
/// a kernel density over the database's spans n. d²_wn is the mean squared distance of the P points after the best turn
/// about y and shift on the floor. Every span of the database stands for a pose that the performer may have had: the
/// sum over n takes the pose out of the question, so that no pose found with the wrong lengths can confirm them.
pub struct Evidence<'a> {
    settings: &'a FitSettings,
    shapes: &'a Shapes,
    observed: &'a [Observed],
    points: usize,
    precision: Matrix3<f64>,
    // positions of a span's points
    found: Vec<Vector3<f64>>,
    exponents: Vec<f64>,
}

/// A value with its derivative with respect to θ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// the logarithm of the probability
    pub log: f64,
    /// ∂log/∂θ
    pub gradient: Vector3<f64>,
}

impl<'a> Evidence<'a> {
    /// `observed`: spans of `points` points each; `precision`: C⁻¹.
    pub fn new(
        shapes: &'a Shapes,
        observed: &'a [Observed],
        points: usize,
        precision: Matrix3<f64>,
        settings: &'a FitSettings,
    ) -> Self {
        let exponents = vec![0.0; shapes.num_spans()];
        Self { settings, shapes, observed, points, precision, found: Vec::new(), exponents }
    }

    /// At θ, the logarithms of the limbs' scales.
    pub fn at(&mut self, theta: &Vector3<f64>) -> Value {
        let scales = [theta.x.exp(), theta.y.exp(), theta.z.exp()];
        let weighted = self.precision * theta;
        let mut value = Value { log: -0.5 * theta.dot(&weighted), gradient: -weighted };
        let count = self.observed.len().max(1) as f64;
        let share = (self.settings.independent_spans / count).min(1.0);
        for observed in self.observed {
            let span = self.span(observed, &scales);
            value.log += span.log * share;
            value.gradient += span.gradient * share;
        }
        value
    }

    fn span(&mut self, observed: &Observed, scales: &[f64; 3]) -> Value {
        let precision = self.points as f64 / self.settings.kernel_sigma_m.powi(2);
        // What no recording explains says nothing.
        let unexplained = -0.5 * self.points as f64 * self.settings.unexplained_sigmas.powi(2);
        let mut best = unexplained;
        for n in 0..self.shapes.num_spans() {
            self.place(n, scales);
            let fit = Fit::new(&self.found, observed);
            self.exponents[n] = -0.5 * precision * fit.mean_square;
            best = best.max(self.exponents[n]);
        }
        let mut total = (unexplained - best).exp();
        let mut gradient = Vector3::zeros();
        for n in 0..self.shapes.num_spans() {
            let exponent = self.exponents[n] - best;
            if exponent < -NEGLIGIBLE {
                continue;
            }
            let weight = exponent.exp();
            total += weight;
            self.place(n, scales);
            let fit = Fit::new(&self.found, observed);
            gradient += self.gradient(n, &fit, observed, scales) * (-0.5 * precision * weight);
        }
        Value { log: best + total.ln(), gradient: gradient / total }
    }

    fn place(&mut self, n: usize, scales: &[f64; 3]) {
        let constant = self.shapes.constant();
        self.found.clear();
        self.found.extend(self.shapes.parts(n).iter().map(|parts| position(&constant, parts, scales)));
    }

    /// Derivative of the mean squared distance. The best turn and shift stay the best to first order.
    fn gradient(&self, n: usize, fit: &Fit, observed: &Observed, scales: &[f64; 3]) -> Vector3<f64> {
        let mut gradient = Vector3::zeros();
        for ((parts, found), observed) in self.shapes.parts(n).iter().zip(&self.found).zip(observed) {
            let Some(observed) = observed else { continue };
            let back = fit.turned_back(&(fit.placed(found) - observed));
            for ((sum, part), scale) in gradient.iter_mut().zip(parts).zip(scales) {
                *sum += 2.0 * scale * back.dot(&Vector3::from(part.map(f64::from)));
            }
        }
        gradient / fit.count
    }
}

/// The best turn about y and shift on the floor that bring points to observed ones; heights are compared as they are.
struct Fit {
    sin: f64,
    cos: f64,
    shift: [f64; 2],
    count: f64,
    mean_square: f64,
}

impl Fit {
    fn new(found: &[Vector3<f64>], observed: &Observed) -> Self {
        let mut count = 0.0;
        let (mut mean_a, mut mean_b) = ([0.0; 2], [0.0; 2]);
        let (mut squares, mut dot, mut cross) = (0.0, 0.0, 0.0);
        for (a, b) in found.iter().zip(observed) {
            let Some(b) = b else { continue };
            count += 1.0;
            mean_a[0] += a.x;
            mean_a[1] += a.z;
            mean_b[0] += b.x;
            mean_b[1] += b.z;
            squares += a.x * a.x + a.z * a.z + b.x * b.x + b.z * b.z + (a.y - b.y).powi(2);
            dot += a.x * b.x + a.z * b.z;
            cross += a.z * b.x - a.x * b.z;
        }
        for v in mean_a.iter_mut().chain(&mut mean_b) {
            *v /= count;
        }
        squares -= count * (mean_a[0].powi(2) + mean_a[1].powi(2) + mean_b[0].powi(2) + mean_b[1].powi(2));
        dot -= count * (mean_a[0] * mean_b[0] + mean_a[1] * mean_b[1]);
        cross -= count * (mean_a[1] * mean_b[0] - mean_a[0] * mean_b[1]);
        // observed = R_y(turn) found + shift with R_y: x' = c x + s z, z' = −s x + c z.
        let length = dot.hypot(cross);
        let (sin, cos) = if length > 0.0 { (cross / length, dot / length) } else { (0.0, 1.0) };
        let shift =
            [mean_b[0] - cos * mean_a[0] - sin * mean_a[1], mean_b[1] + sin * mean_a[0] - cos * mean_a[1]];
        Self { sin, cos, shift, count, mean_square: (squares - 2.0 * length).max(0.0) / count }
    }

    fn placed(&self, p: &Vector3<f64>) -> Vector3<f64> {
        let (sin, cos) = (self.sin, self.cos);
        Vector3::new(cos * p.x + sin * p.z + self.shift[0], p.y, cos * p.z - sin * p.x + self.shift[1])
    }

    fn turned_back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.cos * v.x - self.sin * v.z, v.y, self.sin * v.x + self.cos * v.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Population;
    use kinematics::control_points;
    use motion_db::{Clip, MotionDatabase};
    use sample_motion::{Action, DrawOptions, Model};

    #[test]
    fn the_gradient_agrees_with_differences() {
        let motion = Model::bundled().draw(Action::Walk, 1, &DrawOptions { frames: 90, subject: 1 }).unwrap();
        let clip = Clip { name: "a".into(), subject: "1".into(), action: "walk".into(), motion };
        let database = MotionDatabase::build(&[clip]).unwrap();
        let Population { mean, limbs, covariance, .. } = Population::from_database(&database).unwrap();
        let points = control_points(&mean, &["left_wrist", "right_ankle", "head"]).unwrap();
        let shapes = Shapes::new(&database, &mean, &limbs, &points);
        let seen = |n: usize| {
            let bigger =
                shapes.parts(n).iter().map(|p| Some(position(&shapes.constant(), p, &[1.05, 0.97, 1.1])));
            let mut seen: Observed = bigger.collect();
            seen[2] = None;
            seen
        };
        let observed = vec![seen(3), seen(40)];
        let precision = covariance.try_inverse().unwrap();
        let settings = FitSettings::default();
        let mut evidence = Evidence::new(&shapes, &observed, 3, precision, &settings);
        let theta = Vector3::new(0.02, -0.01, 0.03);
        let gradient = evidence.at(&theta).gradient;
        for i in 0..3 {
            let mut step = Vector3::zeros();
            step[i] = 1e-5;
            let difference = evidence.at(&(theta + step)).log - evidence.at(&(theta - step)).log;
            let expected = difference / 2e-5;
            assert!(
                (gradient[i] - expected).abs() < 1e-3 * expected.abs().max(1.0),
                "{i}: {gradient} {expected}"
            );
        }
    }
}
