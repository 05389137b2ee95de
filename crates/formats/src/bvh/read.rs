use std::sync::Arc;

use model::{Channel, ChannelKind, Joint, Motion, Skeleton, counted};

use super::{
    Options,
    hierarchy::{self, RawJoint},
};
use crate::{
    Error, Place, Read, Result, frame_rate,
    read::Warnings,
    text::{Line, Lines, finite, quote, words},
};

/// Reads a skeleton and its motion.
///
/// The root's position channels replace its `OFFSET`. Those of other joints replace it too if that makes the
/// joints move less (as most programs write them), else they are added to it.
///
/// # Errors
/// If the hierarchy is not as the format wants it, a frame has another number of values than the hierarchy has
/// channels, or a value is not finite. A wrong number of frames in the header is only a warning.
pub fn read(bytes: &[u8], options: &Options) -> Result<Read<Motion>> {
    if !(options.metres_per_unit.is_finite() && options.metres_per_unit > 0.0) {
        return Err(Error::whole_file(
            format!("{} metres per unit", options.metres_per_unit),
            "a positive number",
        ));
    }
    let mut warnings = Warnings::default();
    let mut lines = Lines::new(bytes);
    let raw = hierarchy::read(&mut lines, &mut warnings)?;
    let declared = declared_frames(&mut lines)?;
    let rate = declared_rate(&mut lines)?;
    let channels: Vec<_> = raw.iter().flat_map(|j| j.channels.iter().copied()).collect();
    if channels.is_empty() {
        return Err(Error::at_line(lines.number(), "a skeleton without channels", "at least one"));
    }
    let mut values = values(&mut lines, &channels, options.metres_per_unit)?;
    let found = values.len() / channels.len();
    if found == 0 {
        return Err(Error::at_line(lines.number(), "the end of the file", "a frame"));
    }
    if Some(found as u64) != declared {
        let declared = declared.map_or("an unknown number of".into(), |n| n.to_string());
        let message =
            format!("the file declares {} and has {found}; all {found} are read", counted(declared, "frame"));
        warnings.add(Place::File, message);
    }
    let joints = joints(&raw, options.metres_per_unit);
    let name = raw[0].name.clone();
    let skeleton = Skeleton::new(name, joints)
        .map_err(|source| Error::Model { place: Place::Line(raw[0].line), source })?;
    positions_from_rest(&skeleton, &mut values);
    let motion = Motion::new(Arc::new(skeleton), rate, values)?;
    Ok(warnings.beside(motion))
}

/// What follows a key such as `Frames:`; blanks around the colon and its absence are forgiven.
fn after_key<'a>(line: Line<'a>, key: &[u8]) -> Option<&'a [u8]> {
    let (start, rest) = line.text.split_at_checked(key.len())?;
    if !start.eq_ignore_ascii_case(key) {
        return None;
    }
    let rest = rest.trim_ascii_start();
    Some(rest.strip_prefix(b":").unwrap_or(rest).trim_ascii())
}

fn header_line<'a>(lines: &mut Lines<'a>, key: &str) -> Result<(usize, &'a [u8])> {
    let Some(line) = lines.find(|line| !line.text.is_empty()) else {
        return Err(Error::at_line(lines.number(), "the end of the file", format!("{key}:")));
    };
    let rest = after_key(line, key.as_bytes());
    let rest = rest.ok_or_else(|| Error::at_line(line.number, quote(line.text), format!("{key}:")))?;
    Ok((line.number, rest))
}

/// `None` where the header has something that can't be a number of frames: the rows are counted anyway.
fn declared_frames(lines: &mut Lines<'_>) -> Result<Option<u64>> {
    let (_, rest) = header_line(lines, "Frames")?;
    Ok(std::str::from_utf8(rest).ok().and_then(|text| text.parse().ok()))
}

fn declared_rate(lines: &mut Lines<'_>) -> Result<f64> {
    let (line, rest) = header_line(lines, "Frame Time")?;
    let seconds = words(rest).next().and_then(finite).filter(|t| (1e-6..=1e6).contains(t));
    let seconds =
        seconds.ok_or_else(|| Error::at_line(line, quote(rest), "seconds per frame from 1e-6 to 1e6"))?;
    Ok(frame_rate::from_period(seconds, frame_rate::decimals(rest)))
}

/// Metres and radians, row-major, shape `[frames, channels]`.
fn values(lines: &mut Lines<'_>, channels: &[Channel], metres_per_unit: f64) -> Result<Vec<f64>> {
    let factors: Vec<_> = channels
        .iter()
        .map(|c| match c.kind {
            ChannelKind::Translation => metres_per_unit,
            ChannelKind::Rotation => 1f64.to_radians(),
        })
        .collect();
    let mut values = Vec::new();
    for line in lines {
        if line.text.is_empty() {
            continue;
        }
        let mut found = words(line.text);
        for (index, factor) in factors.iter().enumerate() {
            let Some(word) = found.next() else { return Err(wrong_count(line, index, factors.len())) };
            let value = finite(word).map(|v| v * factor).filter(|v| v.is_finite());
            values.push(value.ok_or_else(|| Error::at_line(line.number, quote(word), "a finite number"))?);
        }
        let more = found.count();
        if more > 0 {
            return Err(wrong_count(line, factors.len() + more, factors.len()));
        }
    }
    Ok(values)
}

fn wrong_count(line: Line<'_>, found: usize, expected: usize) -> Error {
    Error::at_line(
        line.number,
        counted(found, "value"),
        format!("{expected}, one for each channel of the hierarchy"),
    )
}

fn joints(raw: &[RawJoint], metres_per_unit: f64) -> Vec<Joint> {
    raw.iter()
        .map(|raw| {
            let mut offset = raw.offset * metres_per_unit;
            if raw.parent.is_none() {
                for channel in raw.channels.iter().filter(|c| c.kind == ChannelKind::Translation) {
                    offset[channel.axis.index()] = 0.0;
                }
            }
            let mut joint = Joint::child(raw.name.clone(), raw.parent, offset, raw.channels.clone());
            joint.tip = raw.tip.unwrap_or_default() * metres_per_unit;
            joint
        })
        .collect()
}

/// Position channels of joints below the root become differences from the joint's offset where they are positions.
fn positions_from_rest(skeleton: &Skeleton, values: &mut [f64]) {
    let dofs: Vec<_> = skeleton
        .channels()
        .enumerate()
        .filter(|(_, (joint, c))| *joint > 0 && c.kind == ChannelKind::Translation)
        .map(|(dof, (joint, c))| (dof, skeleton.joints()[joint].offset[c.axis.index()]))
        .collect();
    let (mut if_positions, mut if_differences) = (0.0, 0.0);
    for pose in values.chunks_exact(skeleton.num_dofs()) {
        for (dof, offset) in &dofs {
            if_positions += (pose[*dof] - offset).abs();
            if_differences += pose[*dof].abs();
        }
    }
    if if_positions < if_differences {
        for pose in values.chunks_exact_mut(skeleton.num_dofs()) {
            for (dof, offset) in &dofs {
                pose[*dof] -= offset;
            }
        }
    }
}
