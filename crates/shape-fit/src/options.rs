/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// how far the model's surface is expected to be off where pose and shape are right, metres, one standard deviation: what
    /// the model can't express, clothes, and silhouettes that are a little too large or too small
    pub sigma_m: f64,
    /// length of outline over which such errors are alike, metres; longer means that silhouettes tell less against the
    /// prior Σ α²
    pub correlation_m: f64,
    /// a mean intersection over union below this is a failure
    pub least_iou: f64,
    /// leave one camera out if it disagrees with all others, rather than fail
    pub leave_out_bad_view: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { sigma_m: 0.004, correlation_m: 0.10, least_iou: 0.75, leave_out_bad_view: false }
    }
}
