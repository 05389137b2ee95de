use std::io::Write;

use model::SkeletonRecord;

use super::FORMAT_VERSION;
use super::layout::{
    ClipRecord, Directory, END, HEAD, MAGIC, Section, SegmentsRecord, WindowsRecord, checksum,
};
use crate::segments::Segments;
use crate::{Error, MotionDatabase, Result, Threads, WindowIndex};

/// Writes the index file of a database to `out`, front to back, with its windows of `window` frames if any are asked for;
/// gives the number of bytes.
///
/// The windows, which are the largest part, are worked out and written a few thousand at a time: beside the database
/// itself this takes about 500 bytes of memory a pose. Equal databases give equal bytes, whatever the threads.
///
/// # Errors
/// [`Error::Window`] if the window does not fit the database, [`Error::Write`] if `out` fails.
pub fn write_index(
    database: &MotionDatabase,
    window: Option<usize>,
    threads: &impl Threads,
    out: &mut dyn Write,
) -> Result<u64> {
    if let Some(window) = window {
        crate::window::check_window(database, window)?;
    }
    let mut out = Sections::begin(out)?;
    out.section("poses", database.coordinates.as_bytes())?;
    let proportions: Vec<f64> = database.clips.iter().flat_map(|c| c.proportions.iter().copied()).collect();
    out.section("proportions", bytemuck::cast_slice(&proportions))?;
    let zeros = vec![0.0f32; database.num_dofs()];
    let zero_pose =
        |c: &'_ crate::ClipInfo| if c.zero_pose.is_empty() { zeros.clone() } else { c.zero_pose.clone() };
    let zero_poses: Vec<f32> = database.clips.iter().flat_map(zero_pose).collect();
    out.section("zero poses", bytemuck::cast_slice(&zero_poses))?;
    let windows = match window {
        Some(window) => Some(write_windows(database, window, threads, &mut out)?),
        None => None,
    };
    let directory = Directory {
        skeleton: SkeletonRecord::from(database.skeleton.as_ref()),
        reference_rotations: database.references.rotations.iter().map(|m| (*m).into()).collect(),
        reference_angles: database.references.angles.clone(),
        leg_length_m: database.leg_length,
        clips: database
            .clips
            .iter()
            .map(|c| ClipRecord {
                name: c.name.clone(),
                subject: c.subject.clone(),
                action: c.action.clone(),
                num_poses: c.num_poses,
            })
            .collect(),
        windows,
        sections: std::mem::take(&mut out.done),
    };
    out.end(&directory)
}

fn write_windows(
    database: &MotionDatabase,
    window: usize,
    threads: &impl Threads,
    out: &mut Sections<'_>,
) -> Result<WindowsRecord> {
    let start = out.start()?;
    let mut hasher = blake3::Hasher::new();
    let index = WindowIndex::without_features(database, window, threads, &mut |rows| {
        let bytes = bytemuck::cast_slice(rows);
        hasher.update(bytes);
        out.put(bytes)
    })?;
    out.finish("features", start, &hasher.finalize());
    out.section("mean", bytemuck::cast_slice(&index.mean))?;
    out.section("axes", bytemuck::cast_slice(&index.axes))?;
    out.section("prefix", index.prefix.as_bytes())?;
    let segments = index.segments.as_ref().map(|s| write_segments(s, out)).transpose()?;
    Ok(WindowsRecord { frames: window, segments })
}

fn write_segments(segments: &Segments, out: &mut Sections<'_>) -> Result<SegmentsRecord> {
    out.section("lead", segments.lead.as_bytes())?;
    out.section("tail", segments.tail.as_bytes())?;
    out.section("energy", segments.energy.as_bytes())?;
    out.section("radius", segments.radius.as_bytes())?;
    out.section("first", segments.first.as_bytes())?;
    out.section("length", segments.length.as_bytes())?;
    out.section("of-row", segments.by_row.as_bytes())?;
    out.section("graph", segments.graph.as_bytes())?;
    out.section("centroids", segments.lists.centroids.as_bytes())?;
    out.section("starts", segments.lists.starts.as_bytes())?;
    Ok(SegmentsRecord {
        count: segments.len(),
        lists: segments.lists.len(),
        scale: segments.scale,
        mean_energy: segments.mean_energy,
    })
}

/// A file that grows section by section.
struct Sections<'o> {
    out: &'o mut dyn Write,
    head: [u8; HEAD],
    at: usize,
    done: Vec<Section>,
}

impl<'o> Sections<'o> {
    fn begin(out: &'o mut dyn Write) -> Result<Self> {
        let mut head = [0; HEAD];
        head[..8].copy_from_slice(MAGIC);
        head[8..12].copy_from_slice(&FORMAT_VERSION.to_le_bytes());
        let mut sections = Self { out, head, at: 0, done: Vec::new() };
        sections.put(&head)?;
        Ok(sections)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Error::Write { reason: e.to_string() })?;
        self.at += bytes.len();
        Ok(())
    }

    /// Fills up to where the next section begins.
    fn start(&mut self) -> Result<usize> {
        let padding = self.at.next_multiple_of(HEAD) - self.at;
        self.put(&[0; HEAD][..padding])?;
        Ok(self.at)
    }

    fn finish(&mut self, name: &str, start: usize, hash: &blake3::Hash) {
        let blake3 = hash.to_hex().to_string();
        self.done.push(Section { name: name.to_owned(), offset: start, bytes: self.at - start, blake3 });
    }

    fn section(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        let start = self.start()?;
        self.put(bytes)?;
        self.finish(name, start, &blake3::hash(bytes));
        Ok(())
    }

    fn end(mut self, directory: &Directory) -> Result<u64> {
        let directory = serde_json::to_vec(directory).map_err(|e| Error::Write { reason: e.to_string() })?;
        let start = self.start()?;
        self.put(&directory)?;
        let mut place = [0; 16];
        place[..8].copy_from_slice(&(start as u64).to_le_bytes());
        place[8..].copy_from_slice(&(directory.len() as u64).to_le_bytes());
        let checksum = checksum(&self.head, &directory, &place);
        self.put(&place)?;
        self.put(checksum.as_bytes())?;
        self.put(END)?;
        self.out.flush().map_err(|e| Error::Write { reason: e.to_string() })?;
        Ok(self.at as u64)
    }
}
