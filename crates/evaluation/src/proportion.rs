//! Shares of successes and what may be said of them.

use serde::Serialize;

/// Half the width of a 95 % interval, standard deviations.
const Z: f64 = 1.96;

/// How often something succeeded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Proportion {
    /// successes
    pub found: usize,
    /// tries
    #[serde(rename = "of")]
    pub tries: usize,
    /// their share
    pub share: f64,
    /// Wilson's 95 % interval of the share (Wilson 1927; docs/papers.md#other-sources)
    pub interval: [f64; 2],
}

impl Proportion {
    /// Of tries, one after the other. Without any, the share is 0 and may be anything.
    pub fn from_tries(outcomes: impl IntoIterator<Item = bool>) -> Self {
        let (mut found, mut tries) = (0, 0);
        for success in outcomes {
            found += usize::from(success);
            tries += 1;
        }
        if tries == 0 {
            return Self { found, tries, share: 0.0, interval: [0.0, 1.0] };
        }
        let (n, share) = (tries as f64, found as f64 / tries as f64);
        let middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
        let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt() / (1.0 + Z * Z / n);
        Self { found, tries, share, interval: [(middle - half).max(0.0), (middle + half).min(1.0)] }
    }
}

/// How much oftener one of two succeeded, on the same cases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairedDifference {
    /// share of the first less that of the second
    pub difference: f64,
    /// its 95 % interval (Agresti and Min 2005; docs/papers.md#other-sources): half a case is added to each of the four kinds
    /// of pairs
    pub interval: [f64; 2],
    /// cases where only the first succeeded, and only the second
    pub only: [usize; 2],
}

impl PairedDifference {
    /// Of pairs of tries.
    pub fn from_pairs(pairs: impl IntoIterator<Item = (bool, bool)>) -> Self {
        let (mut only, mut cases) = ([0, 0], 0usize);
        for (first, second) in pairs {
            only[0] += usize::from(first && !second);
            only[1] += usize::from(second && !first);
            cases += 1;
        }
        let difference = (only[0] as f64 - only[1] as f64) / cases.max(1) as f64;
        let [b, c] = only.map(|count| count as f64 + 0.5);
        let n = cases as f64 + 2.0;
        let middle = (b - c) / n;
        let half = Z * ((b + c) - (b - c) * (b - c) / n).max(0.0).sqrt() / n;
        Self { difference, interval: [(middle - half).max(-1.0), (middle + half).min(1.0)], only }
    }

    /// What may be said if a difference of `margin` doesn't matter.
    pub fn verdict(&self, margin: f64) -> Verdict {
        let [low, high] = self.interval;
        if low > -margin && high < margin {
            Verdict::Equal
        } else if low > 0.0 {
            Verdict::Better
        } else if high < 0.0 {
            Verdict::Worse
        } else {
            Verdict::Undecided
        }
    }
}

/// What an interval of a difference says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// the difference is less than the margin
    Equal,
    /// the first is better
    Better,
    /// the second is better
    Worse,
    /// there may or may not be a difference that matters
    Undecided,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_as_printed() {
        // 81 of 263: Newcombe 1998 (docs/papers.md#other-sources), table I
        let found = Proportion::from_tries((0..263).map(|i| i < 81));
        assert!((found.interval[0] - 0.2553).abs() < 1e-4 && (found.interval[1] - 0.3662).abs() < 1e-4);
        let none = Proportion::from_tries((0..20).map(|_| false));
        assert!(none.interval[0] == 0.0 && (none.interval[1] - 0.1611).abs() < 1e-3, "{none:?}");
        assert_eq!(Proportion::from_tries([]).interval, [0.0, 1.0]);
    }

    #[test]
    fn pairs_that_agree_show_that_two_are_equal_and_few_show_nothing() {
        let same = PairedDifference::from_pairs((0..100).map(|i| (i % 3 == 0, i % 3 == 0)));
        assert_eq!((same.difference, same.verdict(0.1)), (0.0, Verdict::Equal));
        let few = PairedDifference::from_pairs((0..10).map(|i| (i > 1, i > 3)));
        assert_eq!((few.only, few.verdict(0.1)), ([2, 0], Verdict::Undecided));
        let better = PairedDifference::from_pairs((0..100).map(|i| (i > 10, i > 50)));
        assert_eq!(better.verdict(0.1), Verdict::Better);
        let worse = PairedDifference::from_pairs((0..100).map(|i| (i > 50, i > 10)));
        assert_eq!((worse.difference, worse.verdict(0.1)), (-0.4, Verdict::Worse));
    }
}
