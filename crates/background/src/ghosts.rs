use model::{Image, Silhouette};

use crate::{
    components::{Components, Neighbours},
    grey::Grey,
    morphology::Morphology,
};

/// Smallest ghost, share of the picture.
const SMALLEST: f64 = 0.001;

/// Where the plate shows what the clip never does: someone in it, or a thing moved since. A region that differs from the
/// still parts of the clip belongs to the plate if its outline is an edge of the plate, and to the clip if it is one there.
pub(crate) fn ghosts(
    plate: &Image,
    median: &Image,
    differing: &Silhouette,
    still: &Silhouette,
) -> Silhouette {
    let (width, height) = (plate.width(), plate.height());
    let mut morphology = Morphology::new(width, height);
    let mut regions = differing.clone();
    for y in 0..height {
        regions.row_mut(y).iter_mut().zip(still.row(y)).for_each(|(word, still)| *word &= still);
    }
    morphology.open(&mut regions, 2);
    morphology.close(&mut regions, 4);
    // the rim: two pixels to either side of the outline
    let (mut rim, mut inside) = (regions.clone(), regions.clone());
    morphology.dilate(&mut rim, 2);
    morphology.erode(&mut inside, 2);
    let mut labels = Components::default();
    labels.find(&rim, true, Neighbours::Eight);
    let greys = [Grey::new(plate), Grey::new(median)];
    let mut strengths = vec![[0i64; 2]; labels.regions().len()];
    labels.each_pixel(|region, x, y| {
        let on_rim = !inside.contains(x as isize, y as isize);
        if on_rim {
            for (grey, strength) in greys.iter().zip(&mut strengths[region]) {
                *strength += i64::from(grey.slope(x, y));
            }
        }
    });
    let smallest = (SMALLEST * (width * height) as f64) as usize;
    let mut ghosts = Silhouette::empty(width, height);
    labels.draw(&mut ghosts, true, |region| {
        let [from_plate, from_clip] = strengths[region];
        labels.regions()[region].area >= smallest && from_plate * 4 > from_clip * 5
    });
    ghosts
}
