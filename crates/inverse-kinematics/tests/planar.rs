//! The paper's three experiments in a plane: four links, seen by one camera.

use std::sync::Arc;

use inverse_kinematics::{Chain, Evidence, ImageView, Options, Outcome, Solver, Support};
use kinematics::{ControlPoint, Parametrisation};
use model::{Axis, Camera, Channel, Joint, Silhouette, Skeleton};
use nalgebra::{Vector2, Vector3};
use vision::{DistanceField, scene::Ring};

const LINKS: usize = 4;
const LENGTH_M: f64 = 0.5;

/// Four links of half a metre in the plane z = 0, from the origin.
fn chain() -> Chain {
    let turn = || vec![Channel::rotation(Axis::Z)];
    let mut joints = vec![Joint::root("link0", turn())];
    for link in 1..LINKS {
        joints.push(Joint::child(format!("link{link}"), link - 1, Vector3::x() * LENGTH_M, turn()));
    }
    let skeleton = Skeleton::new("links", joints).unwrap();
    let point = |joint, offset| ControlPoint { name: format!("p{joint}"), joint, offset };
    let mut points: Vec<_> = (0..LINKS).map(|joint| point(joint, Vector3::zeros())).collect();
    points.push(point(LINKS - 1, Vector3::x() * LENGTH_M));
    Chain::new(&skeleton, Parametrisation::channels(&skeleton), points)
        .unwrap()
        .with_segments((0..LINKS).map(|link| [link, link + 1]).collect())
        .unwrap()
}

fn positions(x: &[f64]) -> Vec<Vector3<f64>> {
    let chain = chain();
    let mut state = chain.kinematics().state();
    let mut positions = vec![Vector3::zeros(); LINKS + 1];
    chain.points().positions(chain.kinematics(), x, &mut state, &mut positions);
    positions
}

/// 100 pixels a metre, the origin in the middle.
fn camera() -> Camera {
    let ring = Ring {
        cameras: 1,
        distance_m: 5.0,
        heights_m: [0.0; 2],
        target: Vector3::zeros(),
        start: 0.0,
        size: 600,
        focal: 500.0,
    };
    ring.cameras().remove(0)
}

/// Pixels within 6 cm of the links.
fn drawn(positions: &[Vector3<f64>]) -> Silhouette {
    let camera = camera();
    let pixels: Vec<_> = positions.iter().map(|p| camera.project(p).unwrap()).collect();
    let mut silhouette = Silhouette::empty(600, 600);
    for y in 0..600 {
        for x in 0..600 {
            let at = Vector2::new(x as f64, y as f64);
            let is_near = pixels.windows(2).any(|ends| {
                let along = ends[1] - ends[0];
                let t = ((at - ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (ends[0] + along * t - at).norm() <= 6.0
            });
            silhouette.set(x, y, is_near);
        }
    }
    silhouette
}

fn view(silhouette: &Silhouette, inside: f64, outside: f64) -> ImageView {
    let field = Arc::new(DistanceField::new(silhouette, 1));
    ImageView { camera: camera(), support: Support::new(field, inside, outside) }
}

/// Pursues `target` with the last point.
fn solve(
    options: Options,
    start: [f64; LINKS],
    target: Vector3<f64>,
    view: &ImageView,
) -> (Vec<Vector3<f64>>, Outcome) {
    let mut solver = Solver::new(chain(), Options { steps: 150, ..options }).unwrap();
    let mut x = start;
    let mut targets = [None; LINKS + 1];
    targets[LINKS] = Some(target);
    let views = std::slice::from_ref(view);
    let evidence = Evidence { targets: &targets, views, posture: &[0.0; LINKS] };
    let outcome = solver.solve(&mut x, &evidence).unwrap();
    (positions(&x), outcome)
}

/// Mean distance of the inner joints, metres.
fn inner_error(found: &[Vector3<f64>], expected: &[Vector3<f64>]) -> f64 {
    (1..LINKS).map(|joint| (found[joint] - expected[joint]).norm()).sum::<f64>() / (LINKS - 1) as f64
}

const IMAGE_MODES: [fn(&[usize]) -> Options; 3] =
    [Options::image_constrained, Options::extended, Options::image_first];

#[test]
fn the_chain_reaches_and_fills_the_silhouette() {
    let objective = positions(&[0.7, -0.5, -0.4, -0.2]);
    let view = view(&drawn(&objective), 6.0, 100.0);
    let start = [0.1, -0.4, 0.6, -0.2];
    let (plain, outcome) = solve(Options::reach(&[LINKS]), start, objective[LINKS], &view);
    assert!(outcome.residual_m < 1e-4, "{outcome:?}");
    let blind = inner_error(&plain, &objective);
    assert!(blind > 0.15, "{blind}");
    for mode in IMAGE_MODES {
        let (found, outcome) = solve(mode(&[LINKS]), start, objective[LINKS], &view);
        let error = inner_error(&found, &objective);
        println!("reach and fill: {blind:.3} m blind, {error:.3} m, {outcome:?}");
        assert!(error < 0.03 && outcome.residual_m < 0.02, "{error} m, {outcome:?}");
    }
}

#[test]
fn the_same_end_effector_is_kept_and_the_other_elbow_found() {
    let objective = positions(&[0.7, -0.5, -0.4, -0.2]);
    // what plain inverse kinematics makes of a start on the other side
    let other = [-0.3, 0.3, 0.6, 0.2];
    let view = view(&drawn(&objective), 6.0, 100.0);
    let mut solver = Solver::new(chain(), Options { steps: 100, ..Options::reach(&[LINKS]) }).unwrap();
    let mut start = other;
    let mut targets = [None; LINKS + 1];
    targets[LINKS] = Some(objective[LINKS]);
    let evidence = Evidence { targets: &targets, views: &[], posture: &[0.0; LINKS] };
    assert!(solver.solve(&mut start, &evidence).unwrap().residual_m < 1e-6);
    let before = inner_error(&positions(&start), &objective);
    let (plain, _) = solve(Options::reach(&[LINKS]), start, objective[LINKS], &view);
    assert!((inner_error(&plain, &objective) - before).abs() < 1e-6, "nothing is left to reach");
    let (found, outcome) = solve(Options::image_constrained(&[LINKS]), start, objective[LINKS], &view);
    let error = inner_error(&found, &objective);
    println!("other elbow: {before:.3} m before, {error:.3} m, {outcome:?}");
    assert!(before > 0.3 && error < 0.03 && outcome.residual_m < 1e-3, "{before} {error} {outcome:?}");
}

#[test]
fn an_object_is_avoided() {
    let mut free = Silhouette::empty(600, 600);
    // a square of 30 cm around (1.05, 0.3)
    for y in 0..600 {
        for x in 0..600 {
            free.set(x, y, !((390..420).contains(&x) && (255..285).contains(&y)));
        }
    }
    let view = view(&free, 20.0, 40.0);
    let inside = |positions: &[Vector3<f64>]| {
        let pixels: Vec<_> = positions.iter().map(|p| view.camera.project(p).unwrap()).collect();
        let at = |ends: &[Vector2<f64>], t: f64| ends[0] + (ends[1] - ends[0]) * t;
        let is_hit = |p: Vector2<f64>| !free.contains(p.x.round() as isize, p.y.round() as isize);
        pixels.windows(2).any(|ends| (0..=100).any(|i| is_hit(at(ends, f64::from(i) / 100.0))))
    };
    let start = [0.9, -0.5, -0.5, -0.3];
    let target = Vector3::new(1.55, -0.25, 0.0);
    assert!(!inside(&positions(&start)));
    let (plain, outcome) = solve(Options::reach(&[LINKS]), start, target, &view);
    assert!(outcome.residual_m < 1e-4 && inside(&plain), "{outcome:?} {plain:?}");
    let (found, outcome) = solve(Options::image_constrained(&[LINKS]), start, target, &view);
    assert!(!inside(&found) && outcome.residual_m < 1e-3, "{outcome:?} {found:?}");
}
