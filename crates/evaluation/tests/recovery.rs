//! Disturbed poses are found again, and by whom.

use body::BodyModel;
use evaluation::recovery::{Limbs, Method, Setting, WITH_PRIOR, recover};
use tracking::built_in_poses;
use vision::scene::Ring;

#[test]
fn particles_find_arms_that_local_optimisation_does_not_whatever_the_number_of_threads() {
    let model = BodyModel::shipped();
    let training = built_in_poses(&model);
    let cameras = Ring { cameras: 4, size: 502, focal: 663.0, ..Ring::default() }.cameras();
    let poses: Vec<_> = training.iter().step_by(18).cloned().collect();
    let setting = Setting {
        model: &model,
        cameras: &cameras,
        is_noisy: false,
        poses: &poses,
        limbs: Limbs::Arm,
        turned_rad: 1.0,
        seed: 3,
    };
    let methods: Vec<_> = Method::all(&training, None)
        .into_iter()
        .filter(|method| ["local only", WITH_PRIOR, "all of Marey"].contains(&method.name))
        .collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| recover(&setting, &methods, &|| ()).unwrap())
    };
    let found = run(1);
    let counts: Vec<usize> =
        found.iter().map(|starts| starts.iter().filter(|start| start.is_found()).count()).collect();
    println!("of {}: {counts:?}", poses.len());
    assert!(found.iter().all(|starts| starts.len() == poses.len()));
    // the tables' own poses, so the prior knows them
    assert!(counts[1] > counts[0] && counts[2] > counts[0] && counts[2] + 2 >= poses.len(), "{counts:?}");
    assert_eq!(run(3), found);
}

#[test]
fn limbs_have_four_dofs_each() {
    let model = BodyModel::shipped();
    let count = |limbs: Limbs| limbs.dofs(&model).len();
    assert_eq!([Limbs::Arm, Limbs::Arms, Limbs::Leg, Limbs::All].map(count), [4, 8, 4, 16]);
}
