/// Whether a row that is looked up is held until the transaction ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Lock {
    /// it is only looked at
    None,
    /// nobody may delete or change it; others may hold it in the same way
    Share,
    /// nobody else may hold it
    Update,
}
