use tracking::Stage;

/// What a stage is called in tables.
pub(crate) fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::Unseen => "unseen",
        Stage::Local => "local",
        Stage::Particles => "particles",
        Stage::Misaligned => "misaligned",
    }
}
