use std::fmt;

use serde::{Deserialize, Serialize};

/// What a drawn person does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Action {
    /// walking, straight or slightly turning
    Walk,
    /// running and jogging
    Run,
    /// single jumps up and forward, with pauses
    Jump,
    /// punches left and right, and guarding between them
    Boxing,
}

impl Action {
    /// All actions.
    pub const ALL: [Self; 4] = [Self::Walk, Self::Run, Self::Jump, Self::Boxing];

    /// The lower-case name: `walk`, `run`, `jump`, `boxing`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Walk => "walk",
            Self::Run => "run",
            Self::Jump => "jump",
            Self::Boxing => "boxing",
        }
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
