//! Writing C3D: numbers of Intel's, floats, no analog channels.

use model::PointTrajectories;

use super::parameters::BLOCK;

/// Bytes of a label, at most: a parameter's dimension is one byte.
const LONGEST: usize = 127;
/// Values of one parameter, at most.
const MOST: usize = 255;
/// A count that does not fit its word is written as this; long counts are elsewhere.
const FULL: usize = u16::MAX as usize;

/// Writes point trajectories: millimetres, y up (`POINT:Y_SCREEN` is `+Y`). Samples that were not measured have a residual of
/// -1.
pub fn write(trajectories: &PointTrajectories) -> Vec<u8> {
    let (points, frames) = (trajectories.num_points(), trajectories.num_frames());
    let rate = trajectories.frame_rate() as f32;
    let word = |count: usize| (count.min(FULL) as u16).to_le_bytes();
    let parameters = parameters(trajectories);
    let data_block = 2 + parameters.len() / BLOCK;

    let mut bytes = vec![2, 0x50];
    for count in [points, 0, 1, frames, 0] {
        bytes.extend(word(count));
    }
    // a negative scale says that the data are floats
    bytes.extend((-1.0f32).to_le_bytes());
    bytes.extend(word(data_block));
    bytes.extend(word(0));
    bytes.extend(rate.to_le_bytes());
    bytes.resize(BLOCK, 0);
    bytes.extend(parameters);
    for frame in 0..frames {
        for position in trajectories.frame(frame) {
            let is_measured = position.iter().all(|value| value.is_finite());
            for value in position.iter() {
                let millimetres = if is_measured { (1e3 * value) as f32 } else { 0.0 };
                bytes.extend(millimetres.to_le_bytes());
            }
            bytes.extend(if is_measured { 0.0f32 } else { -1.0 }.to_le_bytes());
        }
    }
    let blocks = bytes.len().div_ceil(BLOCK);
    bytes.resize(blocks * BLOCK, 0);
    bytes
}

/// The section of parameters, in whole blocks.
fn parameters(trajectories: &PointTrajectories) -> Vec<u8> {
    let (points, frames) = (trajectories.num_points(), trajectories.num_frames());
    let rate = trajectories.frame_rate() as f32;
    let labels: Vec<&str> = trajectories.names().iter().map(|name| shortened(name)).collect();
    // where the data begin is known when all else is there: a word takes the same room whatever it says
    let section = |data_block: usize| {
        let mut section = Section::default();
        section.group(1, "POINT");
        section.words(1, "USED", &[points]);
        section.floats(1, "SCALE", &[-1.0]);
        section.floats(1, "RATE", &[rate]);
        section.words(1, "DATA_START", &[data_block]);
        section.words(1, "FRAMES", &[frames]);
        section.floats(1, "LONG_FRAMES", &[frames as f32]);
        section.texts(1, "UNITS", &["mm"]);
        section.texts(1, "X_SCREEN", &["+X"]);
        section.texts(1, "Y_SCREEN", &["+Y"]);
        for (number, labels) in labels.chunks(MOST).enumerate() {
            let name = if number == 0 { "LABELS".to_owned() } else { format!("LABELS{}", number + 1) };
            section.texts(1, &name, labels);
        }
        section.group(2, "ANALOG");
        section.words(2, "USED", &[0]);
        section.floats(2, "GEN_SCALE", &[1.0]);
        section.floats(2, "RATE", &[rate]);
        section.group(3, "TRIAL");
        section.words(3, "ACTUAL_START_FIELD", &[1, 0]);
        section.words(3, "ACTUAL_END_FIELD", &[frames % (FULL + 1), frames / (FULL + 1)]);
        section.finish()
    };
    let blocks = section(0).len() / BLOCK;
    section(2 + blocks)
}

/// The beginning of a name that fits.
fn shortened(name: &str) -> &str {
    let mut end = name.len().min(LONGEST);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    &name[..end]
}

/// Groups and parameters, one after the other.
#[derive(Default)]
struct Section {
    bytes: Vec<u8>,
}

impl Section {
    fn group(&mut self, id: i8, name: &str) {
        // no description
        self.record(-id, name, &[0]);
    }

    fn words(&mut self, group: i8, name: &str, values: &[usize]) {
        let values = values.iter().flat_map(|value| ((*value).min(FULL) as u16).to_le_bytes());
        let values: Vec<u8> = values.collect();
        self.parameter(group, name, 2, &dimensions(values.len() / 2), &values);
    }

    fn floats(&mut self, group: i8, name: &str, values: &[f32]) {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.parameter(group, name, 4, &dimensions(values.len()), &bytes);
    }

    /// Texts are filled up with blanks to the length of the longest.
    fn texts(&mut self, group: i8, name: &str, texts: &[&str]) {
        let length = texts.iter().map(|text| text.len()).max().unwrap_or(0).max(1);
        let mut bytes = Vec::with_capacity(length * texts.len());
        for text in texts {
            bytes.extend(text.as_bytes());
            bytes.resize(bytes.len() + length - text.len(), b' ');
        }
        self.parameter(group, name, -1, &[length as u8, texts.len() as u8], &bytes);
    }

    fn parameter(&mut self, group: i8, name: &str, kind: i8, dimensions: &[u8], values: &[u8]) {
        let mut content = vec![kind.cast_unsigned(), dimensions.len() as u8];
        content.extend(dimensions);
        content.extend(values);
        // no description
        content.push(0);
        self.record(group, name, &content);
    }

    fn record(&mut self, id: i8, name: &str, content: &[u8]) {
        self.bytes.extend([name.len() as u8, id.cast_unsigned()]);
        self.bytes.extend(name.as_bytes());
        // from this word to the next record
        self.bytes.extend(((content.len() + 2) as u16).to_le_bytes());
        self.bytes.extend(content);
    }

    fn finish(self) -> Vec<u8> {
        let blocks = (4 + self.bytes.len() + 1).div_ceil(BLOCK);
        // 84: Intel's numbers
        let mut section = vec![1, 0x50, blocks as u8, 84];
        section.extend(self.bytes);
        section.resize(blocks * BLOCK, 0);
        section
    }
}

/// One value has no dimension.
fn dimensions(count: usize) -> Vec<u8> {
    if count == 1 { Vec::new() } else { vec![count as u8] }
}
