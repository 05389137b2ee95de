//! What one camera saw, made ready once and used by every step.

use model::{Camera, Silhouette};
use nalgebra::Vector2;
use vision::{ContourOptions, Observed, View, contours, reduced, reduced_pixel};

use crate::{Error, Result, cleaned};

/// Height of the person at the resolutions of scoring starts, of coarse and of fine fitting, pixels of the view.
const HEIGHTS_PX: [f64; 3] = [80.0, 200.0, 400.0];
/// Distance between the points of an outline as a share of the person's height.
const STEPS: [f64; 2] = [0.014, 0.007];
/// A silhouette of a smaller share of the image shows nobody.
const LEAST_AREA: f64 = 1e-4;

/// One camera's view of the person.
#[derive(Debug, Clone)]
pub struct Observation {
    /// the camera
    pub camera: Camera,
    /// cleaned, at the camera's resolution
    pub silhouette: Silhouette,
    /// the coarsest view, and the silhouette in it
    pub scoring: (View, Observed),
    /// coarse and fine
    pub levels: [Level; 2],
    /// share of the outline that is the image's border
    pub cut: f64,
    /// regions of the silhouette: area of the second as a share of the largest
    pub second_region: f64,
}

/// The contours at one resolution.
#[derive(Debug, Clone)]
pub struct Level {
    /// the camera at that resolution
    pub view: View,
    /// what it saw
    pub outline: Outline,
}

/// Points of the contours of a silhouette, pixels of a view, at equal distances.
#[derive(Debug, Clone, Default)]
pub struct Outline {
    /// shape `[points]`
    pub pixels: Vec<Vector2<f64>>,
    /// away from the person, unit vectors
    pub normals: Vec<Vector2<f64>>,
    /// length that a point stands for, pixels of the view
    pub step_px: f64,
}

impl Observation {
    /// Cleans and measures a silhouette; `None` if nobody is in it.
    ///
    /// # Errors
    /// [`Error::Camera`], or [`Error::Size`] if silhouette and camera don't go together.
    pub fn new(camera: &Camera, silhouette: &Silhouette) -> Result<Option<Self>> {
        camera.check()?;
        let found = [silhouette.width(), silhouette.height()];
        let expected = camera.size.map(|side| side as usize);
        if found != expected {
            return Err(Error::Size { camera: camera.name.clone(), found, expected });
        }
        let silhouette = cleaned(silhouette);
        let Some([_, top, _, bottom]) = silhouette.bounds() else { return Ok(None) };
        if (silhouette.area() as f64) < LEAST_AREA * (found[0] * found[1]) as f64 {
            return Ok(None);
        }
        let height = (bottom - top) as f64;
        let scale = |wanted: f64| ((height / wanted).round() as usize).max(1);
        let levels = [0, 1].map(|i| {
            let step = (STEPS[i] * height).max(1.0);
            Level::new(camera, &silhouette, scale(HEIGHTS_PX[i + 1]), step)
        });
        let coarsest = scale(HEIGHTS_PX[0]);
        let scoring = (View::reduced(camera, coarsest), Observed::new(reduced(&silhouette, coarsest)));
        let border = contours(&silhouette, &ContourOptions::default());
        let points = border.iter().flat_map(|contour| &contour.points);
        let (all, cut) = points.fold((0, 0), |(all, cut), p| (all + 1, cut + usize::from(p.is_border)));
        let cut = cut as f64 / all.max(1) as f64;
        let second_region = second_region(&silhouette);
        Ok(Some(Self { camera: camera.clone(), silhouette, scoring, levels, cut, second_region }))
    }
}

impl Level {
    /// `step`: distance between points, pixels of the image.
    fn new(camera: &Camera, silhouette: &Silhouette, scale: usize, step: f64) -> Self {
        let options = ContourOptions { step, ..ContourOptions::default() };
        let mut outline = Outline { step_px: step / scale as f64, ..Outline::default() };
        for contour in contours(silhouette, &options) {
            for point in contour.points.iter().filter(|point| !point.is_border) {
                outline.pixels.push(reduced_pixel(point.pixel, scale));
                outline.normals.push(point.normal);
            }
        }
        Self { view: View::reduced(camera, scale), outline }
    }
}

fn second_region(silhouette: &Silhouette) -> f64 {
    let mut regions = background::Components::default();
    regions.find(silhouette, true, background::Neighbours::Eight);
    let mut areas: Vec<usize> = regions.regions().iter().map(|region| region.area).collect();
    areas.sort_unstable_by(|a, b| b.cmp(a));
    match areas[..] {
        [first, second, ..] => second as f64 / first as f64,
        _ => 0.0,
    }
}
