//! Poses that a fit may start from: how limbs are often held. They are combined limb by limb.

use body::BodyModel;

/// Shoulder flexion, abduction and twist, and elbow flexion, degrees from the base pose.
pub const ARMS: [[f64; 4]; 11] = [
    [0.0, 0.0, 0.0, 0.0],      // relaxed, a little away from the body
    [0.0, 57.0, 0.0, -10.0],   // to the side
    [0.0, 115.0, 0.0, -8.0],   // overhead
    [85.0, -25.0, 0.0, -10.0], // forward
    [0.0, 50.0, 70.0, 76.0],   // hands up
    [0.0, -15.0, 0.0, 74.0],   // forearm forward
    [-10.0, 15.0, 25.0, 64.0], // hand on the hip
    [0.0, -25.0, 0.0, -8.0],   // hanging
    [-30.0, -18.0, 0.0, 20.0], // swung backward
    [35.0, -15.0, 0.0, 30.0],  // swung forward
    [35.0, -5.0, 0.0, 95.0],   // before the chest
];

/// Hip flexion, abduction and twist, and knee flexion, degrees from the base pose.
pub const LEGS: [[f64; 4]; 8] = [
    [0.0, 0.0, 0.0, 0.0],     // standing
    [60.0, 3.0, 0.0, 70.0],   // squatting, lunging
    [90.0, 8.0, 8.0, 100.0],  // knee up, deep squat
    [-22.0, -2.0, 0.0, 28.0], // behind
    [24.0, -4.0, 0.0, 4.0],   // a step ahead
    [-16.0, -4.0, 0.0, 10.0], // a step behind
    [0.0, 22.0, 0.0, 0.0],    // to the side
    [60.0, -3.0, 0.0, 10.0],  // kicking
];

/// Arms and legs of both sides alike: the first poses tried.
pub const WHOLE: [[usize; 2]; 10] =
    [[0, 0], [1, 0], [2, 0], [3, 0], [4, 0], [5, 0], [6, 0], [7, 0], [3, 1], [3, 2]];

/// Indices of the DOFs of the four limbs in a pose: left arm, right arm, left leg, right leg, in the order of [`ARMS`] and
/// [`LEGS`]; `None` where a rig has no such DOF.
pub fn limb_dofs(model: &BodyModel) -> [[Option<usize>; 4]; 4] {
    let dof = |name: String| model.rig().dof_index(&name);
    let limb = |side: &str, upper: &str, lower: &str| {
        let [flex, abd, twist] = ["flex", "abd", "twist"].map(|turn| dof(format!("{side}_{upper}_{turn}")));
        [flex, abd, twist, dof(format!("{side}_{lower}"))]
    };
    [
        limb("l", "shoulder", "elbow"),
        limb("r", "shoulder", "elbow"),
        limb("l", "hip", "knee"),
        limb("r", "hip", "knee"),
    ]
}

/// Puts a limb into a pose.
pub fn set_limb(pose: &mut [f64], dofs: &[Option<usize>; 4], degrees: &[f64; 4]) {
    for (dof, degrees) in dofs.iter().zip(degrees) {
        if let Some(dof) = dof {
            pose[*dof] = degrees.to_radians();
        }
    }
}
