//! `shape.json`: the body that was found.

use body::{BodyModel, Measurements, Shape};
use serde_json::{Map, Value, json};
use shape_fit::Fit;

use crate::fit::Moment;

/// What `shape.json` says: the shape once, and pose and joints of every frame it was found from.
pub(crate) fn shape_report(
    model: &BodyModel,
    shape: &Shape,
    moments: &[Moment],
    fits: &[Fit],
    warnings: &[String],
) -> Value {
    let frames = moments.iter().zip(fits).map(|(moment, fit)| {
        let joints: Map<String, Value> = model
            .rig()
            .joints()
            .iter()
            .zip(&fit.joints)
            .map(|(joint, place)| (joint.name.clone(), json!([place.x, place.y, place.z])))
            .collect();
        let pose: Map<String, Value> = model
            .rig()
            .dofs()
            .iter()
            .zip(&fit.pose)
            .map(|(dof, value)| (dof.name.clone(), json!(value)))
            .collect();
        let views = fit.views.iter();
        let views = views.map(|v| json!({ "camera": v.camera, "overlap": v.iou, "is_used": v.is_used }));
        json!({
            "frame": moment.frame,
            "confidence": fit.confidence,
            "joints_m": joints,
            "pose": pose,
            "views": views.collect::<Vec<_>>(),
        })
    });
    json!({
        "alpha": shape.alpha,
        "measurements": measurements(&shape.measurements(model)),
        "confidence": fits.iter().map(|fit| fit.confidence).fold(f64::INFINITY, f64::min),
        "frames": frames.collect::<Vec<_>>(),
        "warnings": warnings,
    })
}

fn measurements(m: &Measurements) -> Value {
    json!({
        "stature_m": m.stature_m,
        "mass_kg": m.mass_kg,
        "arm_span_m": m.arm_span_m,
        "inseam_m": m.inseam_m,
        "chest_m": m.chest_m,
        "waist_m": m.waist_m,
        "hip_m": m.hip_m,
    })
}
