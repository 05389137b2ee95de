use model::Silhouette;

/// Which neighbours belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Neighbours {
    /// those above, below, left and right
    Four,
    /// the diagonal ones as well
    Eight,
}

/// A connected region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Region {
    /// pixels
    pub area: usize,
    /// left, top, and right and bottom just outside
    pub bounds: [usize; 4],
}

#[derive(Debug, Clone, Copy)]
struct Run {
    y: u32,
    start: u32,
    end: u32,
    label: u32,
}

/// Connected regions of a silhouette: union–find over the runs of its rows. Keeps its memory from frame to frame.
#[derive(Debug, Clone, Default)]
pub struct Components {
    runs: Vec<Run>,
    parents: Vec<u32>,
    regions: Vec<Region>,
}

impl Components {
    /// Finds the regions of the pixels that are `kind`: true for the person, false for all else.
    pub fn find(&mut self, silhouette: &Silhouette, kind: bool, neighbours: Neighbours) {
        self.runs.clear();
        self.parents.clear();
        self.regions.clear();
        let reach = u32::from(neighbours == Neighbours::Eight);
        let mut previous = 0..0;
        for y in 0..silhouette.height() {
            let first = self.runs.len();
            self.runs_of_row(silhouette, y, kind);
            let mut above = previous.start;
            for current in first..self.runs.len() {
                let run = self.runs[current];
                while above < previous.end && self.runs[above].end + reach <= run.start {
                    above += 1;
                }
                let mut touching = above;
                while touching < previous.end && self.runs[touching].start < run.end + reach {
                    self.join(touching as u32, current as u32);
                    touching += 1;
                }
            }
            previous = first..self.runs.len();
        }
        self.collect();
    }

    /// The regions, in the order of their first pixels.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// Sets (or clears) the pixels of the regions that `is_wanted` says, by index.
    pub fn draw(&self, to: &mut Silhouette, is_person: bool, is_wanted: impl Fn(usize) -> bool) {
        for run in self.runs.iter().filter(|run| is_wanted(run.label as usize)) {
            fill(to.row_mut(run.y as usize), run.start as usize, run.end as usize, is_person);
        }
    }

    /// Calls `count(region, pixels)` for each run of `other` pixels within a region: how much they share.
    pub fn overlaps(&self, other: &Silhouette, mut count: impl FnMut(usize, usize)) {
        for run in &self.runs {
            let pixels = ones(other.row(run.y as usize), run.start as usize, run.end as usize);
            if pixels > 0 {
                count(run.label as usize, pixels);
            }
        }
    }

    /// Calls `with(region, x, y)` for every pixel of the regions.
    pub fn each_pixel(&self, mut with: impl FnMut(usize, usize, usize)) {
        for run in &self.runs {
            (run.start..run.end).for_each(|x| with(run.label as usize, x as usize, run.y as usize));
        }
    }

    fn runs_of_row(&mut self, silhouette: &Silhouette, y: usize, kind: bool) {
        let (row, width) = (silhouette.row(y), silhouette.width());
        let mut x = next(row, 0, width, kind);
        while x < width {
            let end = next(row, x, width, !kind);
            let label = self.runs.len() as u32;
            self.runs.push(Run { y: y as u32, start: x as u32, end: end as u32, label });
            self.parents.push(label);
            x = next(row, end, width, kind);
        }
    }

    fn root(&mut self, mut label: u32) -> u32 {
        while self.parents[label as usize] != label {
            let above = self.parents[self.parents[label as usize] as usize];
            self.parents[label as usize] = above;
            label = above;
        }
        label
    }

    /// The smaller label is the root, so that roots come first in order.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// Gives the regions numbers from 0 and sums them up.
    fn collect(&mut self) {
        for index in 0..self.runs.len() {
            let root = self.root(index as u32) as usize;
            let run = self.runs[index];
            let bounds = [run.start as usize, run.y as usize, run.end as usize, run.y as usize + 1];
            let area = bounds[2] - bounds[0];
            let label = if root == index {
                self.regions.push(Region { area, bounds });
                self.regions.len() - 1
            } else {
                // the root came earlier and has its number
                let label = self.runs[root].label as usize;
                let region = &mut self.regions[label];
                let [left, top, right, bottom] = region.bounds;
                region.area += area;
                region.bounds =
                    [left.min(bounds[0]), top.min(bounds[1]), right.max(bounds[2]), bottom.max(bounds[3])];
                label
            };
            self.runs[index].label = label as u32;
        }
    }
}

/// The first pixel of this kind from `from` on, or `width`.
fn next(row: &[u64], from: usize, width: usize, kind: bool) -> usize {
    let mut index = from / 64;
    let mut shift = from % 64;
    while index * 64 < width {
        let word = if kind { row[index] } else { !row[index] } >> shift << shift;
        if word != 0 {
            return (index * 64 + word.trailing_zeros() as usize).min(width);
        }
        index += 1;
        shift = 0;
    }
    width
}

/// Calls `with(word, mask)` for the words of the pixels from `start` up to `end`.
fn words(start: usize, end: usize, mut with: impl FnMut(usize, u64)) {
    for index in start / 64..end.div_ceil(64) {
        let low = start.saturating_sub(index * 64);
        let high = (end - index * 64).min(64);
        with(index, (u64::MAX >> (64 - (high - low))) << low);
    }
}

fn fill(row: &mut [u64], start: usize, end: usize, is_person: bool) {
    words(start, end, |index, mask| if is_person { row[index] |= mask } else { row[index] &= !mask });
}

fn ones(row: &[u64], start: usize, end: usize) -> usize {
    let mut count = 0;
    words(start, end, |index, mask| count += (row[index] & mask).count_ones() as usize);
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(lines: &[&str]) -> Silhouette {
        let pixels: Vec<u8> = lines.iter().flat_map(|line| line.bytes()).collect();
        Silhouette::from_pixels(lines[0].len(), lines.len(), &pixels, |pixel| pixel == b'#').unwrap()
    }

    fn areas(silhouette: &Silhouette, kind: bool, neighbours: Neighbours) -> Vec<usize> {
        let mut components = Components::default();
        components.find(silhouette, kind, neighbours);
        components.regions().iter().map(|region| region.area).collect()
    }

    #[test]
    fn arms_that_meet_below_are_one_region() {
        let silhouette = drawn(&["#..#..#", "#..#..#", "####..#", "......#"]);
        assert_eq!(areas(&silhouette, true, Neighbours::Four), [8, 4]);
        let mut components = Components::default();
        components.find(&silhouette, true, Neighbours::Four);
        assert_eq!(components.regions()[0].bounds, [0, 0, 4, 3]);
        let mut second = Silhouette::empty(7, 4);
        components.draw(&mut second, true, |region| region == 1);
        assert_eq!((second.area(), second.bounds()), (4, Some([6, 0, 7, 4])));
    }

    #[test]
    fn diagonal_neighbours_belong_together_only_if_asked() {
        let silhouette = drawn(&["#.#", ".#.", "#.#"]);
        assert_eq!(areas(&silhouette, true, Neighbours::Eight), [5]);
        assert_eq!(areas(&silhouette, true, Neighbours::Four), [1; 5]);
        assert_eq!(areas(&silhouette, false, Neighbours::Four), [1; 4]);
    }

    #[test]
    fn wide_pictures_agree_with_a_flood_fill() {
        let (width, height) = (197, 60);
        let pixels: Vec<u32> =
            (0..width * height).map(|i| (i as u32).wrapping_mul(2_654_435_761) >> 29).collect();
        let silhouette = Silhouette::from_pixels(width, height, &pixels, |pixel| pixel > 2).unwrap();
        for (kind, neighbours) in [(true, Neighbours::Eight), (false, Neighbours::Four)] {
            let mut found = areas(&silhouette, kind, neighbours);
            let mut expected = Vec::new();
            let mut seen = vec![false; width * height];
            for start in 0..width * height {
                let mut stack = vec![start];
                let mut area = 0;
                while let Some(at) = stack.pop() {
                    let (x, y) = ((at % width) as isize, (at / width) as isize);
                    if seen[at] || silhouette.contains(x, y) != kind {
                        continue;
                    }
                    seen[at] = true;
                    area += 1;
                    for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                        let (u, v) = (x + dx, y + dy);
                        let near = neighbours == Neighbours::Eight || dx == 0 || dy == 0;
                        if near && (0..width as isize).contains(&u) && (0..height as isize).contains(&v) {
                            stack.push(v as usize * width + u as usize);
                        }
                    }
                }
                expected.extend((area > 0).then_some(area));
            }
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn shared_pixels_are_counted_by_region() {
        let silhouette = drawn(&["##..###", "##..###"]);
        let other = drawn(&[".....##", "#......"]);
        let mut components = Components::default();
        components.find(&silhouette, true, Neighbours::Eight);
        let mut shared = [0; 2];
        components.overlaps(&other, |region, pixels| shared[region] += pixels);
        assert_eq!(shared, [1, 2]);
    }
}
