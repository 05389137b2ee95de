//! From pixels that are not background to one person: morphology, holes, and the choice of the region.
//!
//! The person is the largest region of a first frame. Later, among the regions that share at least `continuity` of the
//! last person's area, the one that shares most is: someone larger who walks in elsewhere doesn't take over. If no region
//! shares that much (the person jumped, or the clip is cut), it is the largest again. Regions nearer to it than
//! `join_distance` are pieces of the person (a dark belt may cut one in two), but no piece is as large as the person's
//! main region unless most of it was the person in the frame before: that would be a second one.

use model::Silhouette;

use crate::{
    CleaningParameters,
    classes::Classes,
    components::{Components, Neighbours, Region},
    morphology::Morphology,
};

/// Pieces larger than this share of the main region must have been the person before.
const LARGEST_NEW_PIECE: f64 = 0.5;

/// Share of a hole's pixels that are not plain background from which it may be the person.
const DOUBTFUL: f64 = 0.6;
/// Such holes are filled up to this share of the person's area.
const LARGEST_DOUBTFUL_HOLE: f64 = 0.1;

/// Makes silhouettes of one size; knows the last one.
#[derive(Debug, Clone)]
pub struct Cleaner {
    parameters: CleaningParameters,
    diagonal: f64,
    morphology: Morphology,
    components: Components,
    holes: Components,
    all: Silhouette,
    near: Silhouette,
    previous: Silhouette,
    shared: Vec<usize>,
    wanted: Vec<bool>,
}

/// What the cleaning saw.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cleaned {
    /// pixels of the person
    pub area: usize,
    /// pixels of the largest region that isn't the person
    pub other_area: usize,
    /// pixels of holes that were filled
    pub filled_area: usize,
    /// left, top, and right and bottom just outside; zeros if nobody is there
    pub bounds: [usize; 4],
}

impl Cleaner {
    /// For frames of `width` × `height` pixels.
    pub fn new(parameters: &CleaningParameters, width: usize, height: usize) -> Self {
        let empty = Silhouette::empty(width, height);
        Self {
            parameters: parameters.clone(),
            diagonal: (width as f64).hypot(height as f64),
            morphology: Morphology::new(width, height),
            components: Components::default(),
            holes: Components::default(),
            all: empty.clone(),
            near: empty.clone(),
            previous: empty,
            shared: Vec::new(),
            wanted: Vec::new(),
        }
    }

    /// The person of a frame, into `person`.
    pub fn clean(&mut self, classes: &Classes, person: &mut Silhouette) -> Cleaned {
        let parameters = &self.parameters;
        copy(&classes.foreground, &mut self.all);
        self.morphology.open(&mut self.all, parameters.opening);
        self.morphology.close(&mut self.all, parameters.closing);
        self.components.find(&self.all, true, Neighbours::Eight);
        clear(person);
        let Some(main) = self.main_region() else {
            clear(&mut self.previous);
            return Cleaned::default();
        };
        self.choose_pieces(main, person);
        clear(person);
        self.components.draw(person, true, |region| self.wanted[region]);
        let mut cleaned = Cleaned::default();
        for (region, wanted) in self.components.regions().iter().zip(&self.wanted) {
            if !wanted {
                cleaned.other_area = cleaned.other_area.max(region.area);
            }
        }
        cleaned.filled_area = self.fill_holes(classes, person);
        cleaned.area = person.area();
        cleaned.bounds = person.bounds().unwrap_or_default();
        copy(person, &mut self.previous);
        cleaned
    }

    /// What was not background, opened and closed, before the choice of regions.
    pub fn all(&self) -> &Silhouette {
        &self.all
    }

    fn main_region(&mut self) -> Option<usize> {
        let regions = self.components.regions();
        self.shared.clear();
        self.shared.resize(regions.len(), 0);
        self.components.overlaps(&self.previous, |region, pixels| self.shared[region] += pixels);
        let needed = self.parameters.continuity * self.previous.area() as f64;
        let largest = (0..regions.len()).rev().max_by_key(|&region| regions[region].area)?;
        let smallest = self.parameters.smallest_person * (self.all.width() * self.all.height()) as f64;
        let followed = (0..regions.len())
            .rev()
            .filter(|&region| self.shared[region] > 0 && self.shared[region] as f64 >= needed)
            .max_by_key(|&region| self.shared[region]);
        followed.into_iter().chain([largest]).find(|&region| regions[region].area as f64 >= smallest)
    }

    /// The main region and what is near it, twice: a piece may be near a piece. `near` is of use.
    fn choose_pieces(&mut self, main: usize, near: &mut Silhouette) {
        let steps = (self.parameters.join_distance * self.diagonal).round() as u32;
        let regions = self.components.regions();
        let main_area = regions[main].area as f64;
        self.wanted.clear();
        self.wanted.resize(regions.len(), false);
        self.wanted[main] = true;
        for _ in 0..if steps == 0 { 0 } else { 2 } {
            clear(&mut self.near);
            self.components.draw(&mut self.near, true, |region| self.wanted[region]);
            copy(&self.near, near);
            self.morphology.dilate(near, steps);
            let (shared, wanted) = (&self.shared, &mut self.wanted);
            self.components.overlaps(near, |region, _| {
                let area = regions[region].area as f64;
                let was_person = shared[region] as f64 > 0.5 * area;
                let is_piece = area >= self.parameters.smallest_piece * main_area
                    && (area <= LARGEST_NEW_PIECE * main_area || was_person);
                wanted[region] |= is_piece;
            });
        }
    }

    /// Fills what is enclosed and small, or enclosed and not plain background: skin before a wall is easily taken for a
    /// shadow. What is between arm and body stays open, where the background is seen.
    fn fill_holes(&mut self, classes: &Classes, person: &mut Silhouette) -> usize {
        let (width, height) = (person.width(), person.height());
        self.holes.find(person, false, Neighbours::Four);
        self.shared.clear();
        self.shared.resize(self.holes.regions().len(), 0);
        for class in [&classes.foreground, &classes.shadow, &classes.highlight] {
            self.holes.overlaps(class, |region, pixels| self.shared[region] += pixels);
        }
        let area = person.area() as f64;
        let is_hole = |region: usize| {
            let Region { area: hole, bounds: [left, top, right, bottom] } = self.holes.regions()[region];
            let is_enclosed = left > 0 && top > 0 && right < width && bottom < height;
            let is_doubtful = self.shared[region] as f64 >= DOUBTFUL * hole as f64;
            let limit = if is_doubtful { LARGEST_DOUBTFUL_HOLE } else { self.parameters.largest_hole };
            is_enclosed && hole as f64 <= limit * area
        };
        self.holes.draw(person, true, is_hole);
        (0..self.holes.regions().len()).filter(|&i| is_hole(i)).map(|i| self.holes.regions()[i].area).sum()
    }
}

/// Copies without taking memory.
pub(crate) fn copy(from: &Silhouette, to: &mut Silhouette) {
    (0..from.height()).for_each(|y| to.row_mut(y).copy_from_slice(from.row(y)));
}

fn clear(silhouette: &mut Silhouette) {
    (0..silhouette.height()).for_each(|y| silhouette.row_mut(y).fill(0));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classes(boxes: &[[usize; 4]]) -> Classes {
        let mut classes = Classes::new(300, 200);
        for &[left, top, right, bottom] in boxes {
            for y in top..bottom {
                (left..right).for_each(|x| classes.foreground.set(x, y, true));
            }
        }
        classes
    }

    fn cleaner() -> Cleaner {
        let parameters = CleaningParameters { largest_hole: 0.02, ..CleaningParameters::default() };
        Cleaner::new(&parameters, 300, 200)
    }

    #[test]
    fn the_person_of_the_frame_before_is_preferred_to_someone_larger() {
        let (mut cleaner, mut person) = (cleaner(), Silhouette::empty(300, 200));
        cleaner.clean(&classes(&[[40, 40, 80, 140]]), &mut person);
        let cleaned = cleaner.clean(&classes(&[[45, 40, 85, 140], [150, 20, 250, 190]]), &mut person);
        assert!(person.contains(60, 100) && !person.contains(200, 100));
        assert!(cleaned.other_area > cleaned.area);
        // gone for good: the other one is all there is
        cleaner.clean(&classes(&[[150, 20, 250, 190]]), &mut person);
        assert!(person.contains(200, 100));
    }

    #[test]
    fn a_person_cut_by_a_belt_is_one() {
        let (mut cleaner, mut person) = (cleaner(), Silhouette::empty(300, 200));
        cleaner.parameters.join_distance = 0.03;
        cleaner.clean(&classes(&[[40, 20, 80, 100], [40, 108, 80, 140], [200, 100, 220, 120]]), &mut person);
        assert_eq!(person.bounds(), Some([40, 20, 80, 140]));
    }

    #[test]
    fn small_holes_are_filled_and_large_ones_stay() {
        let (mut cleaner, mut person) = (cleaner(), Silhouette::empty(300, 200));
        let mut classes = classes(&[[40, 20, 140, 180]]);
        for (left, top, side) in [(60, 60, 10), (100, 100, 30)] {
            for (x, y) in (left..left + side).flat_map(|x| (top..top + side).map(move |y| (x, y))) {
                classes.foreground.set(x, y, false);
            }
        }
        let cleaned = cleaner.clean(&classes, &mut person);
        assert!(person.contains(65, 65) && !person.contains(115, 115));
        assert!((80..=100).contains(&cleaned.filled_area));
    }

    #[test]
    fn specks_are_nobody() {
        let (mut cleaner, mut person) = (cleaner(), Silhouette::empty(300, 200));
        assert_eq!(cleaner.clean(&classes(&[[40, 40, 42, 42], [100, 90, 106, 96]]), &mut person).area, 0);
        assert_eq!(person.bounds(), None);
    }
}
