//! Acclaim motions (AMC).

use std::{collections::HashMap, sync::Arc};

use model::{ChannelKind, Motion, Skeleton, counted};

use crate::{
    Error, Place, Read, Result, asf,
    read::Warnings,
    text::{Line, Lines, finite, push_number, quote, words},
};

/// Reads a motion of the skeleton of `acclaim` at `frame_rate` frames per second, which the format doesn't tell.
///
/// Every frame names every bone that has DOFs, in any order. Frame numbers that jump are a warning.
///
/// # Errors
/// If a line is not as the format wants it, a frame lacks a bone, a bone is not in the skeleton, or a value is not
/// finite.
pub fn read(bytes: &[u8], acclaim: &asf::File, frame_rate: f64) -> Result<Read<Motion>> {
    let skeleton = &acclaim.skeleton;
    let mut warnings = Warnings::default();
    let mut lines = Lines::new(bytes);
    let (radians, first) = header(&mut lines, &mut warnings)?;
    let factors: Vec<f64> = skeleton
        .channels()
        .map(|(_, c)| match c.kind {
            ChannelKind::Translation => acclaim.metres_per_unit,
            ChannelKind::Rotation => radians,
        })
        .collect();
    let mut frames = Frames::new(skeleton, &factors);
    let mut next = Some(first);
    while let Some(line) = next {
        if !line.text.is_empty() && line.text[0] != b'#' {
            match frame_number(line.text) {
                Some(number) => frames.begin(line.number, number, &mut warnings)?,
                None => frames.bone(line)?,
            }
        }
        next = lines.next();
    }
    frames.end(lines.number())?;
    let motion = Motion::new(Arc::clone(skeleton), frame_rate, frames.values)?;
    Ok(warnings.beside(motion))
}

/// Frames per second that the file states by `:SAMPLES-PER-SECOND`, as few files do.
pub fn stated_frame_rate(bytes: &[u8]) -> Option<f64> {
    let header = Lines::new(bytes).take_while(|line| frame_number(line.text).is_none());
    for line in header.take(1000) {
        let mut found = words(line.text);
        if found.next().is_some_and(|key| key.eq_ignore_ascii_case(b":SAMPLES-PER-SECOND")) {
            return found.next().and_then(finite).filter(|rate| *rate > 0.0);
        }
    }
    None
}

/// Reads what comes before the first frame; gives radians per unit of angle and the first frame's line.
fn header<'a>(lines: &mut Lines<'a>, warnings: &mut Warnings) -> Result<(f64, Line<'a>)> {
    let mut radians = None;
    for line in lines.by_ref() {
        if line.text.is_empty() || line.text[0] == b'#' {
            continue;
        }
        if line.text[0] == b':' {
            let key = words(line.text).next().unwrap_or_default().to_ascii_uppercase();
            match key.as_slice() {
                b":DEGREES" => radians = Some(1f64.to_radians()),
                b":RADIANS" => radians = Some(1.0),
                b":FULLY-SPECIFIED" | b":SAMPLES-PER-SECOND" => {}
                _ => warnings.line(line.number, format!("{} is skipped", quote(&key))),
            }
        } else if frame_number(line.text).is_some() {
            if radians.is_none() {
                warnings
                    .line(line.number, "neither :DEGREES nor :RADIANS is given; angles are taken as degrees");
            }
            return Ok((radians.unwrap_or(1f64.to_radians()), line));
        } else {
            return Err(Error::at_line(line.number, quote(line.text), "the number of the first frame"));
        }
    }
    Err(Error::at_line(lines.number(), "the end of the file", "a frame"))
}

/// A line with nothing but a whole number starts a frame.
fn frame_number(text: &[u8]) -> Option<u64> {
    if !text.first().is_some_and(u8::is_ascii_digit) {
        return None;
    }
    std::str::from_utf8(text).ok()?.parse().ok()
}

/// The frames read so far.
struct Frames<'s> {
    skeleton: &'s Skeleton,
    factors: &'s [f64],
    joint_of: HashMap<&'s [u8], usize>,
    /// the frame in which each joint was seen last, counted from 1
    seen_in: Vec<usize>,
    /// joints in the order of the first frame, a guess for the next
    order: Vec<usize>,
    frame: usize,
    number: u64,
    bones: usize,
    joints_with_dofs: usize,
    values: Vec<f64>,
}

impl<'s> Frames<'s> {
    fn new(skeleton: &'s Skeleton, factors: &'s [f64]) -> Self {
        let joints = skeleton.joints();
        Self {
            skeleton,
            factors,
            joint_of: joints.iter().enumerate().map(|(i, j)| (j.name.as_bytes(), i)).collect(),
            seen_in: vec![0; joints.len()],
            order: Vec::new(),
            frame: 0,
            number: 0,
            bones: 0,
            joints_with_dofs: joints.iter().filter(|j| !j.channels.is_empty()).count(),
            values: Vec::new(),
        }
    }

    fn begin(&mut self, line: usize, number: u64, warnings: &mut Warnings) -> Result<()> {
        if self.frame > 0 {
            self.end(line)?;
            if self.number.checked_add(1) != Some(number) {
                warnings.line(line, format!("frame {number} follows frame {}", self.number));
            }
        }
        self.frame += 1;
        self.number = number;
        self.bones = 0;
        self.values.resize(self.values.len() + self.factors.len(), 0.0);
        Ok(())
    }

    fn bone(&mut self, line: Line<'_>) -> Result<()> {
        let end = line.text.iter().position(|b| b.is_ascii_whitespace()).unwrap_or(line.text.len());
        let name = &line.text[..end];
        let joint = self.joint(name).ok_or_else(|| {
            Error::at_line(line.number, format!("bone {}", quote(name)), "a bone of the skeleton")
        })?;
        if self.seen_in[joint] == self.frame {
            let found = format!("bone {} a second time in frame {}", quote(name), self.number);
            return Err(Error::at_line(line.number, found, "each bone once"));
        }
        self.seen_in[joint] = self.frame;
        if self.frame == 1 {
            self.order.push(joint);
        }
        self.bones += 1;
        let dofs = self.skeleton.dofs(joint);
        let start = self.values.len() - self.factors.len();
        let slots = &mut self.values[start + dofs.start..start + dofs.end];
        let mut found = words(&line.text[end..]);
        for (slot, factor) in slots.iter_mut().zip(&self.factors[dofs.clone()]) {
            let word = found.next().ok_or_else(|| wrong_count(line, name, dofs.len()))?;
            let value = finite(word).map(|v| v * factor).filter(|v| v.is_finite());
            *slot = value.ok_or_else(|| Error::at_line(line.number, quote(word), "a finite number"))?;
        }
        if found.next().is_some() {
            return Err(wrong_count(line, name, dofs.len()));
        }
        Ok(())
    }

    fn joint(&self, name: &[u8]) -> Option<usize> {
        let guess = self.order.get(self.bones).copied();
        guess
            .filter(|joint| self.skeleton.joints()[*joint].name.as_bytes() == name)
            .or_else(|| self.joint_of.get(name).copied())
    }

    /// Checks that the frame is complete; `line` is the one after it.
    fn end(&self, line: usize) -> Result<()> {
        let missing = self
            .skeleton
            .joints()
            .iter()
            .zip(&self.seen_in)
            .find(|(joint, seen)| **seen != self.frame && !joint.channels.is_empty());
        match missing {
            // counting first keeps this cheap for the many frames that are complete
            _ if self.bones == self.seen_in.len() || self.joints_with_dofs == 0 => Ok(()),
            Some((joint, _)) => Err(Error::Unexpected {
                place: Place::Line(line),
                found: format!("the end of frame {} without bone {}", self.number, joint.name),
                expected: "every bone that has DOFs in every frame".into(),
            }),
            None => Ok(()),
        }
    }
}

fn wrong_count(line: Line<'_>, name: &[u8], expected: usize) -> Error {
    let found = words(line.text).count() - 1;
    Error::at_line(
        line.number,
        format!("{} of bone {}", counted(found, "value"), quote(name)),
        format!("{expected}, one per DOF of the skeleton"),
    )
}

/// Writes a motion in degrees and CMU's unit of length, to be read with the ASF that [`asf::write`] gives for the
/// same skeleton.
///
/// Numbers have seven decimals: what is read again differs by at most 5e-8 degrees and 3 nanometres.
pub fn write(motion: &Motion) -> String {
    let skeleton = motion.skeleton();
    let bones: Vec<_> = asf::bones(skeleton).into_iter().filter(|b| !b.columns.is_empty()).collect();
    let mut out = String::from(":FULLY-SPECIFIED\n:DEGREES\n");
    for (frame, pose) in motion.poses().enumerate() {
        out.push_str(&(frame + 1).to_string());
        out.push('\n');
        for bone in &bones {
            out.push_str(&bone.name);
            for column in &bone.columns {
                out.push(' ');
                push_number(&mut out, asf::Bone::to_file(column.channel.kind, pose[column.dof]));
            }
            out.push('\n');
        }
    }
    out
}
