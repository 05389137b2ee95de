/// What gave a frame its pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// nobody was seen: the pose is the one before
    Unseen,
    /// local optimisation
    Local,
    /// particles, and local optimisation after them: nothing is misaligned any more
    Particles,
    /// limbs are misaligned, whatever was tried
    Misaligned,
}

impl Stage {
    /// What it is called in tables and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unseen => "unseen",
            Self::Local => "local",
            Self::Particles => "particles",
            Self::Misaligned => "misaligned",
        }
    }
}
