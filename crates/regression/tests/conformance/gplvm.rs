//! Training, files and the prior of the latent variable model.

use std::ops::ControlFlow;

use crate::examples::{Case, model, motion, training_set};
use regression::gplvm::{Gplvm, GplvmParameters, GplvmPredictor, TrainingOptions, TrainingSet, train};
use regression::{Error, Parameters, Prediction, Predictor};

const OPTIONS: TrainingOptions = TrainingOptions { latent_dims: 2, active: 24, max_iterations: 30 };

fn go_on(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn training_gives_the_same_bits_each_time() {
    assert_eq!(model(4).to_bytes(), model(4).to_bytes());
}

#[test]
fn a_model_is_read_as_it_was_written() {
    let model = model(4);
    assert_eq!(Gplvm::from_bytes(&model.to_bytes()).unwrap(), model);
}

#[test]
fn damaged_bytes_are_refused() {
    let bytes = model(2).to_bytes();
    for cut in [0, 1, 8, 20, 60, bytes.len() - 1] {
        assert!(Gplvm::from_bytes(&bytes[..cut]).is_err(), "{cut} bytes");
    }
    for place in (0..bytes.len()).step_by(13) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 0x40;
        assert!(Gplvm::from_bytes(&damaged).is_err(), "byte {place}");
    }
    assert!(Gplvm::from_bytes(&[&bytes[..], b"more"].concat()).is_err());
}

/// A header that promises more than there is must not take memory for it.
#[test]
fn sizes_that_cannot_be_are_refused() {
    let mut bytes = model(2).to_bytes();
    for field in 0..4 {
        let mut forged = bytes.clone();
        forged[8 + 4 * field..12 + 4 * field].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(matches!(Gplvm::from_bytes(&forged), Err(Error::Bytes { .. })), "field {field}");
    }
    // With a right checksum and a number that is not finite.
    bytes.truncate(bytes.len() - 32);
    bytes[24..32].copy_from_slice(&f64::NAN.to_le_bytes());
    let checksum = blake3::hash(&bytes);
    bytes.extend_from_slice(checksum.as_bytes());
    let message = Gplvm::from_bytes(&bytes).unwrap_err().to_string();
    assert!(message.contains("NaN as number 0"), "{message}");
}

#[test]
fn training_can_be_stopped() {
    let mut stop_at_three =
        |done: usize, _: usize| if done == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let error = train(&training_set(3), &OPTIONS, &mut stop_at_three).unwrap_err();
    assert_eq!(error, Error::Stopped { iterations: 3, total: 30 });
}

#[test]
fn sets_that_cannot_be_learned_from_are_refused() {
    let few = TrainingSet { dofs: 3, poses: vec![0.0; 9], velocities: vec![0.0; 9] };
    assert!(matches!(train(&few, &OPTIONS, &mut go_on), Err(Error::TooFew { found: 3, .. })));
    let uneven = TrainingSet { velocities: vec![0.0; 8], ..few };
    assert!(matches!(train(&uneven, &OPTIONS, &mut go_on), Err(Error::Shape { .. })));
    let mut broken = training_set(3);
    broken.poses[7] = f64::NAN;
    assert!(matches!(train(&broken, &OPTIONS, &mut go_on), Err(Error::NotFinite { index: 7, .. })));
    let options = TrainingOptions { latent_dims: 9, ..OPTIONS };
    assert!(matches!(train(&training_set(3), &options, &mut go_on), Err(Error::Option { found: 9, .. })));
}

/// Poses that are all the same have one latent point, and a model.
#[test]
fn poses_that_are_all_the_same_can_be_learned_from() {
    let set = TrainingSet { dofs: 3, poses: vec![5.0; 90], velocities: vec![0.0; 90] };
    let model = train(&set, &OPTIONS, &mut go_on).unwrap();
    let out = settled(&model, &Case::spread(4, 2, 3, 0.0, 1.0));
    assert!(out.mean.iter().all(|v| (v - 5.0).abs() < 2.5), "{:?}", out.mean);
}

/// The prediction when nothing is measured, which then is the pose found.
fn settled(model: &Gplvm, case: &Case) -> Prediction {
    let mut predictor = GplvmPredictor::new(model, GplvmParameters::default());
    let mut out = Prediction::new(64, case.dofs);
    predictor.predict(&case.examples(), &case.query(), &Parameters::default(), &mut out);
    while predictor.relinearise(&out.mean.clone(), 0.0, &mut out) {}
    out
}

#[test]
fn motion_it_has_learned_is_gone_on_with() {
    let (dofs, model) = (5, model(5));
    let mut squares = 0.0;
    for step in 0..20 {
        let time = 1.03 + 0.5 * f64::from(step);
        let mut case = Case::smooth(1, 6, dofs);
        case.targets = (0..dofs).map(|d| motion(time + 0.3, d)).collect();
        case.recent =
            [0.1, 0.2].iter().flat_map(|back| (0..dofs).map(move |d| motion(time - back, d))).collect();
        let out = settled(&model, &case);
        squares += (0..dofs).map(|d| (out.mean[d] - motion(time, d)).powi(2)).sum::<f64>();
    }
    let error = (squares / (20 * dofs) as f64).sqrt();
    // The motion's own standard deviation is 15.
    assert!(error < 1.5, "{error}");
}
