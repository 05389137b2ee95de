//! Meshes drawn through cameras, against silhouettes that another program drew.

mod capture;

use capture::frame_0;
use model::Silhouette;
use nalgebra::{Vector2, Vector3};
use vision::{
    ContourOptions, DepthBuffer, DistanceField, Rasteriser, Topology, View, contours, find_rim, reduced,
};

#[test]
fn the_true_mesh_drawn_is_the_silhouette_of_every_camera() {
    let Some(capture) = frame_0("silhouettes of the true mesh") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    assert!(topology.is_closed());
    let mut rasteriser = Rasteriser::new();
    let mut drawn = Silhouette::empty(1, 1);
    for (camera, expected) in capture.cameras.iter().zip(&capture.silhouettes) {
        let bounds = rasteriser.silhouette(&View::new(camera), &capture.mesh.vertices, &topology, &mut drawn);
        let iou = drawn.iou(expected);
        println!("{}: IoU {iou:.6}, {} pixels", camera.name, expected.area());
        assert!(iou >= 0.999, "{}: IoU {iou}", camera.name);
        assert_eq!(bounds, drawn.bounds());
    }
}

#[test]
fn drawing_again_takes_no_memory() {
    let Some(capture) = frame_0("drawing again") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let view = View::new(&capture.cameras[1]);
    let (mut rasteriser, mut depths) = (Rasteriser::new(), DepthBuffer::new());
    let mut drawn = Silhouette::empty(1, 1);
    let mut draw = || {
        rasteriser.silhouette(&view, &capture.mesh.vertices, &topology, &mut drawn);
        depths.draw(&view, &capture.mesh.vertices, &topology);
    };
    draw();
    let allocated = allocation_counter::measure(draw);
    assert_eq!(allocated.count_total, 0);
}

#[test]
fn depths_are_seen_where_the_silhouette_is_and_agree_with_the_vertices() {
    let Some(capture) = frame_0("depths") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let mut depths = DepthBuffer::new();
    for camera in &capture.cameras {
        let view = View::new(camera);
        depths.draw(&view, &capture.mesh.vertices, &topology);
        let mut seen = Silhouette::empty(view.size[0], view.size[1]);
        for y in 0..view.size[1] {
            for x in 0..view.size[0] {
                seen.set(x, y, depths.face(x as isize, y as isize).is_some());
            }
        }
        let mut drawn = Silhouette::empty(1, 1);
        Rasteriser::new().silhouette(&view, &capture.mesh.vertices, &topology, &mut drawn);
        assert!(seen.iou(&drawn) > 0.9999, "{}: IoU {}", camera.name, seen.iou(&drawn));

        // a pixel shows the face that the ray through its centre meets, as far away as it is
        for (x, y) in [(500isize, 300isize), (490, 420), (510, 500)] {
            let Some(face) = depths.face(x, y) else { continue };
            let [a, b, c] = capture.mesh.corners(&capture.mesh.faces[face as usize]);
            let ray = camera.ray(Vector2::new(x as f64, y as f64)).unwrap();
            let normal = (b - a).cross(&(c - a));
            let along = normal.dot(&(a - view.position)) / normal.dot(&ray);
            let depth = along * ray.dot(&camera.direction());
            assert!((depth - depths.depth(x, y).unwrap()).abs() < 1e-4);
            assert!(depths.sees(&view, &(view.position + ray * along), 1e-3));
            assert!(!depths.sees(&view, &(view.position + ray * (along + 0.05)), 1e-3));
        }
        let seen = capture.mesh.vertices.iter().filter(|vertex| depths.sees(&view, vertex, 0.005)).count();
        let share = seen as f64 / capture.mesh.vertices.len() as f64;
        assert!((0.3..0.6).contains(&share), "{share} of the vertices are seen");
    }
}

#[test]
fn a_view_of_fewer_pixels_is_the_reduced_silhouette() {
    let Some(capture) = frame_0("fewer pixels") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let mut drawn = Silhouette::empty(1, 1);
    for (scale, least) in [(2, 0.985), (4, 0.97)] {
        let (camera, full) = (&capture.cameras[0], &capture.silhouettes[0]);
        let view = View::reduced(camera, scale);
        Rasteriser::new().silhouette(&view, &capture.mesh.vertices, &topology, &mut drawn);
        let expected = reduced(full, scale);
        assert!(drawn.iou(&expected) > least, "scale {scale}: IoU {}", drawn.iou(&expected));
        // the blocks lie where the pixels say: no shift in the mean
        let mean = |silhouette: &Silhouette| {
            let set = |&(x, y): &(usize, usize)| silhouette.contains(x as isize, y as isize);
            let pixels = (0..silhouette.height()).flat_map(|y| (0..silhouette.width()).map(move |x| (x, y)));
            let sum: Vector2<f64> = pixels.filter(set).map(|(x, y)| Vector2::new(x as f64, y as f64)).sum();
            sum / silhouette.area() as f64
        };
        let shift = (mean(&drawn) - mean(&expected)).norm();
        assert!(shift < 0.05, "shifted by {shift} pixels at scale {scale}");
    }
}

#[test]
fn the_rim_lies_on_the_outline_and_looks_out() {
    let Some(capture) = frame_0("rim") else { return };
    let topology = Topology::new(&capture.mesh.faces, capture.mesh.vertices.len());
    let mut rim = Vec::new();
    for (camera, silhouette) in capture.cameras.iter().zip(&capture.silhouettes) {
        let view = View::new(camera);
        find_rim(&view, &capture.mesh.vertices, &topology, silhouette, 1.5, &mut rim);
        let field = DistanceField::new(silhouette, 1);
        let outlines = contours(silhouette, &ContourOptions::default());
        let total: f64 = outlines.iter().map(|outline| outline.length).sum();
        let covered: f64 = rim.iter().map(|point| point.length).sum();
        // edges zigzag and fingers are smoothed away, so that there is more of the rim
        assert!((0.9..1.5).contains(&(covered / total)), "{}: {covered} of {total} pixels", camera.name);
        let mut misses: Vec<f64> = rim.iter().map(|point| field.sample(point.pixel).abs()).collect();
        misses.sort_by(f64::total_cmp);
        assert!(
            misses[misses.len() * 95 / 100] < 1.5,
            "{}: {} pixels",
            camera.name,
            misses[misses.len() * 95 / 100]
        );
        let mut agree = 0;
        for point in &rim {
            let (start, _) = view.project(&point.point).unwrap();
            let (end, _) = view.project(&(point.point + point.normal * 1e-3)).unwrap();
            agree += usize::from((end - start).dot(&point.image_normal) > 0.0);
            let [a, b] = point.vertices.map(|vertex| capture.mesh.vertices[vertex as usize]);
            assert!((point.point - (a + b) / 2.0).norm() < 1e-12);
        }
        assert!(agree * 100 > rim.len() * 97, "{}: {agree} of {} look out", camera.name, rim.len());
    }
}

#[test]
fn an_open_mesh_is_drawn_whole_from_both_sides() {
    let Some(capture) = frame_0("open mesh") else { return };
    let view = View::new(&capture.cameras[0]);
    // two triangles that cross, seen from opposite sides, over each other
    let vertices = [
        Vector3::new(-0.5, 0.5, 0.0),
        Vector3::new(0.5, 0.5, 0.0),
        Vector3::new(0.0, 1.5, 0.0),
        Vector3::new(-0.4, 1.4, 0.1),
        Vector3::new(0.4, 1.4, 0.1),
        Vector3::new(0.0, 0.4, 0.1),
    ];
    let draw = |faces: &[[u32; 3]]| {
        let mut drawn = Silhouette::empty(1, 1);
        let topology = Topology::new(faces, vertices.len());
        Rasteriser::new().silhouette(&view, &vertices, &topology, &mut drawn);
        drawn
    };
    let (one, other, both) = (draw(&[[0, 1, 2]]), draw(&[[3, 4, 5]]), draw(&[[0, 1, 2], [3, 4, 5]]));
    assert!(one.area() > 10_000 && other.area() > 10_000);
    for (word, (a, b)) in both.words().iter().zip(one.words().iter().zip(other.words())) {
        assert_eq!(*word, a | b);
    }
}
