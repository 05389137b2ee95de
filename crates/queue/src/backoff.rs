//! How long to wait before trying again.

use std::time::Duration;

use crate::JobId;

/// Waits between attempts: doubled each time, with jitter, up to a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetryPolicy {
    /// Before the second attempt. Default 1 s: a restart of a service or a lock is often over by then.
    pub base: Duration,
    /// Never longer than this. Default 5 min: someone is waiting for the run.
    pub max: Duration,
}

impl Default for RetryPolicy {
    fn default() -> Self {
        Self { base: Duration::from_secs(1), max: Duration::from_secs(300) }
    }
}

impl RetryPolicy {
    /// The wait after this attempt (from 1) of this job: between half and all of `base · 2^(attempt - 1)`.
    /// The jitter is drawn from the job and the attempt, so that jobs which failed together do not come
    /// back together, and a test can foresee it.
    pub fn delay(&self, job_id: JobId, attempt: i32) -> Duration {
        let doublings = attempt.clamp(1, 32) as u32 - 1;
        let full = self.base.saturating_mul(1u32.checked_shl(doublings).unwrap_or(u32::MAX)).min(self.max);
        let draw = mix(mix(job_id.0 as u64) ^ attempt as u64) >> 11;
        full.mul_f64(0.5 + 0.5 * draw as f64 / (1u64 << 53) as f64)
    }
}

/// The finaliser of SplitMix64.
fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_double_with_jitter_up_to_the_limit() {
        let policy = RetryPolicy { base: Duration::from_secs(1), max: Duration::from_secs(10) };
        for job in 0..100 {
            for (attempt, full) in [(1, 1.0), (2, 2.0), (3, 4.0), (4, 8.0), (5, 10.0), (1000, 10.0)] {
                let delay = policy.delay(JobId(job), attempt).as_secs_f64();
                assert!((full * 0.5..=full).contains(&delay), "attempt {attempt}: {delay} s");
            }
        }
    }

    #[test]
    fn jobs_that_failed_together_come_back_apart() {
        let policy = RetryPolicy::default();
        let mut delays: Vec<_> = (0..100).map(|job| policy.delay(JobId(job), 1)).collect();
        delays.sort();
        delays.dedup();
        assert_eq!(delays.len(), 100);
    }
}
