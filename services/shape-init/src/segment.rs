//! The silhouettes of one camera, packed as they are made.

use std::sync::{Arc, atomic::AtomicBool};

use background::{CameraQuality, Segmenter};
use features::FrameMatcher;
use formats::{archive::Entry, image_files};
use model::{Image, Silhouette};
use multi_view::{ClipWriter, MatchClipWriter, Parameters};
use service::FileError;

use crate::{
    InputError,
    frames::{Frames, Stream},
};

/// Frames of one clip: ten seconds at 60 frames a second.
const CLIP_FRAMES: usize = 600;
/// What the pictures that a background is learned from may take, bytes.
const SAMPLE_BYTES: usize = 400 << 20;

/// What comes out, piece by piece.
pub(crate) enum Piece {
    /// packed silhouettes, and packed points that were found again
    Clip { first_frame: usize, num_frames: usize, bytes: Vec<u8>, matches: Option<Vec<u8>> },
    /// what the camera saw in the first frame, and the silhouette made of it
    Picture { frame: usize, image: Image, silhouette: Silhouette },
}

/// Where pieces and progress go. False means to stop: nobody wants more.
pub(crate) trait Sink {
    fn piece(&mut self, piece: Piece) -> bool;
    fn frame_done(&mut self, done: usize, expected: Option<usize>) -> bool;
}

/// What was seen on the way.
pub(crate) struct Made {
    pub end_frame: usize,
    pub quality: Option<CameraQuality>,
    pub warnings: Vec<String>,
}

/// Packs silhouettes into clips and keeps the pictures that are wanted.
struct Packer<'a, S> {
    parameters: &'a Parameters,
    frame: usize,
    /// frames of the whole source, if it says so
    count: Option<usize>,
    expected: Option<usize>,
    clip: Option<ClipWriter>,
    /// where points are looked for in the pictures
    features: Option<FrameMatcher>,
    matches: Option<MatchClipWriter>,
    sink: &'a mut S,
}

impl<'a, S: Sink> Packer<'a, S> {
    fn new(parameters: &'a Parameters, count: Option<usize>, sink: &'a mut S) -> Self {
        let left = count.map(|count| count.saturating_sub(parameters.first_frame));
        let expected = match (left, parameters.num_frames) {
            (Some(left), Some(asked)) => Some(left.min(asked)),
            (left, asked) => left.or(asked),
        };
        Self {
            parameters,
            frame: parameters.first_frame,
            count,
            expected,
            clip: None,
            features: None,
            matches: None,
            sink,
        }
    }

    /// Whether as many frames came as were asked for.
    fn is_full(&self) -> bool {
        self.parameters.num_frames.is_some_and(|most| self.frame - self.parameters.first_frame >= most)
    }

    /// Takes the next picture and the silhouette in it; false to stop.
    fn push_picture(&mut self, silhouette: &Silhouette, picture: &Image) -> Result<bool, InputError> {
        if let Some(features) = &mut self.features {
            let (width, height) = (silhouette.width(), silhouette.height());
            let clip = self.matches.get_or_insert_with(|| MatchClipWriter::new(width, height, self.frame));
            clip.push(&features.push(picture, silhouette))?;
        }
        self.push(silhouette, || picture.clone())
    }

    /// Takes the silhouette of the next frame; false to stop.
    fn push(&mut self, silhouette: &Silhouette, image: impl FnOnce() -> Image) -> Result<bool, InputError> {
        let clip = self
            .clip
            .get_or_insert_with(|| ClipWriter::new(silhouette.width(), silhouette.height(), self.frame));
        clip.push(silhouette)?;
        let is_clip_full = clip.num_frames() == CLIP_FRAMES;
        let mut goes_on = true;
        if self.frame == self.parameters.first_frame {
            let (image, silhouette) = (image(), silhouette.clone());
            goes_on &= self.sink.piece(Piece::Picture { frame: self.frame, image, silhouette });
        }
        self.frame += 1;
        if is_clip_full {
            goes_on &= self.close();
        }
        Ok(goes_on && self.sink.frame_done(self.frame - self.parameters.first_frame, self.expected))
    }

    fn close(&mut self) -> bool {
        let Some(clip) = self.clip.take() else { return true };
        let num_frames = clip.num_frames();
        let first_frame = self.frame - num_frames;
        let matches = self.matches.take().map(MatchClipWriter::finish);
        self.sink.piece(Piece::Clip { first_frame, num_frames, bytes: clip.finish(), matches })
    }

    /// Ends the last clip; refuses to end before the first frame.
    fn finish(mut self, name: &str) -> Result<usize, InputError> {
        if self.frame == self.parameters.first_frame {
            let first = self.parameters.first_frame;
            return Err(InputError::NoFirstFrame { file: name.to_owned(), count: self.count, first });
        }
        self.close();
        Ok(self.frame)
    }
}

/// Silhouettes that people made themselves. `Ok(None)` if the sink said to stop.
///
/// # Errors
/// The first mask that is none, with its name.
pub(crate) fn from_masks(
    name: &str,
    entries: &[Entry],
    parameters: &Parameters,
    sink: &mut impl Sink,
) -> Result<Option<Made>, InputError> {
    let mut packer = Packer::new(parameters, Some(entries.len()), sink);
    let (mut size, mut empty, mut warnings) = (None, 0, Vec::new());
    for entry in entries.iter().skip(parameters.first_frame) {
        if packer.is_full() {
            break;
        }
        let place = format!("{name}: {}", entry.name);
        let read = image_files::read_silhouette(&entry.bytes, &image_files::Limits::default())
            .map_err(FileError::in_file(&place))?;
        let mask = read.value;
        let found = [mask.width(), mask.height()];
        let first = *size.get_or_insert(found);
        if found != first {
            return Err(FileError::unexpected(
                place,
                format!("{} x {} pixels", found[0], found[1]),
                format!("{} x {} as the first", first[0], first[1]),
            )
            .into());
        }
        empty += usize::from(mask.area() == 0);
        // one warning of a kind says enough
        if warnings.len() < 3 {
            warnings.extend(read.warnings.into_iter().map(|w| format!("{place}: {}", w.message)));
        }
        if !packer.push(&mask, || painted(&mask))? {
            return Ok(None);
        }
    }
    let end_frame = packer.finish(name)?;
    if empty > 0 {
        let all = end_frame - parameters.first_frame;
        warnings.push(format!("{name}: nobody is in {empty} of {all} masks"));
    }
    Ok(Some(Made { end_frame, quality: None, warnings }))
}

/// A mask as a picture to draw on.
pub(crate) fn painted(mask: &Silhouette) -> Image {
    let mut image = Image::black(mask.width(), mask.height());
    for y in 0..mask.height() {
        for x in 0..mask.width() {
            let is_person = mask.contains(x as isize, y as isize);
            image.set(x, y, if is_person { [150, 150, 150] } else { [30, 30, 30] });
        }
    }
    image
}

/// Silhouettes of the person in front of a background that is learned first. `Ok(None)` if the sink said to stop.
///
/// # Errors
/// If frames can't be read, or no background can be learned.
pub(crate) fn from_frames(
    name: &str,
    frames: &Frames,
    plate: Option<&Image>,
    parameters: &Parameters,
    cancelled: &Arc<AtomicBool>,
    sink: &mut impl Sink,
) -> Result<Option<Made>, InputError> {
    let in_file = |source| InputError::Background { file: name.to_owned(), source };
    let announced = frames.announced()?;
    let pixels = announced.size[0] as usize * announced.size[1] as usize;
    let most = (SAMPLE_BYTES / (3 * pixels).max(1)).clamp(3, parameters.background.sample_frames.max(3));
    let Some(sample) = sample(frames, announced.count, most, cancelled, sink)? else { return Ok(None) };
    let mut segmenter = Segmenter::learn(&parameters.background, plate, &sample).map_err(in_file)?;
    drop(sample);
    let mut stream = frames.open(1, cancelled)?;
    stream.skip(parameters.first_frame)?;
    let mut packer = Packer::new(parameters, announced.count, sink);
    if parameters.track && parameters.texture {
        packer.features = Some(FrameMatcher::default());
    }
    let mut frame = Image::black(0, 0);
    while !packer.is_full() && stream.next(&mut frame)? {
        let (person, _) = segmenter.segment(&frame).map_err(in_file)?;
        if !packer.push_picture(person, &frame)? {
            return Ok(None);
        }
    }
    let end_frame = packer.finish(name)?;
    let quality = segmenter.quality();
    let mut warnings: Vec<String> = quality.advice.iter().map(|advice| format!("{name}: {advice}")).collect();
    warnings.extend(early_end(name, &mut stream, announced.count, end_frame, parameters)?);
    Ok(Some(Made { end_frame, quality: Some(quality), warnings }))
}

/// Says so if a whole clip has fewer frames than its file announced.
fn early_end(
    name: &str,
    stream: &mut Stream<'_>,
    announced: Option<usize>,
    end_frame: usize,
    parameters: &Parameters,
) -> Result<Option<String>, InputError> {
    if parameters.num_frames.is_some() || stream.next(&mut Image::black(0, 0))? {
        return Ok(None);
    }
    let missing = announced.filter(|&count| end_frame + 1 < count);
    Ok(missing.map(|count| format!("{name}: only {end_frame} of {count} frames could be read")))
}

/// At most `most` frames, spread over the whole clip.
fn sample(
    frames: &Frames,
    count: Option<usize>,
    most: usize,
    cancelled: &Arc<AtomicBool>,
    sink: &mut impl Sink,
) -> Result<Option<Vec<Image>>, InputError> {
    let every = count.map_or(1, |count| count / most).max(1);
    let is_video = matches!(frames, Frames::Video { .. });
    let mut stream = frames.open(if is_video { every } else { 1 }, cancelled)?;
    let mut sample: Vec<Image> = Vec::new();
    // where the file doesn't tell how long it is, frames are thinned out as they come
    let (mut step, mut index) = (1, 0);
    let mut frame = Image::black(0, 0);
    while stream.next(&mut frame)? {
        if index % step == 0 {
            if sample.len() == 2 * most {
                let mut place = 0;
                sample.retain(|_| {
                    place += 1;
                    place % 2 == 1
                });
                step *= 2;
            }
            if index % step == 0 {
                sample.push(frame.clone());
            }
        }
        index += 1;
        if !is_video {
            stream.skip(every - 1)?;
        }
        if !sink.frame_done(0, count) {
            return Ok(None);
        }
    }
    while sample.len() > most {
        let length = sample.len();
        let mut place = 0;
        // every picture whose share of the way passes another whole one
        sample.retain(|_| {
            let is_kept = (place + 1) * most / length > place * most / length;
            place += 1;
            is_kept
        });
    }
    Ok(Some(sample))
}
