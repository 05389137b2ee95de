//! How far a silhouette can be trusted, and what to do about it, judged from the pictures alone, without ground truth.

use std::fmt;

use model::{Image, Silhouette};
use serde::{Deserialize, Serialize};

use crate::{
    classes::Classes,
    cleaning::{Cleaned, copy},
    grey::Grey,
    morphology::Morphology,
};

/// Slope from which an edge is one, grey levels.
const EDGE: i32 = 24;
/// Half the width of what counts as thin, share of the person's height.
const THIN: f64 = 0.012;

/// What can be said of one silhouette. All numbers are within [0, 1].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameQuality {
    /// share of the picture that shows the person
    pub area_share: f64,
    /// height of the person's box, share of the picture's height
    pub height_share: f64,
    /// share of the person's outline that lies on the picture's border
    pub border_share: f64,
    /// size of the largest other region, share of the person's
    pub other_share: f64,
    /// pixels of shadow within the person's box, share of them and the person's
    pub shadow_share: f64,
    /// share of the person that is thin: outlines instead of a body where the background has the person's colours, or
    /// contains the person
    pub thin_share: f64,
    /// share of the outline's edges that are edges of the background, not of the frame
    pub foreign_edge_share: f64,
    /// change of area since the frame before, share of the larger
    pub jump: f64,
    /// all of this together: 1 is good
    pub score: f64,
}

/// What can be said of a camera. All numbers are within [0, 1]; where not said otherwise they are means over the frames.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CameraQuality {
    /// frames that were segmented
    pub num_frames: usize,
    /// share of frames with a person
    pub person_share: f64,
    /// share of the clip during which what moves lies over one and the same spot
    pub stay_share: f64,
    /// share of the picture that moves from one frame of the sample to the next
    pub motion_share: f64,
    /// size of what the plate shows and the clip does not, share of the picture
    pub ghost_share: f64,
    /// share of the picture in which the plate differs from the clip
    pub plate_differing: f64,
    /// share of frames in which the person touches the border
    pub border_share: f64,
    /// share of frames with another region of at least 0.4 of the person's size
    pub several_share: f64,
    /// share of frames in which the area jumps by more than 0.3
    pub jump_share: f64,
    /// height of the person, share of the picture
    pub height_share: f64,
    /// shadow beside the person
    pub shadow_share: f64,
    /// thin parts of the person
    pub thin_share: f64,
    /// outline that is the background's
    pub foreign_edge_share: f64,
    /// all of this together: 1 is good, below 0.5 the camera had better be left out
    pub score: f64,
    /// what to do
    pub advice: Vec<Advice>,
}

/// What a user can do; displayed as a plain sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Advice {
    /// the learned background may contain the person
    PersonStays,
    /// nothing moves
    NobodyMoves,
    /// the plate is not empty
    PlateShowsSomeone,
    /// the plate lies badly
    PlateDiffers,
    /// no silhouette in many frames
    NobodyFound,
    /// outlines instead of a body
    Hollow,
    /// the outline is that of the background
    ForeignEdges,
    /// cut by the border
    LeavesPicture,
    /// hardly to be seen
    TooSmall,
    /// more than one
    SeveralPeople,
    /// strong shadows
    Shadows,
    /// the area is not steady
    Jumps,
}

impl fmt::Display for Advice {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str(match self {
            Self::PersonStays => {
                "the person never leaves the spot, so the background can't be learned from this clip: upload a background \
                 plate (a picture of the scene without anybody, by the same camera)"
            }
            Self::NobodyMoves => "nothing moves in this clip: upload a background plate, or check that it is the right clip",
            Self::PlateShowsSomeone => {
                "the background plate shows somebody or something that is not in the clip: upload a plate of the empty scene"
            }
            Self::PlateDiffers => {
                "the background plate differs from the clip in many places: take it with the same camera, unmoved, in the \
                 same light"
            }
            Self::NobodyFound => "no person was found in many frames: trim the clip to the time when the person is in view",
            Self::Hollow => {
                "large parts of the person look like the background: upload a background plate, or change clothes or \
                 background so that the colours differ"
            }
            Self::ForeignEdges => {
                "much of the outline is that of things in the background, not of the person: check the background plate, or \
                 leave this camera out"
            }
            Self::LeavesPicture => "the person is cut off by the picture's border: move the camera back, or trim the clip",
            Self::TooSmall => "the person is small in the picture: move the camera closer or zoom in",
            Self::SeveralPeople => {
                "several people or things move: only the person should move in view of the camera, or upload masks"
            }
            Self::Shadows => {
                "strong shadows fall beside the person: use softer light, or lower `darkest_shadow` if shadows are taken \
                 for the person"
            }
            Self::Jumps => {
                "the silhouette's size jumps from frame to frame: look at the overlay; the light may flicker, or somebody \
                 walks past"
            }
        })
    }
}

/// Measures silhouettes of one size.
#[derive(Debug, Clone)]
pub(crate) struct Judge {
    background: Grey,
    frame: Grey,
    scratch: Silhouette,
    morphology: Morphology,
    last_area: Option<usize>,
    sums: Sums,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    frames: usize,
    people: usize,
    touching: usize,
    several: usize,
    jumps: usize,
    means: FrameQuality,
}

/// What was known of a camera before the first silhouette.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Prospects {
    pub is_learned_from_clip: bool,
    pub stay_share: f64,
    pub motion_share: f64,
    pub ghost_share: f64,
    pub plate_differing: f64,
}

impl Judge {
    pub fn new(background: &Image) -> Self {
        let (width, height) = (background.width(), background.height());
        let grey = Grey::new(background);
        Self {
            frame: grey.clone(),
            background: grey,
            scratch: Silhouette::empty(width, height),
            morphology: Morphology::new(width, height),
            last_area: None,
            sums: Sums::default(),
        }
    }

    pub fn judge(
        &mut self,
        frame: &Image,
        classes: &Classes,
        person: &Silhouette,
        cleaned: &Cleaned,
    ) -> FrameQuality {
        self.sums.frames += 1;
        let last_area = self.last_area.replace(cleaned.area);
        if cleaned.area == 0 {
            self.sums.jumps += usize::from(last_area.is_some_and(|area| area > 0));
            return FrameQuality::default();
        }
        self.frame.set(frame);
        let (width, height) = (person.width(), person.height());
        let area = cleaned.area as f64;
        let [_, top, _, bottom] = cleaned.bounds;
        let (outline, border, foreign) = self.outline(person);
        let thin = (THIN * (bottom - top) as f64).ceil() as u32;
        copy(person, &mut self.scratch);
        self.morphology.open(&mut self.scratch, thin);
        let shadow = shadow_in(classes, cleaned.bounds) as f64;
        let jump = last_area.map_or(0.0, |last| (area - last as f64).abs() / area.max(last as f64));
        let mut quality = FrameQuality {
            area_share: area / (width * height) as f64,
            height_share: (bottom - top) as f64 / height as f64,
            border_share: border as f64 / outline.max(1) as f64,
            other_share: (cleaned.other_area as f64 / area).min(1.0),
            shadow_share: shadow / (shadow + area),
            thin_share: 1.0 - self.scratch.area() as f64 / area,
            foreign_edge_share: foreign,
            jump,
            score: 0.0,
        };
        quality.score = quality.score();
        self.sums.add(&quality);
        quality
    }

    /// Pixels of the outline, those on the border, and the share of its edges that are the background's.
    fn outline(&mut self, person: &Silhouette) -> (usize, usize, f64) {
        let (width, height) = (person.width(), person.height());
        copy(person, &mut self.scratch);
        self.morphology.erode(&mut self.scratch, 1);
        let (mut outline, mut border, mut edges, mut foreign) = (0, 0, 0, 0);
        for y in 0..height {
            for (index, (&word, &inner)) in person.row(y).iter().zip(self.scratch.row(y)).enumerate() {
                let mut bits = word & !inner;
                if y == 0 || y + 1 == height {
                    bits = word;
                }
                bits |= if index == 0 { word & 1 } else { 0 };
                bits |= if index == (width - 1) / 64 { word & 1 << ((width - 1) % 64) } else { 0 };
                while bits != 0 {
                    let x = 64 * index + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    outline += 1;
                    border += usize::from(x == 0 || y == 0 || x + 1 == width || y + 1 == height);
                    let (own, other) = (self.frame.slope_near(x, y), self.background.slope_near(x, y));
                    edges += usize::from(own.max(other) >= EDGE);
                    foreign += usize::from(other >= EDGE && 2 * other > 3 * own);
                }
            }
        }
        (outline, border, foreign as f64 / edges.max(1) as f64)
    }

    /// All frames so far, with advice.
    pub fn camera(&self, prospects: &Prospects) -> CameraQuality {
        let sums = &self.sums;
        let per_frame = |count: usize| count as f64 / sums.frames.max(1) as f64;
        let per_person = |sum: f64| sum / sums.people.max(1) as f64;
        let mut camera = CameraQuality {
            num_frames: sums.frames,
            person_share: per_frame(sums.people),
            stay_share: prospects.stay_share,
            motion_share: prospects.motion_share,
            ghost_share: prospects.ghost_share,
            plate_differing: prospects.plate_differing,
            border_share: per_frame(sums.touching),
            several_share: per_frame(sums.several),
            jump_share: per_frame(sums.jumps),
            height_share: per_person(sums.means.height_share),
            shadow_share: per_person(sums.means.shadow_share),
            thin_share: per_person(sums.means.thin_share),
            foreign_edge_share: per_person(sums.means.foreign_edge_share),
            score: sums.means.score / sums.frames.max(1) as f64,
            advice: Vec::new(),
        };
        let is_nobody = camera.motion_share < 1e-4;
        let rules = [
            (prospects.is_learned_from_clip && is_nobody, Advice::NobodyMoves, 0.2),
            (
                prospects.is_learned_from_clip && !is_nobody && camera.stay_share > 0.6,
                Advice::PersonStays,
                0.4,
            ),
            (camera.ghost_share > 0.002, Advice::PlateShowsSomeone, 0.7),
            (camera.plate_differing > 0.3, Advice::PlateDiffers, 0.8),
            (camera.person_share < 0.8, Advice::NobodyFound, 1.0),
            (camera.thin_share > 0.3, Advice::Hollow, 0.8),
            (camera.foreign_edge_share > 0.35, Advice::ForeignEdges, 0.8),
            (camera.border_share > 0.1, Advice::LeavesPicture, 1.0),
            (sums.people > 0 && camera.height_share < 0.15, Advice::TooSmall, 0.9),
            (camera.several_share > 0.2, Advice::SeveralPeople, 0.9),
            (camera.shadow_share > 0.35, Advice::Shadows, 0.95),
            (camera.jump_share > 0.05, Advice::Jumps, 0.9),
        ];
        for (_, advice, factor) in rules.into_iter().filter(|rule| rule.0) {
            camera.advice.push(advice);
            camera.score *= factor;
        }
        camera
    }
}

impl FrameQuality {
    /// A product of factors that are 1 where nothing is wrong.
    fn score(&self) -> f64 {
        // 1 up to `good`, 0.3 from `bad` on
        let factor =
            |value: f64, good: f64, bad: f64| 1.0 - 0.7 * ((value - good) / (bad - good)).clamp(0.0, 1.0);
        factor(self.border_share, 0.005, 0.1)
            * factor(self.other_share, 0.2, 0.8)
            * factor(self.thin_share, 0.15, 0.6)
            * factor(self.foreign_edge_share, 0.2, 0.6)
            * factor(self.jump, 0.1, 0.5)
            * factor(self.shadow_share, 0.3, 0.7)
            * factor(1.0 - self.height_share, 0.85, 0.97)
    }
}

impl Sums {
    fn add(&mut self, quality: &FrameQuality) {
        self.people += 1;
        self.touching += usize::from(quality.border_share > 0.0);
        self.several += usize::from(quality.other_share > 0.4);
        self.jumps += usize::from(quality.jump > 0.3);
        self.means.height_share += quality.height_share;
        self.means.shadow_share += quality.shadow_share;
        self.means.thin_share += quality.thin_share;
        self.means.foreign_edge_share += quality.foreign_edge_share;
        self.means.score += quality.score;
    }
}

fn shadow_in(classes: &Classes, [left, top, right, bottom]: [usize; 4]) -> usize {
    let mut count = 0;
    for y in top..bottom {
        for (index, word) in classes.shadow.row(y).iter().enumerate().take(right.div_ceil(64)).skip(left / 64)
        {
            let from = left.saturating_sub(64 * index);
            let to = (right - 64 * index).min(64);
            count += (word >> from << from << (64 - to)).count_ones() as usize;
        }
    }
    count
}
