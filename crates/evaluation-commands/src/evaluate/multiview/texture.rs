//! Points of the person that cameras find again from picture to picture.

use std::time::Instant;

use anyhow::Context;
use features::FrameMatcher;
use model::{Camera, PointMatch, Silhouette};
use shape_fit::cleaned;
use tracking::ObservedFrame;

use super::ms;
use crate::evaluate::capture::Folder;

/// One camera's pictures so far.
#[derive(Default)]
struct Pictures {
    matcher: FrameMatcher,
    /// index of the frame of the last one
    last: Option<usize>,
}

/// All cameras' pictures so far. Not every camera has one of every frame.
pub struct Texture {
    cameras: Vec<Pictures>,
    /// what finding and matching points took, milliseconds, of each frame with a picture
    pub ms: Vec<f64>,
    /// points found again, in all cameras and frames
    pub matches: usize,
}

impl Texture {
    /// Of so many cameras.
    pub fn new(cameras: usize) -> Self {
        Self { cameras: (0..cameras).map(|_| Pictures::default()).collect(), ms: Vec::new(), matches: 0 }
    }

    /// The frame with the points that its pictures, where there are any, have in common with the pictures before.
    pub fn add(
        &mut self,
        mut frame: ObservedFrame,
        folder: &Folder,
        number: u32,
        views: &[(Camera, Silhouette)],
    ) -> anyhow::Result<ObservedFrame> {
        let mut taken = None;
        for (camera, (pictures, (_, silhouette))) in self.cameras.iter_mut().zip(views).enumerate() {
            let Some(picture) = folder.picture(camera, number)? else { continue };
            let started = Instant::now();
            let mut found = pictures.matcher.push(&picture, &cleaned(silhouette));
            if let Some(last) = pictures.last.replace(frame.index) {
                let back =
                    u32::try_from(frame.index - last).context("too many frames between two pictures")?;
                found = found.into_iter().map(|found| PointMatch { frames_back: back, ..found }).collect();
                self.matches += found.len();
                frame = frame.with_matches(camera, &found);
            }
            *taken.get_or_insert(0.0) += ms(started);
        }
        self.ms.extend(taken);
        Ok(frame)
    }
}
