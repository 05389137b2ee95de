//! Learning from the scans of the shared data, and what the model can do then.

mod scans;

use std::path::PathBuf;
use std::sync::OnceLock;

use body::{
    Aligned, Alignment, BodyModel, KnownJoints, LearnOptions, Learned, Posed, RegisteredOptions, RigFile,
    Scan, Template, TemplateParts, fit_registered, learn,
};
use nalgebra::Vector3;
use scans::Scans;

fn folder(test: &str) -> Option<PathBuf> {
    testkit::shared::find("data/bodies", test)
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
    let angles = scans::numbers(&folder.join("scans/pose_angles.npy"));
    for (dof, column) in
        [("l_elbow", 11), ("r_elbow", 22), ("l_shoulder_abd", 8), ("l_hip_abd", 13), ("l_knee", 16)]
    {
        let d = data.template.rig.dof_index(dof).unwrap();
        let found: Vec<f64> = aligned.poses.iter().map(|pose| pose[d].to_degrees()).collect();
        let truth: Vec<f64> = (0..found.len()).map(|i| angles[31 * i + column]).collect();
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
        let shape = scans::shape_of(&model, &data.scans[base]);
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
fn the_shipped_model_is_what_the_scans_teach() {
    let Some(_) = folder("the_shipped_model_is_what_the_scans_teach") else { return };
    let (learned, shipped) = (&learned().1.model, BodyModel::shipped());
    // Sums differ in the last bit from one kind of processor to another.
    let apart = distances(learned.mean(), shipped.mean()).into_iter().fold(0.0, f64::max);
    assert!(apart < 1e-5, "{apart} m");
    for (found, expected) in shipped.variance_kept().iter().zip(learned.variance_kept()) {
        assert!((found - expected).abs() < 1e-5);
    }
    assert_eq!((shipped.rig(), shipped.skin()), (learned.rig(), learned.skin()));
}

#[test]
fn joints_fitted_to_some_people_are_those_of_others() {
    let Some(_) = folder("joints_fitted_to_some_people_are_those_of_others") else { return };
    let data = data();
    let mut file: serde_json::Value = serde_json::to_value(&data.file).unwrap();
    file["joint_regressor"] = serde_json::json!({});
    let file = RigFile::parse(file.to_string().as_bytes()).unwrap();
    let known: Vec<_> =
        (0..60).map(|i| KnownJoints { vertices: &data.scans[i], joints: &data.joints[i] }).collect();
    let parts = TemplateParts {
        faces: &data.template.faces,
        rest: &data.template.rest,
        rig: Some(&file),
        skin: Some(&data.template.skin),
        known_joints: &known,
    };
    let error = |template: &Template| {
        let others = 60..114;
        let mean_m =
            |i: usize| spread(distances(&template.regressor.joints(&data.scans[i]), &data.joints[i]))[0];
        others.clone().map(mean_m).sum::<f64>() / others.len() as f64
    };
    let fitted = error(&Template::new(parts).unwrap());
    let from_one = error(&Template::new(TemplateParts { known_joints: &[], ..parts }).unwrap());
    let given = error(&data.template);
    println!(
        "joints fitted to 60 people: {fitted:.4} m, to the template's own: {from_one:.4} m, given: {given:.4} m"
    );
    // The given weights were fitted to all 114 people, these others among them.
    assert!(
        fitted < 1.5 * given && fitted < from_one && from_one < 2.0 * given,
        "{fitted} {from_one} {given}"
    );
}

#[test]
fn what_a_template_lacks_is_said() {
    let Some(_) = folder("what_a_template_lacks_is_said") else { return };
    let Template { faces, rest, .. } = &data().template;
    let parts = TemplateParts { faces, rest, rig: None, skin: None, known_joints: &[] };
    assert_eq!(Template::new(parts).unwrap().skin, *BodyModel::shipped().skin());
    let other: Vec<_> = faces.iter().rev().copied().collect();
    let error = Template::new(TemplateParts { faces: &other, ..parts }).unwrap_err().to_string();
    assert!(error.contains("needs a rig.json with joints"), "{error}");
    let error = Template::new(TemplateParts { faces: &faces[1..], ..parts }).unwrap_err().to_string();
    assert!(error.contains("3 open edges"), "{error}");
}

#[test]
fn weights_of_heat_pose_as_the_given_ones_do() {
    let Some(_) = folder("weights_of_heat_pose_as_the_given_ones_do") else { return };
    let data = data();
    let template = &data.template;
    let given = data.model_of(0, &[]);
    let (faces, rest) = (&template.faces, &template.rest);
    let parts = TemplateParts { faces, rest, rig: Some(&data.file), skin: None, known_joints: &[] };
    let parts = Template::new(parts).unwrap();
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
        scans::shape_of(&given, &template.rest).pose(&given, &pose, &mut a);
        scans::shape_of(&heat, &template.rest).pose(&heat, &pose, &mut b);
        let [mean, high] = spread(distances(&a.vertices, &b.vertices));
        println!("{name}: {:.1} mm, 95 % {:.1} mm", mean * 1000.0, high * 1000.0);
        assert!(mean < 0.010 && high < 0.045, "{name}: {mean} {high}");
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
