//! Learning from the scans of the shared data, and what the model can do then.

mod scans;

use std::path::PathBuf;
use std::sync::OnceLock;

use body::{
    Aligned, Alignment, LearnOptions, Learned, Posed, RegisteredOptions, Scan, Sex, Wanted, fit_registered,
    heat_skin, learn,
};
use nalgebra::Vector3;
use scans::Scans;

fn folder(test: &str) -> Option<PathBuf> {
    testdata::shared("data/bodies", test)
}

fn data() -> &'static Scans {
    static DATA: OnceLock<Scans> = OnceLock::new();
    DATA.get_or_init(|| Scans::read(&folder("learning").unwrap()))
}

fn learned() -> &'static (Aligned, Learned) {
    static LEARNED: OnceLock<(Aligned, Learned)> = OnceLock::new();
    LEARNED.get_or_init(|| {
        let (data, options) = (data(), LearnOptions::default());
        let aligned = Aligned::new(&data.base(), &data.template, &options).unwrap();
        let learned = aligned.learn(&data.template, &[], &options).unwrap();
        (aligned, learned)
    })
}

/// Mean and 95th percentile.
fn spread(mut distances: Vec<f64>) -> [f64; 2] {
    distances.sort_by(f64::total_cmp);
    [distances.iter().sum::<f64>() / distances.len() as f64, distances[distances.len() * 95 / 100]]
}

fn distances(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).collect()
}

#[test]
fn without_unposing_the_variance_kept_is_the_known_one() {
    let Some(_) = folder("without_unposing_the_variance_kept_is_the_known_one") else { return };
    let data = data();
    let options = LearnOptions { alignment: Alignment::AsTheyStand, ..LearnOptions::default() };
    let learned = learn(&data.base(), &data.template, &options).unwrap();
    println!("variance kept as they stand: {:.4?}", learned.variance_kept);
    println!("variance: {:.4} m2", learned.variance_m2);
    // bodies/README.md
    for (count, known) in [(1, 77.9), (2, 82.7), (3, 85.9), (5, 91.1), (10, 96.6), (15, 98.6), (20, 99.3)] {
        let kept = 100.0 * learned.variance_kept[count - 1];
        assert!((kept - known).abs() < 0.06, "{count} components keep {kept:.2} %, expected {known} %");
    }
}

#[test]
fn unposing_leaves_less_to_the_components() {
    let Some(folder) = folder("unposing_leaves_less_to_the_components") else { return };
    let data = data();
    let (aligned, unposed) = learned();
    let options = LearnOptions { alignment: Alignment::Turned, ..LearnOptions::default() };
    let standing = learn(&data.base(), &data.template, &options).unwrap();
    println!(
        "variance kept as they stand: {:.4?}, of {:.4} m2",
        standing.variance_kept, standing.variance_m2
    );
    println!("variance kept unposed: {:.4?}, of {:.4} m2", unposed.variance_kept, unposed.variance_m2);
    assert!(unposed.variance_m2 < 0.9 * standing.variance_m2 && unposed.variance_kept[19] > 0.995);
    let rest = |learned: &Learned| (1.0 - learned.variance_kept[19]) * learned.variance_m2;
    assert!(rest(unposed) < 0.6 * rest(&standing), "{} {}", rest(unposed), rest(&standing));
    // How each person really bent the elbows: column 11 and 22 of the angles used to make the scans, in degrees.
    let angles = scans::floats(&folder.join("scans/pose_angles.npy"));
    for (dof, column) in
        [("l_elbow", 11), ("r_elbow", 22), ("l_shoulder_abd", 8), ("l_hip_abd", 13), ("l_knee", 16)]
    {
        let d = data.template.rig.dof_index(dof).unwrap();
        let found: Vec<f64> = aligned.poses.iter().map(|pose| pose[d].to_degrees()).collect();
        let truth: Vec<f64> = (0..found.len()).map(|i| f64::from(angles[31 * i + column])).collect();
        let correlation = correlation(&found, &truth);
        println!("{dof}: correlation of angles found and true {correlation:.3}");
        assert!(correlation > 0.7, "{dof}: {correlation}");
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(a, b)| f(a - ma, b - mb)).sum::<f64>();
    sum(&|a, b| a * b) / (sum(&|a, _| a * a) * sum(&|_, b| b * b)).sqrt()
}

#[test]
fn twenty_two_angles_follow_posed_scans_as_far_as_is_known() {
    let Some(_) = folder("twenty_two_angles_follow_posed_scans_as_far_as_is_known") else { return };
    let data = data();
    let model = data.model_of(0, &[]);
    // mean and 95th percentile, mm, of bodies/README.md, of the first subject with that pose
    for (pose, known) in [
        ("p01_tpose", [3.5, 8.2]),
        ("p11_elbows_90_front", [5.9, 12.8]),
        ("p22_left_knee_up", [4.6, 10.5]),
        ("p28_run", [6.0, 17.3]),
        ("p18_squat_half", [13.4, 27.4]),
    ] {
        let scan = data.names.iter().position(|[_, name]| name == pose).unwrap();
        assert!(scan >= 114);
        let base = data.names.iter().position(|[subject, _]| *subject == data.names[scan][0]).unwrap();
        let shape = model.shape_of(data.scans[base].clone()).unwrap();
        let fit = fit_registered(&model, &shape, &data.scans[scan], &RegisteredOptions::default());
        let mut posed = Posed::default();
        shape.pose(&model, &fit.pose, &mut posed);
        for (found, known) in spread(distances(&posed.vertices, &data.scans[scan])).into_iter().zip(known) {
            let found = 1000.0 * found;
            println!("{pose} {}: {found:.2} mm, known {known} mm", data.names[scan][0]);
            assert!((found - known).abs() < 0.05 * known, "{pose}: {found:.2} mm, known {known} mm");
        }
    }
}

#[test]
fn a_person_left_out_is_near_a_body_of_the_model() {
    let Some(_) = folder("a_person_left_out_is_near_a_body_of_the_model") else { return };
    let data = data();
    let (aligned, _) = learned();
    let mut means = Vec::new();
    for person in [3, 40, 77, 110] {
        let model = aligned.learn(&data.template, &[person], &LearnOptions::default()).unwrap().model;
        let options = RegisteredOptions { components: 20, ..RegisteredOptions::default() };
        let fit = fit_registered(&model, &model.shape(&[]), &data.scans[person], &options);
        let mut posed = Posed::default();
        model.shape(&fit.alpha).pose(&model, &fit.pose, &mut posed);
        let [mean, high] = spread(distances(&posed.vertices, &data.scans[person]));
        println!("scan {person} left out: mean {:.2} mm, 95 % {:.2} mm", mean * 1000.0, high * 1000.0);
        means.push(mean);
    }
    assert!(means.iter().all(|mean| *mean < 0.006), "{means:?}");
}

#[test]
fn bodies_have_the_measurements_asked_for() {
    let Some(_) = folder("bodies_have_the_measurements_asked_for") else { return };
    let model = &learned().1.model;
    for (sex, stature, mass) in [(Sex::Male, 1.85, 95.0), (Sex::Female, 1.58, 50.0), (Sex::Male, 1.70, 62.0)]
    {
        let wanted =
            Wanted { stature_m: Some(stature), mass_kg: Some(mass), sex: Some(sex), age_years: Some(30.0) };
        let alpha = model.alpha_for(&wanted).unwrap();
        let found = model.shape(&alpha).measurements(model);
        println!("{sex:?}: {found:.3?} alpha {alpha:.2?}");
        assert!((found.stature_m - stature).abs() < 1e-3 && (found.mass_kg - mass).abs() < 0.05, "{found:?}");
        assert!((found.arm_span_m / stature - 1.0).abs() < 0.08, "{found:?}");
        assert!((0.40..0.52).contains(&(found.inseam_m / stature)), "{found:?}");
        assert!((0.5..1.4).contains(&found.waist_m) && found.waist_m < found.hip_m, "{found:?}");
        assert!((0.7..1.4).contains(&found.chest_m), "{found:?}");
    }
    let error = model.alpha_for(&Wanted { stature_m: Some(17.8), ..Wanted::default() }).unwrap_err();
    assert_eq!(error.to_string(), "stature of 17.8 m was asked for, expected 1 to 2.4");
    assert_eq!(model.alpha_for(&Wanted::default()).unwrap(), vec![0.0; 20]);
}

#[test]
fn age_and_sex_asked_for_change_the_body() {
    let Some(_) = folder("age_and_sex_asked_for_change_the_body") else { return };
    let model = &learned().1.model;
    let body = |sex| {
        let wanted = Wanted { stature_m: Some(1.7), mass_kg: Some(68.0), sex: Some(sex), age_years: None };
        model.shape(&model.alpha_for(&wanted).unwrap()).measurements(model)
    };
    let (man, woman) = (body(Sex::Male), body(Sex::Female));
    assert!(woman.hip_m - woman.waist_m > man.hip_m - man.waist_m + 0.03, "{woman:?} {man:?}");
}

#[test]
fn a_file_is_read_as_it_was_written() {
    let Some(_) = folder("a_file_is_read_as_it_was_written") else { return };
    let model = &learned().1.model;
    let bytes = model.to_bytes();
    println!("{} bytes", bytes.len());
    assert!(bytes.len() <= 1_500_000, "{} bytes", bytes.len());
    let read = body::BodyModel::from_bytes(&bytes).unwrap();
    assert_eq!(&read, model);
}

#[test]
fn weights_of_heat_pose_as_the_given_ones_do() {
    let Some(_) = folder("weights_of_heat_pose_as_the_given_ones_do") else { return };
    let data = data();
    let template = &data.template;
    let joints = template.regressor.joints(&template.rest);
    let skin = heat_skin(&template.rest, &template.faces, &template.rig, &joints).unwrap();
    let given = data.model_of(0, &[]);
    let mut parts = template.clone();
    parts.skin = skin;
    let options = LearnOptions { alignment: Alignment::Turned, components: 1, ..LearnOptions::default() };
    let heat = learn(&data.base()[..2], &parts, &options).unwrap().model;
    for (name, angles) in [
        ("arms raised", [("l_shoulder_abd", 0.9), ("r_shoulder_abd", 0.9)]),
        ("knee up", [("l_hip_flex", 1.2), ("l_knee", 1.2)]),
        ("elbows bent", [("l_elbow", 1.2), ("r_elbow", 1.2)]),
    ] {
        let mut pose = vec![0.0; template.rig.num_dofs()];
        angles.iter().for_each(|(dof, angle)| pose[template.rig.dof_index(dof).unwrap()] = *angle);
        let (mut a, mut b) = (Posed::default(), Posed::default());
        given.shape_of(template.rest.clone()).unwrap().pose(&given, &pose, &mut a);
        heat.shape_of(template.rest.clone()).unwrap().pose(&heat, &pose, &mut b);
        let [mean, high] = spread(distances(&a.vertices, &b.vertices));
        println!("{name}: {:.1} mm, 95 % {:.1} mm", mean * 1000.0, high * 1000.0);
        assert!(mean < 0.010 && high < 0.045, "{name}: {mean} {high}");
    }
}

#[test]
fn a_motion_puts_the_joints_where_the_poses_put_them() {
    let Some(_) = folder("a_motion_puts_the_joints_where_the_poses_put_them") else { return };
    let model = data().model_of(0, &[1]);
    let shape = model.shape(&[0.3]);
    let poses: Vec<Vec<f64>> = (0..30)
        .map(|f| (0..model.rig().num_dofs()).map(|d| 0.02 * f as f64 * (d as f64 + 1.0).sin()).collect())
        .collect();
    let motion = model.motion(&shape, &poses, 30.0).unwrap();
    let skeleton = motion.skeleton();
    let kinematics = kinematics::Kinematics::new(skeleton, kinematics::Parametrisation::channels(skeleton));
    let (mut state, mut posed) = (kinematics.state(), Posed::default());
    for (values, pose) in motion.poses().zip(&poses) {
        kinematics.update(values, &mut state);
        shape.pose_joints(&model, pose, &mut posed);
        for (joint, expected) in posed.joints.iter().enumerate() {
            assert!((state.point(joint, &Vector3::zeros()) - expected).norm() < 1e-9, "joint {joint}");
        }
    }
}

#[test]
fn wrong_scans_are_refused_by_name() {
    let Some(_) = folder("wrong_scans_are_refused_by_name") else { return };
    let data = data();
    let good = &data.scans[7];
    let changed =
        |change: &dyn Fn(&Vector3<f64>) -> Vector3<f64>| good.iter().map(change).collect::<Vec<_>>();
    let mut broken = good.clone();
    broken[12].z = f64::NAN;
    let mut shuffled = good.clone();
    shuffled.reverse();
    let mut cases = vec![
        (good[..6499].to_vec(), "6499 vertices, expected the template's 6500"),
        (broken, "vertex 12 is not finite"),
        (changed(&|v| Vector3::new(v.x, -v.z, v.y)), "stands along the z axis"),
        (changed(&|v| Vector3::new(v.y, -v.x, v.z)), "stands along the x axis"),
        (changed(&|v| Vector3::new(-v.x, v.y, v.z)), "mirrored"),
        (changed(&|v| Vector3::new(v.x, -v.y, v.z)), "mirrored"),
        (changed(&|v| Vector3::new(-v.x, -v.y, v.z)), "upside down"),
        (changed(&|v| v * 1000.0), "is the file in millimetres?"),
        (changed(&|v| v * 100.0), "is the file in centimetres?"),
        (changed(&|_| Vector3::zeros()), "in one place"),
    ];
    cases.push((shuffled, ""));
    for (vertices, expected) in cases {
        let mut scans = data.base();
        scans[2] = Scan { name: "anna.obj", vertices: &vertices, ..scans[2] };
        let error = learn(&scans, &data.template, &LearnOptions::default()).unwrap_err().to_string();
        println!("{error}");
        assert!(error.starts_with("scan anna.obj: ") && error.contains(expected), "{error}: {expected}");
    }
    let faces = &data.template.faces;
    let holes = &faces[..faces.len() - 40];
    let inwards: Vec<_> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    for (faces, expected) in [(holes, "holes"), (&inwards, "look inwards"), (&[[0, 1, 9999]], "9999")] {
        let mut scans = data.base();
        scans[2] = Scan { name: "anna.obj", faces: Some(faces), ..scans[2] };
        let error = learn(&scans, &data.template, &LearnOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with("scan anna.obj: ") && error.contains(expected), "{error}: {expected}");
    }
}

#[test]
fn a_scan_turned_about_the_vertical_is_turned_back() {
    let Some(_) = folder("a_scan_turned_about_the_vertical_is_turned_back") else { return };
    let data = data();
    let options = LearnOptions { alignment: Alignment::Turned, ..LearnOptions::default() };
    let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), 2.0);
    let turned: Vec<_> = data.scans[5].iter().map(|v| turn * v + Vector3::new(1.0, 0.3, -2.0)).collect();
    let mut scans = data.base();
    let straight = Aligned::new(&scans[..8], &data.template, &options).unwrap();
    scans[5].vertices = &turned;
    let back = Aligned::new(&scans[..8], &data.template, &options).unwrap();
    let [mean, _] = spread(distances(&straight.shapes[5], &back.shapes[5]));
    assert!(mean < 1e-9, "{mean} m apart");
}
