//! What cannot be fitted is explained to the user.

use body::BodyModel;
use model::{Camera, Mesh, Silhouette};
use nalgebra::{Isometry3, Rotation3, Vector3};
use shape_fit::{Error, Options, fit};
use vision::scene::{Ring, silhouettes};

fn cameras() -> Vec<Camera> {
    Ring { size: 402, focal: 530.0, ..Ring::default() }.cameras()
}

fn somebody(model: &BodyModel) -> Mesh {
    Mesh::new(model.shape(&[]).vertices, model.faces().to_vec()).unwrap()
}

fn seen(mesh: &Mesh, cameras: &[Camera]) -> Vec<(Camera, Silhouette)> {
    cameras.iter().cloned().zip(silhouettes(mesh, cameras)).collect()
}

fn error(model: &BodyModel, views: &[(Camera, Silhouette)]) -> Error {
    fit(model, views, &Options::default()).map(|fit| fit.views).unwrap_err()
}

/// The camera turned about its own vertical axis, as if somebody had bumped into it.
fn bumped(camera: &Camera, degrees: f64) -> Camera {
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), degrees.to_radians());
    let turn = Isometry3::from_parts(Vector3::zeros().into(), turn.into());
    Camera { camera_from_world: turn * camera.camera_from_world, ..camera.clone() }
}

#[test]
fn a_camera_that_was_moved_is_named() {
    let model = BodyModel::shipped();
    let mut views = seen(&somebody(&model), &cameras());
    views[3].0 = bumped(&views[3].0, 6.0);
    let error = error(&model, &views);
    assert_eq!(error, Error::ViewDisagrees { camera: "cam3".into() });
    assert!(error.to_string().contains("camera cam3 does not fit the other cameras"));
}

#[test]
fn it_can_be_left_out_and_the_body_is_found() {
    let model = BodyModel::shipped();
    let mesh = somebody(&model);
    let mut views = seen(&mesh, &cameras());
    views[3].0 = bumped(&views[3].0, 6.0);
    let options = Options { leave_out_bad_view: true, ..Options::default() };
    let found = fit(&model, &views, &options).unwrap();
    assert!(!found.views[3].is_used && found.views.iter().filter(|view| view.is_used).count() == 7);
    let off: f64 = found.mesh.vertices.iter().zip(&mesh.vertices).map(|(a, b)| (a - b).norm()).sum();
    let mean_mm = 1e3 * off / mesh.vertices.len() as f64;
    assert!(mean_mm < 10.0, "vertices are off by {mean_mm} mm");
}

#[test]
fn cameras_with_each_others_silhouettes_do_not_meet() {
    let model = BodyModel::shipped();
    let mut mesh = somebody(&model);
    // beside the middle, so that it matters which camera saw it
    mesh.vertices.iter_mut().for_each(|vertex| vertex.x += 0.6);
    let mut views = seen(&mesh, &cameras());
    let mut swapped: Vec<Silhouette> = views.iter().map(|(_, silhouette)| silhouette.clone()).collect();
    // turning all of them round a ring would make a turned person
    [(0, 3), (1, 5), (2, 7)].iter().for_each(|&(a, b)| swapped.swap(a, b));
    views.iter_mut().zip(swapped).for_each(|((_, silhouette), other)| *silhouette = other);
    let error = error(&model, &views);
    assert!(matches!(error, Error::ViewsDoNotMeet { .. }), "{error}");
    assert!(error.to_string().contains("do not see the same person at the same place"));
}

#[test]
fn two_people_are_too_many() {
    let model = BodyModel::shipped();
    let one = somebody(&model);
    for apart in [0.9, 1.5] {
        let mut both = one.clone();
        let count = both.vertices.len() as u32;
        both.vertices.extend(one.vertices.iter().map(|vertex| vertex + Vector3::new(apart, 0.0, 0.3)));
        both.faces.extend(one.faces.iter().map(|face| face.map(|corner| corner + count)));
        let error = error(&model, &seen(&both, &cameras()));
        assert!(matches!(error, Error::TwoPeople { .. }), "{apart} m apart: {error}");
    }
}

#[test]
fn nobody_and_too_few_views_are_told_apart() {
    let model = BodyModel::shipped();
    let mut views = seen(&somebody(&model), &cameras());
    for (_, silhouette) in &mut views[1..] {
        silhouette.clear();
    }
    assert_eq!(error(&model, &views), Error::TooFewViews { found: 1, least: 2 });
    views[0].1.clear();
    (0..40).for_each(|i| views[0].1.set(10 * i, 7 * i, true));
    assert_eq!(error(&model, &views), Error::Nobody);
    assert_eq!(error(&model, &[]), Error::Nobody);
}

#[test]
fn a_person_cut_off_in_every_picture_is_refused_and_so_is_the_wrong_size() {
    let model = BodyModel::shipped();
    let near: Vec<Camera> =
        cameras().into_iter().map(|camera| Camera { focal: camera.focal * 2.0, ..camera }).collect();
    let mut views = seen(&somebody(&model), &near);
    assert!(matches!(error(&model, &views), Error::CutOff { .. }));
    views[2].1 = Silhouette::empty(400, 402);
    assert!(error(&model, &views).to_string().contains("the silhouette of camera cam2 has 400 x 402 pixels"));
}

#[test]
fn a_calibration_in_millimetres_is_noticed() {
    let model = BodyModel::shipped();
    let mut views = seen(&somebody(&model), &cameras());
    for (camera, _) in &mut views {
        camera.camera_from_world.translation.vector *= 1000.0;
    }
    let error = error(&model, &views);
    assert!(matches!(error, Error::Height { .. }), "{error}");
}

#[test]
fn a_thing_that_is_no_person_is_not_found() {
    let model = BodyModel::shipped();
    let side = |x: f64, y: f64, z: f64| Vector3::new(0.9 * x, 0.2 + 1.2 * y, 0.9 * z);
    let corners =
        (0..8).map(|i| side(f64::from(i & 1) - 0.5, f64::from(i >> 1 & 1), f64::from(i >> 2 & 1) - 0.5));
    let faces = vec![
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    let cupboard = Mesh::new(corners.collect(), faces).unwrap();
    let error = error(&model, &seen(&cupboard, &cameras()));
    assert!(matches!(error, Error::NotFound { .. }), "{error}");
}
