/// Why a body model could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A rig that can't be.
    #[error("rig: {what}")]
    Rig {
        /// what was found and what was expected
        what: String,
    },
    /// Joints that can't be computed from the vertices.
    #[error("joint regressor: {what}")]
    Regressor {
        /// what was found and what was expected
        what: String,
    },
    /// A skin that doesn't fit mesh and rig.
    #[error("skin: {what}")]
    Skin {
        /// what was found and what was expected
        what: String,
    },
    /// Parts that don't make a model.
    #[error("body model: {what}")]
    Model {
        /// what was found and what was expected
        what: String,
    },
}
