//! What a trial is reconstructed from: its control points, and how much of the database.

use motion_db::{Clip, ClipInfo, trial_name};
use serde::{Deserialize, Serialize};

/// The papers' sets of control points, by their number.
pub struct ControlSet;

impl ControlSet {
    /// Names of the set of `count` points, 2 to 6 (docs/papers.md#notation); `None` for other numbers.
    pub fn names(count: usize) -> Option<&'static [&'static str]> {
        const ALL: [&str; 6] = ["left_wrist", "right_wrist", "left_ankle", "right_ankle", "root", "head"];
        match count {
            2 => Some(&["left_wrist", "right_ankle"]),
            3 => Some(&["left_wrist", "left_ankle", "right_ankle"]),
            4..=6 => Some(&ALL[..count]),
            _ => None,
        }
    }
}

/// What of the database a trial may be reconstructed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// everything but the trial itself: the papers' protocol
    TrialOut,
    /// nothing of the trial's subject: what a new user gets
    SubjectOut,
    /// everything, the trial itself too: an upper bound, never a headline
    TrialIn,
}

impl Protocol {
    /// Whether `other` may not be used for the trial `name` of `subject`: motion made of a recording is left out with it.
    pub fn leaves_out(self, name: &str, subject: &str, other: &ClipInfo) -> bool {
        match self {
            Self::TrialOut => trial_name(&other.name) == trial_name(name),
            Self::SubjectOut => other.subject == subject,
            Self::TrialIn => false,
        }
    }

    /// Whether the same is left out for both trials.
    pub fn leaves_out_the_same(self, a: &Clip, b: &Clip) -> bool {
        match self {
            Self::TrialOut => trial_name(&a.name) == trial_name(&b.name),
            Self::SubjectOut => a.subject == b.subject,
            Self::TrialIn => true,
        }
    }

    /// What it means, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::TrialOut => {
                "each trial is reconstructed from all others, those of the same performer among them (the papers' protocol)"
            }
            Self::SubjectOut => {
                "each trial is reconstructed from recordings of other performers only (what a new performer gets)"
            }
            Self::TrialIn => "each trial is itself in the database: an upper bound, not a result",
        }
    }
}

impl std::fmt::Display for Protocol {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TrialOut => "trial-out",
            Self::SubjectOut => "subject-out",
            Self::TrialIn => "trial-in",
        })
    }
}
