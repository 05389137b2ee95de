//! Joints of the body beside true ones.

use anyhow::bail;
use body::BodyModel;
use nalgebra::Vector3;
use serde::Serialize;

/// Joints that the body and the truth have in common.
#[derive(Default)]
pub struct Joints {
    /// indices in the rig and in the truth, and the name
    pairs: Vec<(usize, usize, String)>,
    /// names of the others, and whose they are
    pub left_out: Vec<String>,
}

/// Distances of joints in one frame, millimetres.
#[derive(Debug, Clone, Default, Serialize)]
pub struct JointErrors {
    pub mean_mm: f64,
    pub max_mm: f64,
    pub worst_joint: String,
}

impl Joints {
    /// By name.
    pub fn new(model: &BodyModel, truth: &[(String, Vector3<f64>)]) -> anyhow::Result<Self> {
        let (mut pairs, mut left_out) = (Vec::new(), Vec::new());
        for (index, joint) in model.rig().joints().iter().enumerate() {
            match truth.iter().position(|(name, _)| *name == joint.name) {
                Some(other) => pairs.push((index, other, joint.name.clone())),
                None => left_out.push(format!("{} (of the body)", joint.name)),
            }
        }
        let is_left_out = |name: &String| model.rig().joint_index(name).is_none();
        let others = truth.iter().map(|(name, _)| name).filter(|name| is_left_out(name));
        left_out.extend(others.map(|name| format!("{name} (of the truth)")));
        if pairs.is_empty() {
            bail!(
                "no true joint has the name of a joint of the body, expected names such as pelvis or l_elbow"
            );
        }
        Ok(Self { pairs, left_out })
    }

    pub fn compare(&self, found: &[Vector3<f64>], truth: &[(String, Vector3<f64>)]) -> JointErrors {
        let mut errors = JointErrors::default();
        for (own, other, name) in &self.pairs {
            let mm = 1000.0 * (found[*own] - truth[*other].1).norm();
            errors.mean_mm += mm / self.pairs.len() as f64;
            if mm > errors.max_mm {
                (errors.max_mm, errors.worst_joint) = (mm, name.clone());
            }
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(names: &[&str]) -> Vec<(String, Vector3<f64>)> {
        names.iter().map(|name| ((*name).to_owned(), Vector3::zeros())).collect()
    }

    #[test]
    fn joints_are_compared_by_name_and_those_without_a_counterpart_are_listed() {
        let model = BodyModel::shipped();
        let truth = truth(&["nose", "l_elbow", "pelvis"]);
        let joints = Joints::new(&model, &truth).unwrap();
        assert!(joints.left_out.contains(&"nose (of the truth)".to_owned()));
        assert!(joints.left_out.contains(&"r_elbow (of the body)".to_owned()));
        assert_eq!(joints.left_out.len(), model.rig().num_joints() - 2 + 1);
        let mut found = vec![Vector3::zeros(); model.rig().num_joints()];
        found[model.rig().joint_index("l_elbow").unwrap()].x = 0.02;
        // a joint that isn't compared
        found[model.rig().joint_index("head").unwrap()].x = 9.0;
        let errors = joints.compare(&found, &truth);
        assert!((errors.mean_mm - 10.0).abs() < 1e-9 && (errors.max_mm - 20.0).abs() < 1e-9);
        assert_eq!(errors.worst_joint, "l_elbow");
    }

    #[test]
    fn no_joint_in_common_is_refused() {
        assert!(Joints::new(&BodyModel::shipped(), &truth(&["nose"])).is_err());
    }
}
