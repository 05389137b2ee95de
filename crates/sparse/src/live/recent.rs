use motion_db::StartScan;
use nalgebra::Vector3;

/// Frames between two that a start is searched with.
const STEP: usize = 3;

/// What was measured over the last frames.
#[derive(Debug, Clone)]
pub(super) struct Recent {
    points: usize,
    frames: usize,
    /// a ring, shape `[frames, points]`
    positions: Vec<Vector3<f64>>,
    /// where the next frame goes
    next: usize,
    len: usize,
    /// frames pushed ever
    count: usize,
}

impl Recent {
    pub fn new(points: usize, frames: usize) -> Self {
        Self {
            points,
            frames,
            positions: vec![Vector3::repeat(f64::NAN); points * frames],
            next: 0,
            len: 0,
            count: 0,
        }
    }

    pub fn push(&mut self, positions: &[Vector3<f64>]) {
        self.positions[self.next * self.points..][..self.points].copy_from_slice(positions);
        self.next = (self.next + 1) % self.frames;
        self.len = (self.len + 1).min(self.frames);
        self.count += 1;
    }

    pub fn clear(&mut self) {
        (self.next, self.len) = (0, 0);
    }

    /// Number of frames that came, ever.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of frames, at most as many as there is room for.
    pub fn len(&self) -> usize {
        self.len
    }

    pub fn is_full(&self) -> bool {
        self.len == self.frames
    }

    /// Positions `age` frames ago, 0 being the newest; `age < len`.
    pub fn frame(&self, age: usize) -> &[Vector3<f64>] {
        let at = (self.next + self.frames - 1 - age) % self.frames;
        &self.positions[at * self.points..][..self.points]
    }

    /// Whether a frame has two measured points: fewer do not tell where the performer is.
    pub fn has_two(&self) -> bool {
        (0..self.len).any(|age| self.frame(age).iter().filter(|p| p.x.is_finite()).count() >= 2)
    }

    /// Gives a search every third frame, the newest among them, oldest first.
    pub fn observe(&self, scan: &mut StartScan) {
        let span = self.len.saturating_sub(1) / STEP * STEP;
        for age in (0..=span).rev().step_by(STEP).filter(|age| *age < self.len) {
            scan.observe(span - age, self.frame(age));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_frame_is_of_age_0_and_the_oldest_are_forgotten() {
        let mut recent = Recent::new(1, 4);
        for i in 0..6 {
            recent.push(&[Vector3::repeat(f64::from(i))]);
        }
        let ages: Vec<f64> = (0..recent.len()).map(|age| recent.frame(age)[0].x).collect();
        assert_eq!(ages, [5.0, 4.0, 3.0, 2.0]);
    }
}
