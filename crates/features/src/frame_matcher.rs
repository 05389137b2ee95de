use model::{Image, PointMatch, Silhouette};

use crate::{Detector, Features, Options, match_features};

/// Matches each picture of a camera with the one before.
#[derive(Debug, Default)]
pub struct FrameMatcher {
    options: Options,
    detector: Detector,
    before: Features,
}

impl FrameMatcher {
    /// Before the first picture.
    pub fn new(options: Options) -> Self {
        Self { options, ..Self::default() }
    }

    /// Takes the next picture; the points of the person that were found in the one before as well. None in the first.
    pub fn push(&mut self, image: &Image, silhouette: &Silhouette) -> Vec<PointMatch> {
        let now = self.detector.detect(image, silhouette, &self.options);
        let pairs = match_features(&self.before, &now, &self.options);
        let found = pairs
            .into_iter()
            .map(|[before, here]| PointMatch {
                frames_back: 1,
                before: self.before.points[before].pixel,
                now: now.points[here].pixel,
            })
            .collect();
        self.before = now;
        found
    }
}
