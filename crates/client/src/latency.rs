use std::fmt;

use model::counted;

/// How long poses took, from sending the frame to having the pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Latency {
    /// frames sent
    pub frames: u64,
    /// frames without a pose, as the server counted them
    pub dropped: u64,
    /// sorted, seconds
    sorted: Vec<f64>,
}

impl Latency {
    /// Of poses that took so many seconds.
    pub fn from_seconds(mut seconds: Vec<f64>, frames: u64, dropped: u64) -> Self {
        seconds.sort_by(f64::total_cmp);
        Self { frames, dropped, sorted: seconds }
    }

    /// The time, in milliseconds, within which this share of the poses came.
    pub fn quantile_ms(&self, share: f64) -> f64 {
        let last = self.sorted.len().saturating_sub(1);
        let at = ((self.sorted.len() as f64 * share).ceil() as usize).saturating_sub(1).min(last);
        self.sorted.get(at).map_or(f64::NAN, |seconds| seconds * 1000.0)
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.sorted.len();
        let (frames, poses) = (counted(self.frames, "frame"), counted(count, "pose"));
        write!(f, "{frames}, {poses}, {} dropped", self.dropped)?;
        if count == 0 {
            return Ok(());
        }
        write!(
            f,
            "; latency p50 {:.2} ms, p95 {:.2} ms, p99 {:.2} ms, max {:.2} ms",
            self.quantile_ms(0.5),
            self.quantile_ms(0.95),
            self.quantile_ms(0.99),
            self.quantile_ms(1.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_nearest_rank() {
        let latency = Latency::from_seconds((1..=200).rev().map(|i| f64::from(i) / 1000.0).collect(), 200, 0);
        for (share, expected) in [(0.5, 100.0), (0.95, 190.0), (0.99, 198.0), (1.0, 200.0)] {
            assert!((latency.quantile_ms(share) - expected).abs() < 1e-9);
        }
        assert!(Latency::from_seconds(vec![], 0, 0).quantile_ms(0.5).is_nan());
    }

    #[test]
    fn latencies_are_shown_where_there_are_some() {
        let shown = |seconds: &[f64], frames| Latency::from_seconds(seconds.to_vec(), frames, 2).to_string();
        assert_eq!(shown(&[], 2), "2 frames, 0 poses, 2 dropped");
        let one = shown(&[0.001], 3);
        assert!(one.starts_with("3 frames, 1 pose, 2 dropped; latency p50 1.00 ms, p95 1.00 ms"), "{one}");
    }
}
