//! Identifiers of equal shape that must not mix.

use std::fmt;

use serde::{Deserialize, Serialize};
use uuid::Uuid;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident($inner:ty)) => {
        $(#[$doc])*
        #[derive(
            Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, sqlx::Type,
        )]
        #[serde(transparent)]
        #[sqlx(transparent)]
        pub struct $name(
            /// The bare value.
            pub $inner,
        );

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }

        impl From<$inner> for $name {
            fn from(value: $inner) -> Self {
                Self(value)
            }
        }
    };
}

id!(
    /// A run: what a user starts and watches. Time-ordered (UUID version 7).
    RunId(Uuid)
);
id!(
    /// A tenant. The queue only shares out its slots by it.
    ProjectId(Uuid)
);
id!(
    /// A job. Ids rise in the order of enqueueing.
    JobId(i64)
);
id!(
    /// The number of a claim of one job. Every claim raises it, nothing lowers it; whoever writes for a
    /// job shows it, and a write with an old one is refused.
    LeaseNumber(i64)
);
