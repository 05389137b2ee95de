//! The words for where a run and a job stand.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A word in the database that this version does not know.
#[derive(Debug, thiserror::Error)]
#[error("unknown state {found:?}, expected one of {expected}")]
pub struct UnknownState {
    /// The word.
    pub found: String,
    /// The known words.
    pub expected: &'static str,
}

macro_rules! states {
    ($(#[$doc:meta])* $name:ident, $known:literal { $($(#[$variant_doc:meta])* $variant:ident = $word:literal),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "lowercase")]
        pub enum $name { $($(#[$variant_doc])* $variant),* }

        impl $name {
            /// The word used in the database and on the wire.
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $word),* }
            }

            /// Whether nothing more will happen to it.
            pub fn is_finished(self) -> bool {
                matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.as_str())
            }
        }

        impl FromStr for $name {
            type Err = UnknownState;

            fn from_str(word: &str) -> Result<Self, UnknownState> {
                match word {
                    $($word => Ok(Self::$variant),)*
                    _ => Err(UnknownState { found: word.to_owned(), expected: $known }),
                }
            }
        }

        impl TryFrom<String> for $name {
            type Error = UnknownState;

            fn try_from(word: String) -> Result<Self, UnknownState> {
                word.parse()
            }
        }
    };
}

states!(
    /// Where a run stands.
    RunState, "queued, running, succeeded, failed, cancelled" {
        /// None of its jobs has begun.
        Queued = "queued",
        /// Some job has begun.
        Running = "running",
        /// All its jobs have succeeded.
        Succeeded = "succeeded",
        /// One of its jobs failed for good.
        Failed = "failed",
        /// The user did not want it any more.
        Cancelled = "cancelled",
    }
);

states!(
    /// Where a job stands.
    JobState, "blocked, available, running, succeeded, failed, cancelled" {
        /// Waits for jobs that it depends on.
        Blocked = "blocked",
        /// Can be claimed (once its time has come, after a failed attempt).
        Available = "available",
        /// A worker holds its lease.
        Running = "running",
        /// Done; its artefacts are recorded.
        Succeeded = "succeeded",
        /// Failed for good.
        Failed = "failed",
        /// Not wanted any more.
        Cancelled = "cancelled",
    }
);
