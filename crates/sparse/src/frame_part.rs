/// The parts of a frame, for callers that time them: see [`crate::Reconstructor::watched`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FramePart {
    /// the search for a pose to start from; frames follow on which the candidates are compared
    Start,
    /// the query: measurements in the heading frame, window features in principal axes
    Query,
    /// the nearest windows
    Search,
    /// the prior: neighbours gathered, regression, covariance of its residuals
    Prior,
    /// the most probable pose
    Map,
    /// what remains: the pose back in the world, its standard deviations
    Rest,
}
