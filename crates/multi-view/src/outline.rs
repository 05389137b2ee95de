use model::{Image, Silhouette};

/// Draws the outline of a silhouette over a picture: every pixel within `width` pixels of the border between inside and
/// outside, in a colour.
///
/// # Panics
/// If picture and silhouette are of different sizes.
pub fn draw_outline(picture: &mut Image, silhouette: &Silhouette, colour: [u8; 3], width: usize) {
    assert_eq!(
        (picture.width(), picture.height()),
        (silhouette.width(), silhouette.height()),
        "sizes of picture and silhouette"
    );
    let Some([left, top, right, bottom]) = silhouette.bounds() else { return };
    let reach = width.div_ceil(2) as isize;
    for y in top..bottom {
        for x in left..right {
            let (x, y) = (x as isize, y as isize);
            let is_edge = silhouette.contains(x, y)
                && [(1, 0), (-1, 0), (0, 1), (0, -1)]
                    .iter()
                    .any(|(dx, dy)| !silhouette.contains(x + dx, y + dy));
            if !is_edge {
                continue;
            }
            for (dx, dy) in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| (dx, dy))) {
                if let (Ok(x), Ok(y)) = (usize::try_from(x + dx), usize::try_from(y + dy))
                    && dx * dx + dy * dy <= reach * reach
                {
                    picture.set(x, y, colour);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_is_drawn_and_nothing_else() {
        let mut silhouette = Silhouette::empty(64, 48);
        (10..30).flat_map(|y| (20..40).map(move |x| (x, y))).for_each(|(x, y)| silhouette.set(x, y, true));
        let mut picture = Image::black(64, 48);
        draw_outline(&mut picture, &silhouette, [255, 0, 0], 1);
        assert_eq!(picture.pixel(20, 15), [255, 0, 0]);
        assert_eq!(picture.pixel(30, 20), [0, 0, 0], "inside");
        assert_eq!(picture.pixel(50, 20), [0, 0, 0], "outside");
    }
}
