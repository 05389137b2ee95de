/// What is taken for a feature and for a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// most features of a picture: the strongest, spread over the person. The work of matching grows with its square
    pub max_features: usize,
    /// least height of an extremum of the differences of Gaussians; black is 0 and white 1
    pub contrast: f64,
    /// extrema whose principal curvatures have a larger ratio lie along edges and are left out
    pub edge_ratio: f64,
    /// how far inside the silhouette features are, pixels of the octave that they are found in
    pub margin_px: usize,
    /// a match must be this much nearer than the second nearest, whose place is another (ratio of distances)
    pub ratio: f64,
    /// how far a point moves between two pictures at most, as a share of the larger side of the box around the features
    pub reach: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_features: 400, contrast: 0.006, edge_ratio: 10.0, margin_px: 3, ratio: 0.8, reach: 0.2 }
    }
}
