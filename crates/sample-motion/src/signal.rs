/// Smooths a signal with a Gaussian of deviation `sigma` samples; the ends are held.
pub(crate) fn smooth(signal: &[f64], sigma: f64) -> Vec<f64> {
    let radius = (3.0 * sigma).ceil() as isize;
    let weights: Vec<f64> = (-radius..=radius).map(|d| (-0.5 * (d as f64 / sigma).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let last = signal.len() as isize - 1;
    (0..=last)
        .map(|i| {
            let at = |d: isize| signal[(i + d).clamp(0, last) as usize];
            (-radius..=radius).zip(&weights).map(|(d, w)| w * at(d)).sum::<f64>() / total
        })
        .collect()
}

/// Derivative of a signal by central differences, per second.
pub(crate) fn derivative(signal: &[f64], rate: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    (0..signal.len())
        .map(|i| {
            let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
            if a == b { 0.0 } else { (signal[b] - signal[a]) * rate / (b - a) as f64 }
        })
        .collect()
}

/// The value below which the given share (0 to 1) of the values lies.
pub(crate) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n => sorted[((n - 1) as f64 * share).round() as usize],
    }
}

/// 0 below 0, 1 above 1, with zero slope at both.
pub(crate) fn smoothstep(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// `x` inside [low, high]; outside, it bends and never goes further than a tenth of the range beyond.
pub(crate) fn bend_into(x: f64, low: f64, high: f64) -> f64 {
    let slack = 0.1 * (high - low) + 1e-6;
    let beyond = |d: f64| slack * d / (slack + d);
    if x > high {
        high + beyond(x - high)
    } else if x < low {
        low - beyond(low - x)
    } else {
        x
    }
}
