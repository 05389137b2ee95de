//! A motion as a strip of stick figures, drawn in the dots of Braille characters.

use evaluation::bones;
use model::Motion;
use nalgebra::Vector3;

/// Figures side by side.
const FIGURES: usize = 7;
/// Those who go less far than this are seen along the z axis, metres.
const STANDING_M: f64 = 0.1;
/// Dots of a character: across, and down.
const CELL: (usize, usize) = (2, 4);
/// Bit of each dot of a character after U+2800, by row and column.
const BITS: [[u32; 2]; 4] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// Dots that are set or not.
struct Dots {
    width: usize,
    /// row-major, the top first, shape `[height][width]`
    set: Vec<bool>,
}

impl Dots {
    fn new(columns: usize, lines: usize) -> Self {
        let width = columns * CELL.0;
        Self { width, set: vec![false; width * lines * CELL.1] }
    }

    fn height(&self) -> usize {
        self.set.len() / self.width
    }

    /// A straight line between two places, in dots to the right and down; what is beside the picture is left out.
    fn line(&mut self, from: (f64, f64), to: (f64, f64)) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
        for step in 0..=steps as usize {
            let share = step as f64 / steps;
            let x = (from.0 + (to.0 - from.0) * share).round();
            let y = (from.1 + (to.1 - from.1) * share).round();
            if x >= 0.0 && y >= 0.0 && (x as usize) < self.width && (y as usize) < self.height() {
                self.set[y as usize * self.width + x as usize] = true;
            }
        }
    }

    fn text(&self) -> String {
        let mut out = String::new();
        for line in (0..self.height()).step_by(CELL.1) {
            let character = |column: usize| {
                let is_set = |row: usize, beside: usize| {
                    self.set[(line + row) * self.width + column * CELL.0 + beside]
                };
                let bits = (0..CELL.1).flat_map(|row| (0..CELL.0).map(move |beside| (row, beside)));
                let set = bits.filter(|(row, beside)| is_set(*row, *beside));
                let code = set.fold(0x2800, |code, (row, beside)| code | BITS[row][beside]);
                char::from_u32(code).unwrap_or(' ')
            };
            let text: String = (0..self.width / CELL.0).map(character).collect();
            out.push_str(text.trim_end_matches('\u{2800}'));
            out.push('\n');
        }
        out
    }
}

/// The motion from the side, in seven moments from the first frame to the last, `columns` characters wide and `lines` high.
pub fn strip(motion: &Motion, columns: usize, lines: usize) -> String {
    let last = motion.num_frames().saturating_sub(1);
    let figures: Vec<_> = (0..FIGURES).map(|i| bones(motion, i * last / (FIGURES - 1))).collect();
    let root =
        |figure: &[(Vector3<f64>, Vector3<f64>)]| figure.first().map_or(Vector3::zeros(), |bone| bone.0);
    let mut way = root(&figures[FIGURES - 1]) - root(&figures[0]);
    way.y = 0.0;
    let along = if way.norm() < STANDING_M { Vector3::x() } else { way.normalize() };
    let ends = || figures.iter().flatten().flat_map(|(from, to)| [from.y, to.y]);
    let (floor, top) = (ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max));

    let mut dots = Dots::new(columns, lines);
    let dots_per_metre = (dots.height() - 1) as f64 / (top - floor).max(0.1);
    for (index, figure) in figures.iter().enumerate() {
        let middle = (index as f64 + 0.5) * dots.width as f64 / FIGURES as f64;
        let project = |point: &Vector3<f64>| {
            let x = middle + (point - root(figure)).dot(&along) * dots_per_metre;
            (x, (top - point.y) * dots_per_metre)
        };
        for (from, to) in figure {
            dots.line(project(from), project(to));
        }
    }
    dots.text()
}

#[cfg(test)]
mod tests {
    use sample_motion::{Action, DrawOptions, Model};

    use super::*;

    #[test]
    fn a_line_sets_the_dots_of_its_characters() {
        let mut dots = Dots::new(2, 1);
        dots.line((0.0, 0.0), (3.0, 3.0));
        assert_eq!(dots.text(), "\u{2811}\u{2884}\n");
        let mut dots = Dots::new(2, 2);
        dots.line((0.0, -3.0), (0.0, 30.0));
        assert_eq!(dots.text(), "\u{2847}\n\u{2847}\n");
    }

    #[test]
    fn people_stand_from_the_lowest_line_to_the_highest() {
        for action in Action::ALL {
            let motion = Model::bundled().draw(action, 7, &DrawOptions { frames: 120, subject: 1 }).unwrap();
            let text = strip(&motion, 98, 10);
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!(lines.len(), 10);
            assert!(lines.iter().all(|line| !line.is_empty() && line.chars().count() <= 98), "{text}");
        }
    }
}
