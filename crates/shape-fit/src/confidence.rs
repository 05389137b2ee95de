//! How far a fit is to be trusted.

/// Mean intersection over union at which nothing is trusted, and at which nothing is left to be wished for.
const IOU: [f64; 2] = [0.70, 0.95];

/// A figure in [0, 1]: the product of how well the silhouettes are covered, of how many views there are (2: 0.5, 4: 0.88,
/// 8: 1), and of how much better the result is than the same body the other way round (`runner_up`: that one's energy
/// divided by the result's).
pub fn confidence(ious: &[f64], runner_up: f64) -> f64 {
    let views = ious.len();
    let mean = ious.iter().sum::<f64>() / views.max(1) as f64;
    let covered = ((mean - IOU[0]) / (IOU[1] - IOU[0])).clamp(0.0, 1.0);
    let seen = 1.0 - 0.5f64.powi(views.saturating_sub(1).min(30) as i32);
    // a runner-up half as good again leaves no doubt, one as good leaves a coin to toss
    let distinct = 0.5 + (runner_up - 1.0).clamp(0.0, 0.5);
    covered * seen * distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_views_that_fit_better_are_trusted_more() {
        let good = confidence(&[0.96; 8], 3.0);
        assert!(good > 0.95 && good <= 1.0);
        assert!(confidence(&[0.96; 3], 3.0) < good);
        assert!(confidence(&[0.85; 8], 3.0) < 0.7);
        assert!(confidence(&[0.96; 8], 1.0) < 0.6);
        assert_eq!(confidence(&[0.5; 8], 3.0), 0.0);
    }
}
