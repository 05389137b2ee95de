use model::{Image, Silhouette};
use vision::{ContourOptions, contours};

/// Draws the outline of a silhouette onto a picture, two pixels wide; what lies outside the picture is left out.
pub fn draw_outline(picture: &mut Image, silhouette: &Silhouette, colour: [u8; 3]) {
    let options = ContourOptions { smoothing: 1.0, step: 0.5, min_length: 8.0 };
    let (width, height) = (picture.width() as f64, picture.height() as f64);
    for contour in contours(silhouette, &options) {
        for point in &contour.points {
            for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let (x, y) = ((point.pixel.x + dx).floor(), (point.pixel.y + dy).floor());
                if x >= 0.0 && y >= 0.0 && x < width && y < height {
                    picture.set(x as usize, y as usize, colour);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_outline_is_drawn() {
        let mut silhouette = Silhouette::empty(80, 60);
        (20..40).for_each(|y| (30..60).for_each(|x| silhouette.set(x, y, true)));
        let mut picture = Image::black(80, 60);
        draw_outline(&mut picture, &silhouette, [255, 0, 0]);
        assert_eq!(picture.pixel(45, 30), [0, 0, 0]);
        assert_eq!(picture.pixel(10, 30), [0, 0, 0]);
        assert!(picture.pixel(45, 19) == [255, 0, 0] || picture.pixel(45, 20) == [255, 0, 0]);
    }
}
