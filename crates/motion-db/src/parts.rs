//! Databases made of parts: clips that were read by different jobs, or lie in different shards, in the same coordinates.

use crate::build::{MIN_FRAMES, structure_mismatch};
use crate::{Clip, ClipInfo, Error, MotionDatabase, Result};

impl MotionDatabase {
    /// A database in the coordinates of this one (skeleton, references, leg length) that holds no clip yet.
    pub fn emptied(&self) -> Self {
        Self {
            skeleton: self.skeleton.clone(),
            references: self.references.clone(),
            parametrisation: self.parametrisation.clone(),
            leg_length: self.leg_length,
            clips: Vec::new(),
            coordinates: Vec::new().into(),
        }
    }

    /// Adds a clip in the coordinates of this database; gives the number of its poses, 0 if it is shorter than 8 frames
    /// and was left out.
    ///
    /// # Errors
    /// If the clip's skeleton has another structure, or there are too many poses.
    pub fn append(&mut self, clip: &Clip) -> Result<usize> {
        structure_mismatch(clip, &self.skeleton, "of the database")?;
        let before = self.num_poses();
        self.add(clip)?;
        Ok(self.num_poses() - before)
    }

    /// Adds clip number `clip` of a database in the same coordinates, under the name `name`. Its performer's zero pose is
    /// another one among other performers: [`Self::learn_zero_poses`] when all clips are there.
    ///
    /// # Errors
    /// If the coordinates are others, or there are too many poses.
    pub fn append_from(&mut self, other: &Self, clip: usize, name: &str) -> Result<()> {
        if !self.has_same_coordinates_as(other) {
            return Err(Error::OtherCoordinates);
        }
        let mut info = other.clips[clip].clone();
        let first_pose = self.num_poses();
        self.check_size(first_pose + info.num_poses)?;
        let dofs = self.num_dofs();
        let poses = info.first_pose * dofs..(info.first_pose + info.num_poses) * dofs;
        self.coordinates.to_mut().extend_from_slice(&other.coordinates[poses]);
        info.first_pose = first_pose;
        info.name = name.to_owned();
        info.zero_pose.clear();
        self.clips.push(info);
        Ok(())
    }

    /// This database without some of its clips, in the same coordinates. Zero poses are learned anew: nothing in it knows of
    /// what was left out.
    ///
    /// # Errors
    /// [`Error::NoMotion`] if no clip is left.
    pub fn without(&self, is_left_out: impl Fn(&ClipInfo) -> bool) -> Result<Self> {
        let mut rest = self.emptied();
        for (c, info) in self.clips.iter().enumerate().filter(|(_, info)| !is_left_out(info)) {
            rest.append_from(self, c, &info.name)?;
        }
        if rest.clips.is_empty() {
            return Err(Error::NoMotion { min_frames: MIN_FRAMES });
        }
        rest.learn_zero_poses();
        Ok(rest)
    }

    /// Whether the same numbers mean the same pose in both.
    pub fn has_same_coordinates_as(&self, other: &Self) -> bool {
        self.skeleton == other.skeleton
            && self.references == other.references
            && self.leg_length == other.leg_length
    }
}
