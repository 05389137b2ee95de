use crate::extremes::heights;
use crate::{BodyModel, DENSITY_KG_M3, Limb, Shape};

/// Sizes of a body in its rest pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurements {
    /// from the lowest to the highest vertex, metres
    pub stature_m: f64,
    /// volume times [`DENSITY_KG_M3`], kilograms
    pub mass_kg: f64,
    /// from fingertip to fingertip with the arms stretched sideways: along the bones, metres
    pub arm_span_m: f64,
    /// from the floor to the crotch, metres
    pub inseam_m: f64,
    /// girth a third of the way from the chest joint up to the neck, without the arms, metres
    pub chest_m: f64,
    /// smallest girth between pelvis and chest joints, metres
    pub waist_m: f64,
    /// largest girth between the crotch and a hand's breadth above the pelvis joint, metres
    pub hip_m: f64,
}

impl Shape {
    /// Measures the body. Girths are those of a tape: of the convex hull of a horizontal section.
    pub fn measurements(&self, model: &BodyModel) -> Measurements {
        let [low, high] = heights(&self.vertices);
        let joint = |name: &str| model.rig().joint_index(name).map(|joint| self.joints[joint]);
        let pelvis = self.joints[0];
        let chest = joint("chest").map_or(low + 0.66 * (high - low), |chest| chest.y);
        let neck = joint("neck").map_or(low + 0.85 * (high - low), |neck| neck.y);
        let crotch = self.crotch(model, low);
        let girth = |height: f64| self.girth(model, height);
        let levels = |from: f64, to: f64| (0..=30).map(move |i| from + (to - from) * f64::from(i) / 30.0);
        Measurements {
            stature_m: high - low,
            mass_kg: self.mesh(model).volume() * DENSITY_KG_M3,
            arm_span_m: self.arm_span(model),
            inseam_m: crotch - low,
            chest_m: girth(chest + (neck - chest) / 3.0),
            waist_m: levels(pelvis.y, chest).map(girth).fold(f64::INFINITY, f64::min),
            hip_m: levels(crotch, pelvis.y + 0.1).map(girth).fold(0.0, f64::max),
        }
    }

    /// Height of the lowest point between the legs.
    fn crotch(&self, model: &BodyModel, low: f64) -> f64 {
        let pelvis = self.joints[0];
        let is_shin = |limb| matches!(limb, Limb::LeftLowerLeg | Limb::RightLowerLeg);
        let between = self.vertices.iter().zip(model.limbs());
        let heights = between
            .filter(|(vertex, limb)| (vertex.x - pelvis.x).abs() < 0.015 && !is_shin(**limb))
            .map(|(vertex, _)| vertex.y);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        if lowest.is_finite() { lowest } else { low }
    }

    fn arm_span(&self, model: &BodyModel) -> f64 {
        let arm = |side: &str| {
            let [shoulder, elbow, wrist] =
                ["shoulder", "elbow", "wrist"].map(|name| model.rig().joint_index(&format!("{side}_{name}")));
            let (shoulder, elbow, wrist) = (shoulder?, elbow?, wrist?);
            let vertices = self.vertices.iter().zip(model.skin().joints());
            let hand = vertices
                .filter(|(_, joints)| usize::from(joints[0]) == wrist)
                .map(|(vertex, _)| (vertex - self.joints[wrist]).norm())
                .fold(0.0, f64::max);
            let [s, e, w] = [shoulder, elbow, wrist].map(|joint| self.joints[joint]);
            Some(((e - s).norm() + (w - e).norm() + hand, s))
        };
        match (arm("l"), arm("r")) {
            (Some((left, a)), Some((right, b))) => left + right + (a - b).norm(),
            _ => 0.0,
        }
    }

    /// Length of a tape around trunk and thighs at a height, metres.
    fn girth(&self, model: &BodyModel, height: f64) -> f64 {
        let limbs = model.limbs();
        let is_trunk = |&corner: &u32| {
            matches!(limbs[corner as usize], Limb::Torso | Limb::LeftUpperLeg | Limb::RightUpperLeg)
        };
        let mut section = Vec::new();
        for face in model.faces().iter().filter(|face| face.iter().all(is_trunk)) {
            let corners = face.map(|corner| self.vertices[corner as usize]);
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
                if (a.y < height) != (b.y < height) {
                    let on = a + (b - a) * ((height - a.y) / (b.y - a.y));
                    section.push([on.x, on.z]);
                }
            }
        }
        hull_length(section)
    }
}

/// Length of the convex hull of points of a plane (Andrew's monotone chain).
fn hull_length(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..] {
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum::<f64>()
    };
    chain(&mut points.iter().copied()) + chain(&mut points.iter().rev().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tape_around_a_square_with_a_dent_is_as_long_as_around_the_square() {
        let points = vec![[0.0, 0.0], [1.0, 0.0], [0.5, 0.5], [1.0, 1.0], [0.0, 1.0], [0.9, 0.5], [0.5, 0.0]];
        assert!((hull_length(points) - 4.0).abs() < 1e-12);
        assert_eq!(hull_length(Vec::new()), 0.0);
    }
}
