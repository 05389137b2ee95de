use bytemuck::Pod;
use bytes::Bytes;
use kinematics::{Parametrisation, References};
use model::Skeleton;
use nalgebra::Matrix3;

use super::layout::{
    Directory, END, HEAD, MAGIC, Section, SegmentsRecord, TAIL, WindowsRecord, checksum, wrong,
};
use super::{FORMAT_VERSION, IndexFile};
use crate::blocks::{Blocks, PREFIX};
use crate::build::MAX_POSES;
use crate::column::Column;
use crate::graph::DEGREE;
use crate::lead::LEAD;
use crate::lists::Lists;
use crate::segments::Segments;
use crate::window::{check_window, rows};
use crate::{ClipInfo, Error, FeatureScale, MotionDatabase, Result, WindowIndex};

/// What is wrong with a file, in words.
type Found<T> = std::result::Result<T, String>;

pub fn open(bytes: Bytes) -> Result<IndexFile> {
    if cfg!(target_endian = "big") {
        return Err(wrong("a big-endian machine", 0, "a little-endian one"));
    }
    if bytes.len() < 12 || &bytes[..8] != MAGIC {
        return Err(wrong("other bytes", 0, "the letters MAREYMDB"));
    }
    let version = u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]]);
    if version != FORMAT_VERSION {
        return Err(Error::Version { found: version, expected: FORMAT_VERSION });
    }
    let Some(tail) = bytes.len().checked_sub(TAIL).filter(|tail| *tail >= HEAD) else {
        return Err(wrong(format!("{} bytes", bytes.len()), 0, "a whole file"));
    };
    if &bytes[bytes.len() - 8..] != END {
        return Err(wrong("other bytes", bytes.len() - 8, "the letters MAREYEND: the file was cut"));
    }
    let number = |at: usize| {
        let mut eight = [0; 8];
        eight.copy_from_slice(&bytes[at..at + 8]);
        usize::try_from(u64::from_le_bytes(eight)).unwrap_or(usize::MAX)
    };
    let (start, length) = (number(tail), number(tail + 8));
    if start < HEAD || start.checked_add(length) != Some(tail) {
        return Err(wrong(format!("a directory of {length} bytes at {start}"), tail, "one that ends here"));
    }
    let directory = &bytes[start..tail];
    let found = checksum(&bytes[..HEAD], directory, &bytes[tail..tail + 16]);
    let expected = &bytes[tail + 16..tail + 48];
    if found.as_bytes() != expected {
        let expected = expected.iter().map(|b| format!("{b:02x}")).collect();
        return Err(Error::Checksum {
            part: "directory".to_owned(),
            found: found.to_hex().to_string(),
            expected,
        });
    }
    let directory: Directory = serde_json::from_slice(directory)
        .map_err(|e| wrong(format!("a directory that does not parse ({e})"), start, "JSON"))?;
    let bytes_of = Parts { bytes: &bytes.slice(..start), sections: &directory.sections };
    let windows = directory.windows.as_ref();
    let parts = database(&directory, &bytes_of).and_then(|database| {
        let windows = windows.map(|record| self::windows(record, &database, &bytes_of)).transpose()?;
        Ok((database, windows))
    });
    let (database, windows) =
        parts.map_err(|found| wrong(found, start, "an index that agrees with itself"))?;
    Ok(IndexFile { sections: directory.sections, bytes, database, windows })
}

/// The sections of a file.
struct Parts<'a> {
    /// all before the directory
    bytes: &'a Bytes,
    sections: &'a [Section],
}

impl Parts<'_> {
    /// The `count` numbers of a section, which must be all of it.
    fn column<T: Pod>(&self, name: &str, count: Option<usize>) -> Found<Column<T>> {
        let section = self.sections.iter().find(|s| s.name == name);
        let section = section.ok_or_else(|| format!("no section {name}"))?;
        let expected = count.and_then(|count| count.checked_mul(size_of::<T>()));
        if expected != Some(section.bytes) {
            return Err(format!(
                "{} bytes of {name} for {count:?} times {} bytes",
                section.bytes,
                size_of::<T>()
            ));
        }
        let range = section.range();
        if section.offset < HEAD || !section.offset.is_multiple_of(HEAD) || range.end > self.bytes.len() {
            return Err(format!("section {name} at {} past the directory or askew", section.offset));
        }
        Ok(Column::shared(self.bytes.slice(range)))
    }
}

fn database(directory: &Directory, parts: &Parts<'_>) -> Found<MotionDatabase> {
    let skeleton = Skeleton::try_from(directory.skeleton.clone()).map_err(|e| e.to_string())?;
    let references = References {
        rotations: directory.reference_rotations.iter().copied().map(Matrix3::from).collect(),
        angles: directory.reference_angles.clone(),
    };
    let (rotations, angles) = (references.rotations.len(), references.angles.len());
    if rotations != skeleton.num_joints() || angles != skeleton.num_dofs() {
        return Err(format!("{rotations} reference rotations and {angles} angles for another skeleton"));
    }
    let leg_length = directory.leg_length_m;
    if !(leg_length.is_finite() && leg_length > 0.0) {
        return Err(format!("a leg length of {leg_length} m"));
    }
    let parametrisation = Parametrisation::smooth(&skeleton, &references).map_err(|e| e.to_string())?;
    let each = 6 * skeleton.num_joints();
    let proportions: Column<f64> = parts.column("proportions", directory.clips.len().checked_mul(each))?;
    let dofs = skeleton.num_dofs();
    let zero_poses: Column<f32> = parts.column("zero poses", directory.clips.len().checked_mul(dofs))?;
    let mut clips = Vec::with_capacity(directory.clips.len());
    let mut first_pose = 0usize;
    let per_clip = proportions.chunks_exact(each).zip(zero_poses.chunks_exact(dofs));
    for (clip, (proportions, zero_pose)) in directory.clips.iter().zip(per_clip) {
        let is_learned = zero_pose.iter().any(|o| *o != 0.0);
        clips.push(ClipInfo {
            name: clip.name.clone(),
            subject: clip.subject.clone(),
            action: clip.action.clone(),
            first_pose,
            num_poses: clip.num_poses,
            proportions: proportions.to_vec(),
            zero_pose: if is_learned { zero_pose.to_vec() } else { Vec::new() },
        });
        first_pose = first_pose.saturating_add(clip.num_poses);
        if first_pose > MAX_POSES {
            return Err(format!("more than {MAX_POSES} poses"));
        }
    }
    let coordinates = parts.column("poses", Some(first_pose * skeleton.num_dofs()))?;
    Ok(MotionDatabase {
        skeleton: skeleton.into(),
        references,
        parametrisation,
        leg_length,
        clips,
        coordinates,
    })
}

fn windows(record: &WindowsRecord, database: &MotionDatabase, parts: &Parts<'_>) -> Found<WindowIndex> {
    let window = record.frames;
    check_window(database, window).map_err(|e| e.to_string())?;
    let width = window * database.num_dofs();
    let (targets, clip_rows) = rows(database, window);
    let dims = PREFIX.min(width);
    let prefix = parts.column("prefix", Some(Blocks::numbers(targets.len(), dims)))?;
    Ok(WindowIndex {
        window,
        scale: FeatureScale::from_database(database),
        mean: parts.column("mean", Some(width))?.to_vec(),
        axes: parts.column("axes", Some(width * width))?.to_vec(),
        prefix: Blocks::from_column(dims, prefix),
        features: parts.column("features", Some(targets.len() * width))?,
        segments: record
            .segments
            .as_ref()
            .map(|record| segments(record, targets.len(), width, parts))
            .transpose()?,
        targets,
        clip_rows,
    })
}

fn segments(record: &SegmentsRecord, rows: usize, width: usize, parts: &Parts<'_>) -> Found<Segments> {
    let &SegmentsRecord { count, lists, scale, mean_energy } = record;
    if count == 0 || count > rows || lists == 0 || lists > count {
        return Err(format!("{count} segments in {lists} lists for {rows} rows"));
    }
    if !(scale.is_finite() && scale > 0.0 && mean_energy.is_finite() && mean_energy >= 0.0) {
        return Err(format!("a scale of {scale} and a mean energy of {mean_energy}"));
    }
    let starts: Column<u32> = parts.column("starts", Some(lists + 1))?;
    if starts[0] != 0 || starts[lists] as usize != count || !starts.is_sorted() {
        return Err(format!("lists that do not hold {count} segments"));
    }
    Ok(Segments {
        scale,
        mean_energy,
        lead: parts.column("lead", Some(count))?,
        tail: parts.column("tail", Some(count * width.saturating_sub(LEAD)))?,
        energy: parts.column("energy", Some(count))?,
        radius: parts.column("radius", Some(count))?,
        first: parts.column("first", Some(count))?,
        length: parts.column("length", Some(count))?,
        by_row: parts.column("of-row", Some(rows))?,
        graph: parts.column("graph", Some(count * DEGREE))?,
        lists: Lists { centroids: parts.column("centroids", Some(lists))?, starts },
    })
}
