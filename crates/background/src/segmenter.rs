use model::{Image, Silhouette};

use crate::{
    Alignment, CameraQuality, Cleaner, Error, FrameQuality, ModelKind, Parameters, Result,
    classes::Classes,
    distortion::Distortion,
    ghosts::ghosts,
    mixture::Mixture,
    plate::AlignedPlate,
    quality::{Judge, Prospects},
    sample::{Sample, size_of},
};

/// A background that was learned.
#[derive(Debug, Clone)]
pub enum BackgroundModel {
    /// one colour a pixel, of a plate or learned from the clip
    Distortion(Box<Distortion>),
    /// several colours a pixel
    Mixture(Mixture),
}

impl BackgroundModel {
    /// Says what each pixel of a frame shows, and learns from its background.
    ///
    /// # Panics
    /// If the frame or the classes are of another size than the frames it was learned from.
    pub fn classify(&mut self, frame: &Image, classes: &mut Classes) {
        match self {
            Self::Distortion(model) => model.classify(frame, classes),
            Self::Mixture(model) => model.classify(frame, classes),
        }
    }

    /// The picture of the background, as it is now.
    pub fn expected(&self) -> Image {
        match self {
            Self::Distortion(model) => model.expected(),
            Self::Mixture(model) => model.expected(),
        }
    }
}

/// Makes the silhouettes of one camera, frame after frame.
#[derive(Debug, Clone)]
pub struct Segmenter {
    width: usize,
    height: usize,
    model: BackgroundModel,
    alignment: Option<Alignment>,
    cleaner: Cleaner,
    judge: Judge,
    prospects: Prospects,
    classes: Classes,
    person: Silhouette,
    frames: usize,
}

impl Segmenter {
    /// Learns the background of a camera from frames spread over the whole clip, in their order, and a plate if there is
    /// one. The sample may contain the person; without a plate it must not be in one place for half of them.
    ///
    /// # Errors
    /// [`Error`] names the parameter, frame or plate that is invalid.
    pub fn learn(parameters: &Parameters, plate: Option<&Image>, sample: &[Image]) -> Result<Self> {
        parameters.check()?;
        let (width, height) = size_of(sample)?;
        let statistics = Sample::new(sample)?;
        let mut prospects = Prospects {
            is_learned_from_clip: true,
            stay_share: statistics.stay_share,
            motion_share: statistics.motion_share,
            ..Prospects::default()
        };
        let mut alignment = None;
        let model = match (parameters.model, plate) {
            (ModelKind::Plate, None) => return Err(Error::NoPlate),
            (ModelKind::Plate | ModelKind::Auto, Some(plate)) => {
                let aligned = AlignedPlate::new(parameters, plate, &statistics.median)?;
                let mut model = Distortion::from_plate(parameters, &aligned.image, sample, &statistics);
                let still = still(sample, &statistics);
                let mut classes = Classes::new(width, height);
                // a copy, because classifying learns
                model.clone().classify(&statistics.median, &mut classes);
                let ghosts = ghosts(&aligned.image, &statistics.median, &classes.foreground, &still);
                model.replace(&ghosts, &statistics.median);
                prospects.is_learned_from_clip = false;
                prospects.ghost_share = ghosts.area() as f64 / (width * height) as f64;
                prospects.plate_differing = aligned.alignment.differing;
                alignment = Some(aligned.alignment);
                BackgroundModel::Distortion(Box::new(model))
            }
            (ModelKind::Adaptive | ModelKind::Auto, _) => {
                BackgroundModel::Distortion(Box::new(Distortion::adaptive(parameters, sample, &statistics)))
            }
            (ModelKind::Mixture, _) => BackgroundModel::Mixture(Mixture::new(parameters, sample)),
        };
        Ok(Self {
            width,
            height,
            judge: Judge::new(&model.expected()),
            model,
            alignment,
            cleaner: Cleaner::new(&parameters.cleaning, width, height),
            prospects,
            classes: Classes::new(width, height),
            person: Silhouette::empty(width, height),
            frames: 0,
        })
    }

    /// The silhouette of the next frame, and how far to trust it.
    ///
    /// # Errors
    /// [`Error::FrameSize`] if the frame is of another size than the sample.
    pub fn segment(&mut self, frame: &Image) -> Result<(&Silhouette, FrameQuality)> {
        if (frame.width(), frame.height()) != (self.width, self.height) {
            return Err(Error::FrameSize {
                frame: self.frames,
                found_width: frame.width(),
                found_height: frame.height(),
                width: self.width,
                height: self.height,
            });
        }
        self.frames += 1;
        self.model.classify(frame, &mut self.classes);
        let cleaned = self.cleaner.clean(&self.classes, &mut self.person);
        let quality = self.judge.judge(frame, &self.classes, &self.person, &cleaned);
        Ok((&self.person, quality))
    }

    /// How far to trust this camera, by the frames so far, and what to do about it.
    pub fn quality(&self) -> CameraQuality {
        self.judge.camera(&self.prospects)
    }

    /// What the pixels of the last frame were taken for, before cleaning.
    pub fn classes(&self) -> &Classes {
        &self.classes
    }

    /// The background.
    pub fn model(&self) -> &BackgroundModel {
        &self.model
    }

    /// How the plate was brought over the frames, if there is one.
    pub fn alignment(&self) -> Option<Alignment> {
        self.alignment
    }
}

/// Pixels that keep their colour in most of the sample.
fn still(frames: &[Image], sample: &Sample) -> Silhouette {
    let (width, height) = (sample.median.width(), sample.median.height());
    let mut still = Silhouette::empty(width, height);
    for y in 0..height {
        let middle = sample.median.row(y);
        for x in 0..width {
            let moved = frames.iter().filter(|frame| {
                let pixel = &frame.row(y)[3 * x..3 * x + 3];
                (0..3).any(|c| {
                    let level = middle[3 * x + c];
                    f32::from(pixel[c].abs_diff(level)) > 6.0 + 4.0 * sample.noise_at(f32::from(level))
                })
            });
            still.set(x, y, 4 * moved.count() <= frames.len());
        }
    }
    still
}
