//! Bodies found, drawn over what cameras saw.

use model::{Camera, Image, Silhouette};
use nalgebra::Vector3;
use shape_fit::{cleaned, draw_outline};
use vision::{Rasteriser, Topology, View};

const SEEN: [u8; 3] = [60, 140, 255];
const FOUND: [u8; 3] = [255, 140, 0];
const PERSON: u8 = 110;

/// The picture, or the silhouette in grey, with the outline of the cleaned silhouette in blue and of the body in orange.
pub fn overlay(picture: Option<Image>, silhouette: &Silhouette, body: &Silhouette) -> Image {
    let mut picture = picture.unwrap_or_else(|| grey(silhouette));
    draw_outline(&mut picture, &cleaned(silhouette), SEEN);
    draw_outline(&mut picture, body, FOUND);
    picture
}

/// A posed body as a camera sees it.
pub fn drawn(camera: &Camera, topology: &Topology, vertices: &[Vector3<f64>]) -> Silhouette {
    let mut silhouette = Silhouette::empty(0, 0);
    Rasteriser::new().silhouette(&View::new(camera), vertices, topology, &mut silhouette);
    silhouette
}

fn grey(silhouette: &Silhouette) -> Image {
    let mut picture = Image::black(silhouette.width(), silhouette.height());
    for y in 0..silhouette.height() {
        for x in 0..silhouette.width() {
            if silhouette.contains(x as isize, y as isize) {
                picture.set(x, y, [PERSON; 3]);
            }
        }
    }
    picture
}
