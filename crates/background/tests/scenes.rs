//! Generated scenes whose truth is known: a person of several colours walks before a textured wall, with noise, changing
//! light, a cast shadow, a waving curtain, a second person.

use background::{Advice, CameraQuality, ModelKind, Parameters, Segmenter};
use model::{Image, Silhouette};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const FRAMES: usize = 40;

#[derive(Clone, Copy)]
struct Scene {
    /// standard deviation of the noise, grey levels
    noise: f64,
    /// how much the light changes, share; slowly, red more than blue
    drift: f64,
    has_shadow: bool,
    waves: bool,
    has_second: bool,
    /// pixels that the person walks in the clip
    way: f64,
}

const PLAIN: Scene =
    Scene { noise: 3.0, drift: 0.0, has_shadow: false, waves: false, has_second: false, way: 230.0 };

/// A wall with spots of several sizes; `at` shifts them, for what moves.
fn wall(x: f64, y: f64, at: f64) -> [f64; 3] {
    let spots = (0.11 * (x + at)).sin() * (0.07 * y).cos() + 0.5 * (0.53 * (x + at) + 0.31 * y).sin();
    let panel = if ((x / 40.0) as usize + (y / 35.0) as usize).is_multiple_of(2) { 12.0 } else { -6.0 };
    [120.0 + 18.0 * spots + panel, 125.0 + 15.0 * spots + panel, 115.0 + 12.0 * spots - panel]
}

/// The colour of a person whose middle is at `centre`, at this pixel; legs swing with `time`.
fn person(x: f64, y: f64, centre: f64, time: f64) -> Option<[f64; 3]> {
    let dx = x - centre;
    if dx.hypot(y - 60.0) < 13.0 {
        return Some([190.0, 140.0, 115.0]);
    }
    if dx.abs() < 20.0 && (73.0..140.0).contains(&y) {
        return Some([150.0 + 20.0 * (0.4 * y).sin(), 40.0, 50.0]);
    }
    let swing = 14.0 * (0.6 * time).sin() * (y - 140.0) / 70.0;
    let is_leg = (dx - 8.0 - swing).abs() < 8.0 || (dx + 8.0 + swing).abs() < 8.0;
    ((140.0..210.0).contains(&y) && is_leg).then_some([35.0, 40.0, 80.0])
}

fn frame(scene: &Scene, number: usize, with_people: bool) -> (Image, Silhouette) {
    let mut random = ChaCha8Rng::seed_from_u64(number as u64 + 1);
    let time = number as f64;
    let centre = 160.0 - scene.way / 2.0 + scene.way * time / (FRAMES - 1) as f64;
    // the other one is larger and comes from the other side
    let second = 330.0 - 4.5 * time;
    let (mut image, mut truth) = (Image::black(WIDTH, HEIGHT), Silhouette::empty(WIDTH, HEIGHT));
    for (x, y) in (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
        let (u, v) = (x as f64, y as f64);
        let is_curtain = scene.waves && (200..290).contains(&x) && y < 120;
        let mut colour = wall(u, v, 0.0);
        // stripes that pass: dark for a third of the time
        if is_curtain && (u + 5.0 * time).rem_euclid(15.0) < 5.0 {
            colour = [70.0, 90.0, 60.0];
        }
        if with_people {
            // on the floor, to the right of the feet
            let is_shadow = ((u - centre - 35.0) / 45.0).hypot((v - 212.0) / 14.0) < 1.0;
            if scene.has_shadow && is_shadow {
                colour = colour.map(|value| 0.72 * value);
            }
            if let Some(own) =
                person(0.8 * u, 0.8 * (v + 40.0), 0.8 * second, time).filter(|_| scene.has_second)
            {
                colour = own.map(|value| 0.9 * value);
            }
            if let Some(own) = person(u, v, centre, time) {
                colour = own;
                truth.set(x, y, true);
            }
        }
        let light = 1.0 + scene.drift * (0.1 * time).sin();
        let noisy = std::array::from_fn(|c| {
            // the sum of four bytes is nearly normal
            let sum: u32 = random.random::<u32>().to_le_bytes().into_iter().map(u32::from).sum();
            let noise = (f64::from(sum) - 510.0) / 147.8;
            let light = 1.0 + (light - 1.0) * [1.2, 1.0, 0.7][c];
            (light * colour[c] + scene.noise * noise).round().clamp(0.0, 255.0) as u8
        });
        image.set(x, y, noisy);
    }
    (image, truth)
}

/// Mean overlap with the truth, the worst frame's, and the quality.
fn run(name: &str, scene: &Scene, kind: ModelKind) -> (f64, f64, CameraQuality) {
    let frames: Vec<_> = (0..FRAMES).map(|number| frame(scene, number, true)).collect();
    let sample: Vec<_> = frames.iter().step_by(2).map(|(image, _)| image.clone()).collect();
    let plate = (kind == ModelKind::Plate).then(|| frame(scene, 1000, false).0);
    let parameters = Parameters { model: kind, ..Parameters::default() };
    let mut segmenter = Segmenter::learn(&parameters, plate.as_ref(), &sample).unwrap();
    let (mut sum, mut worst) = (0.0, 1.0f64);
    for (image, truth) in &frames {
        let iou = segmenter.segment(image).unwrap().0.iou(truth);
        (sum, worst) = (sum + iou, worst.min(iou));
    }
    let (mean, quality) = (sum / FRAMES as f64, segmenter.quality());
    println!(
        "{name} {kind:?}: overlap {mean:.3}, worst {worst:.3}; {:.2} {:?}",
        quality.score, quality.advice
    );
    (mean, worst, quality)
}

const KINDS: [ModelKind; 3] = [ModelKind::Plate, ModelKind::Adaptive, ModelKind::Mixture];

#[test]
fn someone_who_walks_through_noise_is_found_by_every_model() {
    for kind in KINDS {
        let (mean, worst, quality) = run("plain", &PLAIN, kind);
        assert!(mean > 0.95 && worst > 0.9, "{kind:?}: {mean} {worst}");
        assert_eq!(quality.advice, [], "{kind:?}");
        assert!(quality.score > 0.7, "{kind:?}: {quality:?}");
    }
}

#[test]
fn light_that_changes_does_not_matter() {
    for kind in [ModelKind::Plate, ModelKind::Adaptive] {
        let (mean, worst, _) = run("drift", &Scene { drift: 0.15, ..PLAIN }, kind);
        assert!(mean > 0.94 && worst > 0.88, "{kind:?}: {mean} {worst}");
    }
}

#[test]
fn a_cast_shadow_is_not_the_person() {
    for kind in KINDS {
        let (mean, _, _) = run("shadow", &Scene { has_shadow: true, ..PLAIN }, kind);
        assert!(mean > 0.93, "{kind:?}: {mean}");
    }
}

#[test]
fn a_waving_curtain_is_background_for_the_mixture() {
    let scene = Scene { waves: true, ..PLAIN };
    let (mean, _, _) = run("waves", &scene, ModelKind::Mixture);
    assert!(mean > 0.9, "{mean}");
    let (one_colour, _, _) = run("waves", &scene, ModelKind::Adaptive);
    assert!(mean > one_colour + 0.02, "{mean} {one_colour}");
}

#[test]
fn a_second_person_is_warned_of_and_not_taken_until_they_meet() {
    let (mean, _, quality) = run("second", &Scene { has_second: true, ..PLAIN }, ModelKind::Plate);
    assert!(mean > 0.6, "{mean}");
    assert!(quality.advice.contains(&Advice::SeveralPeople), "{:?}", quality.advice);
}

#[test]
fn someone_who_stays_is_warned_of_unless_there_is_a_plate() {
    let scene = Scene { way: 8.0, ..PLAIN };
    let (mean, _, quality) = run("stays", &scene, ModelKind::Adaptive);
    assert!(mean < 0.6, "learned from the clip, the person should be lost: {mean}");
    assert!(quality.advice.contains(&Advice::PersonStays), "{:?}", quality.advice);
    assert!(quality.score < 0.5);
    let (mean, worst, quality) = run("stays", &scene, ModelKind::Plate);
    assert!(mean > 0.95 && worst > 0.9 && quality.advice.is_empty(), "{mean} {worst} {:?}", quality.advice);
}

#[test]
fn an_empty_clip_is_told() {
    let still: Vec<_> = (0..20).map(|number| frame(&PLAIN, number, false).0).collect();
    let mut segmenter = Segmenter::learn(&Parameters::default(), None, &still).unwrap();
    for image in &still {
        assert_eq!(segmenter.segment(image).unwrap().0.area(), 0);
    }
    let advice = segmenter.quality().advice;
    assert!(advice.contains(&Advice::NobodyMoves) && advice.contains(&Advice::NobodyFound), "{advice:?}");
}

#[test]
fn a_plate_off_its_place_and_darker_is_brought_back() {
    let frames: Vec<_> = (0..FRAMES).map(|number| frame(&PLAIN, number, true)).collect();
    let plate = frame(&PLAIN, 1000, false).0;
    let mut moved = Image::black(WIDTH, HEIGHT);
    for (x, y) in (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))) {
        let colour = plate.pixel((x + 3).min(WIDTH - 1), y.saturating_sub(2));
        moved.set(x, y, [0, 1, 2].map(|c| (0.8 * f64::from(colour[c])).round() as u8 + [0, 4, 9][c]));
    }
    let sample: Vec<_> = frames.iter().step_by(2).map(|(image, _)| image.clone()).collect();
    let mut segmenter = Segmenter::learn(&Parameters::default(), Some(&moved), &sample).unwrap();
    let alignment = segmenter.alignment().unwrap();
    assert!(
        (alignment.shift[0] + 3.0).abs() < 0.3 && (alignment.shift[1] - 2.0).abs() < 0.3,
        "{alignment:?}"
    );
    // gain and offset trade against each other in a scene of few colours; what they make of a usual colour counts
    for c in 0..3 {
        let (found, expected) =
            (100.0 * alignment.gain[c] + alignment.offset[c], (100.0 - [0.0, 4.0, 9.0][c]) / 0.8);
        assert!((found - expected).abs() < 1.5, "{found} {expected}");
    }
    let sum: f64 = frames.iter().map(|(image, truth)| segmenter.segment(image).unwrap().0.iou(truth)).sum();
    println!("moved plate: overlap {:.3}", sum / FRAMES as f64);
    assert!(sum / FRAMES as f64 > 0.94);
}

#[test]
fn a_plate_with_someone_in_it_is_warned_of_and_repaired() {
    let frames: Vec<_> =
        (0..FRAMES).map(|number| frame(&Scene { way: 8.0, ..PLAIN }, number, true)).collect();
    // stands far to the left
    let plate = frame(&Scene { way: 230.0, ..PLAIN }, 0, true).0;
    let sample: Vec<_> = frames.iter().step_by(2).map(|(image, _)| image.clone()).collect();
    let mut segmenter = Segmenter::learn(&Parameters::default(), Some(&plate), &sample).unwrap();
    let sum: f64 = frames.iter().map(|(image, truth)| segmenter.segment(image).unwrap().0.iou(truth)).sum();
    let quality = segmenter.quality();
    println!("someone in the plate: overlap {:.3}, {quality:?}", sum / FRAMES as f64);
    assert!(quality.advice.contains(&Advice::PlateShowsSomeone));
    assert!(sum / FRAMES as f64 > 0.94);
    assert!(!segmenter.classes().foreground.contains(45, 100));
}

#[test]
fn what_can_not_be_is_refused() {
    let frames: Vec<_> = (0..6).map(|number| frame(&PLAIN, number, true).0).collect();
    let error = |parameters: &Parameters, plate: Option<&Image>, frames: &[Image]| {
        Segmenter::learn(parameters, plate, frames).unwrap_err().to_string()
    };
    let usual = Parameters::default();
    assert_eq!(
        error(&usual, None, &frames[..2]),
        "found 2 frames to learn the background from, expected at least 3"
    );
    let plate = Parameters { model: ModelKind::Plate, ..usual.clone() };
    assert!(error(&plate, None, &frames).contains("none was given"));
    assert!(error(&usual, Some(&Image::black(10, 2000)), &frames).contains("the plate is 10 x 2000 pixels"));
    let wrong = Parameters { detection_rate: f64::NAN, ..usual.clone() };
    assert!(error(&wrong, None, &frames).contains("detection_rate is NaN"));
    let mixed = [frames[0].clone(), frames[1].clone(), Image::black(100, 100)];
    assert!(error(&usual, None, &mixed).contains("frame 2 is 100 x 100 pixels"));
    let mut segmenter = Segmenter::learn(&usual, None, &frames).unwrap();
    assert!(segmenter.segment(&Image::black(100, 100)).is_err());
}

#[test]
fn parameters_are_read_with_defaults() {
    let read: Parameters = serde_json::from_str(r#"{"model":"mixture","cleaning":{"closing":5}}"#).unwrap();
    assert_eq!((read.model, read.cleaning.closing, read.cleaning.opening), (ModelKind::Mixture, 5, 1));
    assert!(serde_json::from_str::<Parameters>(r#"{"modle":"plate"}"#).is_err());
    assert_eq!(Parameters::default().check(), Ok(()));
}

#[test]
fn a_frame_takes_no_memory() {
    for kind in KINDS {
        let frames: Vec<_> = (0..10).map(|number| frame(&PLAIN, 6 * number, true).0).collect();
        let plate = (kind == ModelKind::Plate).then(|| frame(&PLAIN, 1000, false).0);
        let parameters = Parameters { model: kind, ..Parameters::default() };
        let mut segmenter = Segmenter::learn(&parameters, plate.as_ref(), &frames).unwrap();
        for image in &frames {
            segmenter.segment(image).unwrap();
        }
        let taken = allocation_counter::measure(|| {
            for image in &frames {
                segmenter.segment(image).unwrap();
            }
        });
        assert_eq!(taken.count_total, 0, "{kind:?}");
    }
}
