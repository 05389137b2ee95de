//! Features of a textured surface under changes that are known.

mod textured;

use features::{Feature, Features, FrameMatcher, Options, detect, match_features};
use model::{Image, Silhouette};
use nalgebra::Vector2;
use textured::{Change, NONE, picture};

/// So large that it isn't doubled.
const SIZE: [usize; 2] = [620, 540];

/// What came of a change.
#[derive(Debug)]
struct Found {
    features: usize,
    /// share of the features that are found again, at most 1.5 pixels off and of the same width within a quarter
    repeated: f64,
    matches: usize,
    /// share of the matches that are at most 2 pixels off
    right: f64,
    /// median distance of right matches from where they should be, pixels
    median_px: f64,
}

fn measure(change: Change) -> Found {
    let all = Options { max_features: 5000, reach: 1.0, ..Options::default() };
    let (image, inside) = picture(SIZE, NONE, 1);
    let (other, other_inside) = picture(SIZE, change, 2);
    let (before, now) = (detect(&image, &inside, &all), detect(&other, &other_inside, &all));
    let is_again = |point: &&Feature| {
        let place = change.place(point.pixel, SIZE);
        let is_it = |other: &Feature| {
            let ratio = other.scale_px / (point.scale_px * change.scale);
            (other.pixel - place).norm() < 1.5 && (0.8..1.25).contains(&ratio)
        };
        now.points.iter().any(is_it)
    };
    let again = before.points.iter().filter(is_again).count();
    let pairs = match_features(&before, &now, &all);
    let misses =
        pairs.iter().map(|&[i, j]| (change.place(before.points[i].pixel, SIZE) - now.points[j].pixel).norm());
    let mut right: Vec<f64> = misses.filter(|miss| *miss < 2.0).collect();
    right.sort_by(f64::total_cmp);
    Found {
        features: before.points.len(),
        repeated: again as f64 / before.points.len() as f64,
        matches: pairs.len(),
        right: right.len() as f64 / pairs.len().max(1) as f64,
        median_px: right[right.len() / 2],
    }
}

fn check(name: &str, change: Change, repeated: f64, matched: f64) {
    let found = measure(change);
    println!("{name}: {found:?}");
    assert!(found.features > 200, "{name}: {found:?}");
    assert!(found.repeated >= repeated, "{name}: {found:?}");
    assert!(found.matches as f64 >= matched * found.features as f64, "{name}: {found:?}");
    assert!(found.right >= 0.99 && found.median_px < 0.5, "{name}: {found:?}");
}

#[test]
fn features_are_found_again_after_a_shift() {
    check("a whole pixel", Change { shift: Vector2::new(16.0, -8.0), ..NONE }, 0.99, 0.95);
    check("a part of a pixel", Change { shift: Vector2::new(3.37, 5.61), ..NONE }, 0.88, 0.80);
}

#[test]
fn features_are_found_again_after_a_turn() {
    for degrees in [10.0f64, 45.0, 90.0, 200.0] {
        check(&format!("{degrees} degrees"), Change { turn: degrees.to_radians(), ..NONE }, 0.88, 0.80);
    }
}

#[test]
fn features_are_found_again_at_another_scale() {
    for (scale, repeated, matched) in [(0.8, 0.60, 0.55), (1.15, 0.85, 0.80)] {
        check(&format!("scale {scale}"), Change { scale, ..NONE }, repeated, matched);
    }
}

#[test]
fn features_are_found_again_in_other_light_and_noise() {
    check("darker", Change { light: [0.7, 20.0], ..NONE }, 0.80, 0.78);
    check("noise of 4 grey levels", Change { noise: 4.0, ..NONE }, 0.80, 0.75);
    let all =
        Change { turn: 0.2, scale: 1.08, shift: Vector2::new(7.3, -4.4), light: [0.85, 10.0], noise: 3.0 };
    check("all at once", all, 0.80, 0.75);
}

#[test]
fn small_pictures_are_doubled_and_give_finer_features() {
    let size = [210, 180];
    let (image, inside) = picture(size, NONE, 1);
    let change = Change { turn: 0.3, ..NONE };
    let (other, other_inside) = picture(size, change, 2);
    let options = Options { reach: 1.0, ..Options::default() };
    let (before, now) = (detect(&image, &inside, &options), detect(&other, &other_inside, &options));
    let fine = before.points.iter().filter(|point| point.scale_px < 1.6).count();
    let pairs = match_features(&before, &now, &options);
    let miss =
        |[i, j]: &[usize; 2]| (change.place(before.points[*i].pixel, size) - now.points[*j].pixel).norm();
    let right = pairs.iter().filter(|pair| miss(pair) < 1.5).count();
    println!("{fine} fine of {} features, {right} right of {} matches", before.points.len(), pairs.len());
    assert!(fine > 25 && pairs.len() > 120 && right as f64 > 0.98 * pairs.len() as f64);
}

#[test]
fn features_lie_inside_and_none_is_of_the_background() {
    let options = Options::default();
    let (image, inside) = picture(SIZE, NONE, 1);
    let found = detect(&image, &inside, &options);
    assert!(found.points.len() > 200 && found.points.len() <= 400, "{}", found.points.len());
    for point in &found.points {
        let far = |dx: isize, dy: isize| {
            inside.contains(point.pixel.x.round() as isize + dx, point.pixel.y.round() as isize + dy)
        };
        assert!(far(0, 0) && far(2, 0) && far(-2, 0) && far(0, 2) && far(0, -2), "{point:?}");
    }
    // the background may be anything
    let mut dark = image.clone();
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            if !inside.contains(x as isize, y as isize) {
                dark.set(x, y, [0; 3]);
            }
        }
    }
    assert_eq!(detect(&dark, &inside, &options), found);
}

#[test]
fn the_strongest_features_are_spread_over_the_person() {
    let (image, inside) = picture(SIZE, NONE, 1);
    let few = Options { max_features: 60, ..Options::default() };
    let found = detect(&image, &inside, &few);
    assert!(found.points.len() <= 60 && found.points.len() > 40, "{}", found.points.len());
    let quarter = |point: &Feature| {
        usize::from(point.pixel.x > SIZE[0] as f64 / 2.0)
            + 2 * usize::from(point.pixel.y > SIZE[1] as f64 / 2.0)
    };
    for wanted in 0..4 {
        let count = found.points.iter().filter(|point| quarter(point) == wanted).count();
        assert!(count >= 8, "{count} of 60 in quarter {wanted}");
    }
}

#[test]
fn a_stream_of_pictures_gives_the_points_of_neighbours() {
    let mut matcher = FrameMatcher::new(Options::default());
    for frame in 0..4 {
        let at = |frame: f64| Change {
            turn: 0.05 * frame,
            shift: Vector2::new(6.0 * frame, -2.5 * frame),
            noise: 2.0,
            ..NONE
        };
        let (image, inside) = picture(SIZE, at(f64::from(frame)), frame as u64);
        let matches = matcher.push(&image, &inside);
        if frame == 0 {
            assert!(matches.is_empty());
            continue;
        }
        let miss = |found: &model::PointMatch| {
            // where it was in the unchanged picture and is now
            let (before, now) = (at(f64::from(frame - 1)), at(f64::from(frame)));
            let middle = Vector2::new(SIZE[0] as f64, SIZE[1] as f64) / 2.0;
            let rest =
                nalgebra::Rotation2::new(-before.turn) * (found.before - middle - before.shift) + middle;
            (now.place(rest, SIZE) - found.now).norm()
        };
        let right = matches.iter().filter(|found| miss(found) < 2.0).count();
        println!("frame {frame}: {right} of {} matches", matches.len());
        assert!(matches.len() > 120 && right as f64 > 0.98 * matches.len() as f64);
        assert!(matches.iter().all(|found| found.frames_back == 1));
    }
}

#[test]
fn degenerate_pictures_have_no_features_and_no_panic() {
    let options = Options::default();
    let none = |image: &Image, inside: &Silhouette| {
        let found = detect(image, inside, &options);
        assert_eq!(found, Features::default());
        assert!(match_features(&found, &found, &options).is_empty());
    };
    let full = |width: usize, height: usize| {
        Silhouette::from_pixels(width, height, &vec![1u8; width * height], |m| m == 1).unwrap()
    };
    for (width, height) in [(0, 0), (1, 1), (2, 300), (300, 2), (12, 12), (13, 14), (100, 80)] {
        none(&Image::black(width, height), &full(width, height));
        none(&Image::black(width, height), &Silhouette::empty(width, height));
    }
    let (image, inside) = picture([200, 180], NONE, 1);
    none(&image, &Silhouette::empty(200, 180));
    // a silhouette of another size: what both have counts
    let larger = full(500, 500);
    assert!(!detect(&image, &larger, &options).points.is_empty());
    none(&image, &full(3, 3));
    none(&Image::black(0, 0), &larger);
    // single pixels, and a black and white chessboard
    let mut one = Silhouette::empty(200, 180);
    one.set(199, 179, true);
    none(&image, &one);
    let board = (0..90_000).flat_map(|i| [((i % 300 + i / 300) % 2 * 255) as u8; 3]).collect();
    let found = detect(&Image::from_rgb(300, 300, board).unwrap(), &full(300, 300), &options);
    assert!(found.points.iter().all(|p| p.pixel.iter().all(|x| x.is_finite()) && p.scale_px > 0.0));
    // options that make no sense
    let odd = Options {
        max_features: 0,
        contrast: f64::NAN,
        edge_ratio: f64::NAN,
        margin_px: 999,
        ratio: f64::NAN,
        reach: f64::NAN,
    };
    assert!(detect(&image, &inside, &odd).points.is_empty());
    let good = detect(&image, &inside, &options);
    assert!(match_features(&good, &good, &odd).is_empty());
}
