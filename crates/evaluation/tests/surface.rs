//! Distances to a body's surface, against all its triangles.

mod captured;

use evaluation::surface::{Surface, compare_surfaces, sample_surface};
use model::Mesh;
use nalgebra::Vector3;

/// Distance from a triangle: the least over its plane, sides and corners, whichever the point projects to.
fn distance_from_triangle(point: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a)).normalize();
    let to_segment = |from: Vector3<f64>, to: Vector3<f64>| {
        let along = to - from;
        let t = ((point - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (from + along * t - point).norm()
    };
    let is_over = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(from, to)| (to - from).cross(&(point - from)).dot(&normal) >= 0.0);
    let to_sides = to_segment(a, b).min(to_segment(b, c)).min(to_segment(c, a));
    if is_over { (point - a).dot(&normal).abs().min(to_sides) } else { to_sides }
}

/// Number of faces' solid angle around a point, in full turns: 1 inside a closed mesh, 0 outside (van Oosterom and
/// Strackee 1983; docs/papers.md#other-sources).
fn winding(point: Vector3<f64>, mesh: &Mesh) -> f64 {
    let solid_angle = |face: &[u32; 3]| {
        let [a, b, c] = mesh.corners(face).map(|corner| corner - point);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    mesh.faces.iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[test]
fn the_nearest_point_of_a_body_is_that_of_all_its_triangles() {
    let Some(mesh) = captured::mesh("nearest points") else { return };
    let surface = Surface::new(&mesh).unwrap();
    let mut state = 99u64;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    for _ in 0..150 {
        let point = Vector3::new(uniform() * 1.2 - 0.6, uniform() * 2.0 - 0.1, uniform() * 0.6 - 0.3);
        let found = surface.closest(&point);
        let distances = mesh.faces.iter().map(|face| distance_from_triangle(point, mesh.corners(face)));
        let expected = distances.fold(f64::INFINITY, f64::min);
        assert!((found.signed_m.abs() - expected).abs() < 1e-9, "{point}: {} {expected}", found.signed_m);
        assert_eq!(found.signed_m < 0.0, winding(point, &mesh) > 0.5, "{point}");
        let corners = mesh.corners(&mesh.faces[found.face as usize]);
        let blended: Vector3<f64> = corners.iter().zip(found.weights).map(|(corner, w)| corner * w).sum();
        assert!((blended - found.point).norm() < 1e-12);
    }
}

#[test]
fn a_body_grown_along_its_normals_is_outside_by_as_much() {
    let Some(mesh) = captured::mesh("grown body") else { return };
    let mut grown = mesh.clone();
    for (vertex, normal) in grown.vertices.iter_mut().zip(mesh.normals()) {
        *vertex += normal * 0.004;
    }
    let found = compare_surfaces(&grown, &mesh, 20_000, 1).unwrap();
    for (name, way) in [("found", found.found_to_true), ("true", found.true_to_found), ("both", found.both)] {
        assert!((way.mean_signed_m - 0.004).abs() < 3e-4, "{name}: {way:?}");
        assert!(way.std_m < 6e-4 && way.mean_abs_m < 0.0042, "{name}: {way:?}");
    }
    assert_eq!(found.both.count, 40_000);
    let same = compare_surfaces(&mesh, &mesh, 2_000, 1).unwrap();
    assert!(same.both.max_abs_m < 1e-9);
}

#[test]
fn samples_are_spread_by_area_and_repeat() {
    let Some(mesh) = captured::mesh("samples") else { return };
    let points = sample_surface(&mesh, 50_000, 3).unwrap();
    assert_eq!(points, sample_surface(&mesh, 50_000, 3).unwrap());
    assert_ne!(points, sample_surface(&mesh, 50_000, 4).unwrap());
    // moments of the surface by its triangles: the mean is that of the corners' means weighted with areas
    let (mut area, mut sum) = (0.0, Vector3::zeros());
    for face in &mesh.faces {
        let [a, b, c] = mesh.corners(face);
        let face_area = (b - a).cross(&(c - a)).norm() / 2.0;
        area += face_area;
        sum += (a + b + c) / 3.0 * face_area;
    }
    let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    assert!((mean - sum / area).norm() < 0.01, "{mean}, expected {}", sum / area);
}
