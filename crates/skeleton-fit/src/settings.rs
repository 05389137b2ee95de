/// What decides how far a fit trusts what it sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitSettings {
    /// standard deviation of a point's coordinate about that of the recording it is compared with, metres: two people
    /// who do the same thing are so far apart
    pub kernel_sigma_m: f64,
    /// independent spans that a session is worth at most: how a person moves is the same in all of it
    pub independent_spans: f64,
    /// a span farther than this from all recordings, in standard deviations of a point, is like nothing known and says
    /// nothing
    pub unexplained_sigmas: f64,
}

impl Default for FitSettings {
    fn default() -> Self {
        Self { kernel_sigma_m: 0.04, independent_spans: 1.5, unexplained_sigmas: 3.0 }
    }
}
