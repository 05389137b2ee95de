//! Hulls of the shared capture, against the mesh that made the silhouettes.

mod capture;

use capture::frame_0;
use evaluation::surface::{Surface, sample_surface};
use model::{Mesh, Silhouette};
use nalgebra::Vector3;
use vision::{Error, Hull, HullOptions, HullView, Topology, carve_hull, scene};

fn carve(capture: &capture::Capture, cameras: &[usize], options: &HullOptions) -> Result<Hull, Error> {
    let view = |&index: &usize| HullView {
        camera: &capture.cameras[index],
        silhouette: &capture.silhouettes[index],
    };
    carve_hull(&cameras.iter().map(view).collect::<Vec<_>>(), options)
}

fn stature(mesh: &Mesh) -> f64 {
    let heights = mesh.vertices.iter().map(|vertex| vertex.y);
    heights.clone().fold(f64::MIN, f64::max) - heights.fold(f64::MAX, f64::min)
}

const ALL: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

#[test]
fn the_hull_of_eight_views_holds_the_body_and_little_more() {
    let Some(capture) = frame_0("hull of eight views") else { return };
    let hull = carve(&capture, &ALL, &HullOptions::default()).unwrap();
    assert!(Topology::new(&hull.mesh.faces, hull.mesh.vertices.len()).is_closed());
    let (volume, truth) = (hull.mesh.volume(), capture.mesh.volume());
    println!(
        "volume {volume:.5} m³, true {truth:.5}; stature {:.4} m, true {:.4}",
        stature(&hull.mesh),
        stature(&capture.mesh)
    );
    println!("pieces {:?}; {:?}", hull.pieces_m3, hull.agreement);
    assert!(volume > truth && volume < 1.25 * truth, "volume {volume} m³, true {truth} m³");
    assert!((stature(&hull.mesh) - stature(&capture.mesh)).abs() < 0.01);
    assert_eq!(hull.pieces_m3.len(), 1, "{:?}", hull.pieces_m3);
    assert!(hull.agreement.iter().all(|view| !view.is_left_out && view.filled > 0.995));

    // nothing of the body is carved away by more than a pixel (2.7 mm) and half a cell, and nearly nothing by a pixel
    let surface = Surface::new(&hull.mesh).unwrap();
    let mut outside = surface.signed_distances(&sample_surface(&capture.mesh, 10_000, 5).unwrap());
    outside.sort_by(f64::total_cmp);
    println!("body outside its hull: 99 % below {:.4} m, all below {:.4} m", outside[9_900], outside[9_999]);
    assert!(outside[9_900] < 0.002 && outside[9_999] < 0.008);
}

#[test]
fn the_hull_does_not_depend_on_the_number_of_threads() {
    let Some(capture) = frame_0("threads") else { return };
    let options = HullOptions { cell_m: 0.01, ..HullOptions::default() };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| carve(&capture, &ALL, &options).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_view_that_lost_the_legs_is_noticed_and_left_out() {
    let Some(mut capture) = frame_0("a bad view") else { return };
    let options = HullOptions { cell_m: 0.01, ..HullOptions::default() };
    let good = carve(&capture, &ALL, &options).unwrap();
    let [_, top, _, bottom] = capture.silhouettes[3].bounds().unwrap();
    for y in (top + bottom) / 2..bottom {
        capture.silhouettes[3].row_mut(y).fill(0);
    }
    let found = carve(&capture, &ALL, &options).unwrap();
    println!("{:?}", found.agreement);
    let left_out: Vec<_> = found.agreement.iter().map(|view| view.is_left_out).collect();
    assert_eq!(left_out, [false, false, false, true, false, false, false, false]);
    assert!((stature(&found.mesh) - stature(&good.mesh)).abs() < 0.01);

    let strict = carve(&capture, &ALL, &HullOptions { leave_out: 0, ..options }).unwrap();
    assert!(strict.agreement[0].filled < 0.7, "{:?}", strict.agreement[0]);
    assert!(stature(&strict.mesh) < 0.7 * stature(&good.mesh));
    let tolerant = carve(&capture, &ALL, &HullOptions { leave_out: 0, tolerated: 1, ..options }).unwrap();
    assert!((stature(&tolerant.mesh) - stature(&good.mesh)).abs() < 0.03);
}

#[test]
fn a_view_that_lost_an_arm_or_is_turned_is_left_out_of_eight_and_of_four() {
    let Some(capture) = frame_0("an arm lost") else { return };
    let options = HullOptions { cell_m: 0.01, ..HullOptions::default() };
    let mut no_arm = frame_0("an arm lost").unwrap();
    let [left, ..] = no_arm.silhouettes[0].bounds().unwrap();
    for y in 0..1004 {
        (left..left + 100).for_each(|x| no_arm.silhouettes[0].set(x, y, false));
    }
    let lost = capture.silhouettes[0].area() - no_arm.silhouettes[0].area();
    assert!((4_000..10_000).contains(&lost), "an arm has {lost} pixels");
    let mut turned = frame_0("an arm lost").unwrap();
    let by = nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.03, 0.0);
    turned.cameras[0].camera_from_world.append_rotation_mut(&by);
    for (what, capture) in [("an arm lost", no_arm), ("turned", turned)] {
        for cameras in [&ALL[..], &[0, 2, 4, 6]] {
            let hull = carve(&capture, cameras, &options).unwrap();
            let left_out: Vec<_> = hull.agreement.iter().map(|view| view.is_left_out).collect();
            println!("{what}, {} views: {:?}", cameras.len(), hull.agreement);
            assert!(left_out[0] && !left_out[1..].contains(&true), "{what}: {left_out:?}");
        }
    }
}

#[test]
fn few_good_views_are_all_used_wherever_they_stand() {
    let Some(capture) = frame_0("few views") else { return };
    let options = HullOptions { cell_m: 0.01, ..HullOptions::default() };
    for cameras in [vec![0, 2, 4, 6], vec![1, 3, 5, 7], vec![0, 1, 2, 3], vec![0, 2, 4]] {
        let hull = carve(&capture, &cameras, &options).unwrap();
        println!("{cameras:?}: {:.4} m³ {:?}", hull.mesh.volume(), hull.agreement);
        assert!(hull.agreement.iter().all(|view| !view.is_left_out));
        assert!(hull.mesh.volume() > capture.mesh.volume());
    }
}

#[test]
fn views_that_have_nothing_in_common_are_refused() {
    let Some(mut capture) = frame_0("nothing in common") else { return };
    let (camera, other) = (capture.cameras[0].clone(), &capture.cameras[2]);
    // the silhouette of camera 2 is moved to a corner of its image
    let mut corner = Silhouette::empty(1004, 1004);
    for y in 0..40 {
        for x in 0..40 {
            corner.set(x + 5, y + 5, true);
        }
    }
    let views = [
        HullView { camera: &camera, silhouette: &capture.silhouettes[0] },
        HullView { camera: other, silhouette: &corner },
    ];
    let error = carve_hull(&views, &HullOptions::default()).unwrap_err();
    assert_eq!(error, Error::EmptyHull { tolerated: 0, views: 2 });

    capture.silhouettes[1] = Silhouette::empty(1004, 1004);
    let error = carve(&capture, &ALL, &HullOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "the silhouette of camera cam1 is empty, expected a person");
    let error = carve(&capture, &[0], &HullOptions::default()).unwrap_err();
    assert_eq!(error, Error::TooFewViews { found: 1 });
}

#[test]
fn a_hull_of_very_many_cells_is_refused() {
    let Some(capture) = frame_0("many cells") else { return };
    let options = HullOptions { cell_m: 0.0005, ..HullOptions::default() };
    assert!(matches!(carve(&capture, &ALL, &options), Err(Error::TooManyCells { .. })));
}

#[test]
fn a_calibration_in_millimetres_is_refused_at_once() {
    let Some(mut capture) = frame_0("calibration in millimetres") else { return };
    for camera in &mut capture.cameras {
        camera.camera_from_world.translation.vector *= 1000.0;
    }
    let error = carve(&capture, &ALL, &HullOptions::default()).unwrap_err();
    assert!(matches!(error, Error::TooManyCells { .. } | Error::EmptyHull { .. }), "{error}");
}

#[test]
fn two_balls_are_two_pieces() {
    let ball = |centre: Vector3<f64>| {
        let mut mesh = Mesh::default();
        let (around, down) = (24u32, 12u32);
        for i in 0..=down {
            for j in 0..around {
                let (polar, angle) = (
                    f64::from(i) / f64::from(down) * std::f64::consts::PI,
                    f64::from(j) / f64::from(around) * std::f64::consts::TAU,
                );
                let direction =
                    Vector3::new(polar.sin() * angle.sin(), polar.cos(), polar.sin() * angle.cos());
                mesh.vertices.push(centre + direction * 0.2);
                if i < down {
                    let (here, next) = (i * around + j, i * around + (j + 1) % around);
                    mesh.faces.push([here, here + around, next]);
                    mesh.faces.push([next, here + around, next + around]);
                }
            }
        }
        mesh
    };
    let mut both = ball(Vector3::new(0.0, 0.6, 0.0));
    let other = ball(Vector3::new(0.0, 1.4, 0.0));
    let first = both.vertices.len() as u32;
    both.vertices.extend(other.vertices);
    both.faces.extend(other.faces.iter().map(|face| face.map(|corner| corner + first)));
    let cameras = scene::Ring::default().cameras();
    let silhouettes = scene::silhouettes(&both, &cameras);
    let views: Vec<_> = cameras
        .iter()
        .zip(&silhouettes)
        .map(|(camera, silhouette)| HullView { camera, silhouette })
        .collect();
    let hull = carve_hull(&views, &HullOptions { cell_m: 0.01, ..HullOptions::default() }).unwrap();
    assert_eq!(hull.pieces_m3.len(), 2, "{:?}", hull.pieces_m3);
    assert!((hull.pieces_m3[1] / hull.pieces_m3[0] - 1.0).abs() < 0.05, "{:?}", hull.pieces_m3);
    assert!((hull.mesh.volume() - hull.pieces_m3[0]).abs() < 1e-9);
}
