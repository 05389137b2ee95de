use std::ops::Range;

/// A point of a foot that stands for a while.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contact {
    /// which, in the order of [`crate::Feet::points`]
    pub point: usize,
    /// frames in which it stands
    pub frames: Range<usize>,
}

/// All contacts of a motion.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Contacts {
    all: Vec<Contact>,
    num_frames: usize,
}

impl Contacts {
    /// `all`: by point and then by time.
    pub(crate) fn new(all: Vec<Contact>, num_frames: usize) -> Self {
        Self { all, num_frames }
    }

    /// The contacts, by point and then by time.
    pub fn all(&self) -> &[Contact] {
        &self.all
    }

    /// Number of frames of the motion.
    pub fn num_frames(&self) -> usize {
        self.num_frames
    }

    /// Whether left and right foot stand in each frame, with ankle or ball; shape `[frames]`.
    pub fn feet(&self) -> Vec<[bool; 2]> {
        let mut feet = vec![[false; 2]; self.num_frames];
        for contact in &self.all {
            for foot in &mut feet[contact.frames.clone()] {
                foot[contact.point / 2] = true;
            }
        }
        feet
    }

    /// Leaves out the contacts that `keep` does not want.
    pub fn retain(&mut self, keep: impl FnMut(&Contact) -> bool) {
        self.all.retain(keep);
    }
}
