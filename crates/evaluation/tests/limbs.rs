//! Arms of recorded boxing and legs of recorded walking, told their ends and silhouettes: where are elbows and knees?

use std::path::Path;

use body::BodyModel;
use evaluation::Recording;
use evaluation::limbs::{LimbErrors, Limbs, Method, run_all};
use model::Silhouette;
use vision::scene::SilhouetteNoise;

fn noisy(mut seen: Silhouette, frame: usize, camera: usize) -> Silhouette {
    SilhouetteNoise::default().add_to(&mut seen, frame as u64, camera as u64);
    shape_fit::cleaned(&seen)
}

/// Means over all recordings, by method.
fn means(name: &str, results: &[Vec<LimbErrors>]) -> Vec<f64> {
    (0..results[0].len())
        .map(|method| {
            let all = || results.iter().map(|errors| &errors[method]);
            let mut mm: Vec<f64> = all().flat_map(|errors| errors.inner_mm.iter().copied()).collect();
            let mean = mm.iter().sum::<f64>() / mm.len() as f64;
            mm.sort_by(f64::total_cmp);
            let (median, most) = (mm[mm.len() / 2], mm[mm.len() * 95 / 100]);
            let method = &results[0][method].method;
            println!("{name:16} {method:20} mean {mean:6.2} median {median:6.2} 95 % {most:6.2} mm");
            mean
        })
        .collect()
}

/// Means of plain, limited, priority, first view, second view, both views; exact and noisy.
fn evaluate(folder: &Path, limbs: Limbs, trials: &[&str], frames: usize) -> [Vec<f64>; 2] {
    let model = BodyModel::shipped();
    let shape = model.shape(&[]);
    let recordings: Vec<_> = trials
        .iter()
        .map(|trial| {
            let mut recording =
                Recording::new(&model, &shape, &testkit::shared::trial(folder, trial), 4).unwrap();
            recording.poses.truncate(frames);
            (recording, limbs)
        })
        .collect();
    let exact = run_all(&model, &shape, &recordings, Method::all, &|seen, _, _| seen).unwrap();
    let noisy = run_all(&model, &shape, &recordings, Method::all, &noisy).unwrap();
    [means(&format!("{limbs:?}"), &exact), means(&format!("{limbs:?}, noisy"), &noisy)]
}

#[test]
fn images_find_elbows_of_a_boxer() {
    let Some(folder) = testkit::shared::find("data/motion/five-actions", "images_find_elbows_of_a_boxer")
    else {
        return;
    };
    // tuned on 13_17
    let [exact, noisy] = evaluate(&folder, Limbs::Arms, &["14_02"], 400);
    assert!(exact[3].max(exact[4]) < 0.5 * exact[1].min(exact[2]) && exact[5] < 10.0, "{exact:?}");
    assert!(noisy[3].max(noisy[4]) < 0.5 * noisy[1].min(noisy[2]) && noisy[5] < 15.0, "{noisy:?}");
}

#[test]
fn images_find_knees_of_walkers() {
    let Some(folder) = testkit::shared::find("data/motion/five-actions", "images_find_knees_of_walkers")
    else {
        return;
    };
    // tuned on 07_01
    let trials = ["05_01", "08_01", "16_15", "16_17", "35_01"];
    let [exact, noisy] = evaluate(&folder, Limbs::Legs, &trials, 100);
    // knees are nearly straight: plain inverse kinematics is not far off
    assert!(exact[3].max(exact[4]) < exact[0] && exact[5] < exact[1].min(10.0), "{exact:?}");
    assert!(noisy[3] < noisy[0] && noisy[5] < noisy[1].min(12.0), "{noisy:?}");
}
