//! Bodies by measurements, of the shipped model.

use body::{BodyModel, Sex, Wanted};

#[test]
fn bodies_have_the_measurements_asked_for() {
    let model = &BodyModel::shipped();
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
    assert_eq!(error.to_string(), "stature_m is 17.8 m, expected 1 to 2.4 m");
    let error = Wanted { mass_kg: Some(1e308), ..Wanted::default() }.check().unwrap_err();
    assert_eq!(error.to_string(), "mass_kg is 1e308 kg, expected 20 to 250 kg");
    assert_eq!(model.alpha_for(&Wanted::default()).unwrap(), vec![0.0; 20]);
}

#[test]
fn age_and_sex_asked_for_change_the_body() {
    let model = &BodyModel::shipped();
    let body = |sex| {
        let wanted = Wanted { stature_m: Some(1.7), mass_kg: Some(68.0), sex: Some(sex), age_years: None };
        model.shape(&model.alpha_for(&wanted).unwrap()).measurements(model)
    };
    let (man, woman) = (body(Sex::Male), body(Sex::Female));
    assert!(woman.hip_m - woman.waist_m > man.hip_m - man.waist_m + 0.03, "{woman:?} {man:?}");
}
