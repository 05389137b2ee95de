use std::collections::BTreeSet;

use model::PointTrajectories;
use nalgebra::Vector3;

use crate::{
    Error, Group, MarkerMap, Point, Result,
    combine::{Combined, combine},
    detect::best_prefix,
    names::FileNames,
};

/// Standard deviation of a point that lacks some of its markers in the whole file, metres: half the distance of a pair
/// on a wrist or an ankle.
const INCOMPLETE_SIGMA_M: f64 = 0.03;
/// Of a point's choices the first is taken that was measured in this part of the frames of the one measured most.
const MEASURED_SHARE: f64 = 0.8;

/// Control points made of a file's markers.
#[derive(Debug, Clone)]
pub struct Mapped {
    /// of the control points, under their names
    pub trajectories: PointTrajectories,
    /// what each is made of, in the order of the trajectories
    pub points: Vec<MappedPoint>,
    /// what was not as the map wants it
    pub warnings: Vec<String>,
}

/// What a control point is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct MappedPoint {
    /// its name
    pub name: String,
    /// markers, as the file calls them
    pub markers: Vec<String>,
    /// from the control point to the trajectory, metres, in the skeleton's rest pose: x to the left, y up, z forward
    pub offset_m: [f64; 3],
    /// frames in which it was measured
    pub measured: usize,
}

/// A choice of markers found in a file.
struct Found<'a> {
    group: &'a Group,
    /// columns of the file, and their weights
    markers: Vec<usize>,
    weights: Vec<f64>,
}

impl Found<'_> {
    fn is_whole(&self) -> bool {
        self.markers.len() == self.group.markers.len()
    }
}

impl MarkerMap {
    /// Makes control points of the markers. `points`: the ones wanted, which must be in the map; empty: all for which the
    /// file has a marker, with a warning for each of the others.
    ///
    /// # Errors
    /// If a wanted point has no marker in the file, no point has, or a name may stand for several of the file's.
    pub fn apply(&self, trajectories: &PointTrajectories, points: &[String]) -> Result<Mapped> {
        let prefix = match &self.prefix {
            Some(prefix) => prefix.clone(),
            None => best_prefix(self, trajectories.names())?,
        };
        let file = FileNames::new(trajectories.names(), &prefix);
        let mut warnings = Vec::new();
        let mut made = Vec::new();
        for point in self.points().filter(|p| points.is_empty() || points.contains(&p.name)) {
            match self.make(point, &file, trajectories, &mut warnings)? {
                Some(found) => made.push(found),
                None if points.is_empty() => {
                    warnings.push(format!("{}: none of its markers is in the file", point.name));
                }
                None => return Err(no_markers(point, trajectories)),
            }
        }
        if made.is_empty() {
            let all = self.points().flat_map(names_of).collect::<BTreeSet<_>>();
            let markers = all.into_iter().collect::<Vec<_>>().join(", ");
            let has = trajectories.names().join(", ");
            let map = if self.name.is_empty() { "the marker map" } else { &self.name }.to_owned();
            return Err(Error::NoneOfMap { map, markers, has });
        }
        let frames = trajectories.num_frames();
        let names = made.iter().map(|(point, _)| point.name.clone()).collect();
        let columns = |frame: usize| made.iter().map(move |(_, combined)| (combined, frame));
        let positions: Vec<Vector3<f64>> =
            (0..frames).flat_map(columns).map(|(c, frame)| c.positions[frame]).collect();
        let sigmas = (0..frames).flat_map(columns).map(|(c, frame)| c.sigmas[frame]).collect();
        let trajectories =
            PointTrajectories::new(names, trajectories.frame_rate(), positions)?.with_sigmas(sigmas)?;
        warnings.extend(upside_down(&trajectories));
        let points = made.into_iter().map(|(point, _)| point).collect();
        Ok(Mapped { trajectories, points, warnings })
    }

    fn make(
        &self,
        point: &Point,
        file: &FileNames<'_>,
        trajectories: &PointTrajectories,
        warnings: &mut Vec<String>,
    ) -> Result<Option<(MappedPoint, Combined)>> {
        let mut choices = Vec::new();
        for group in &point.choices {
            let found = find(group, file)?;
            if !found.markers.is_empty() {
                let sigma_m = if found.is_whole() {
                    group.sigma_m
                } else {
                    Some(group.sigma_m.map_or(INCOMPLETE_SIGMA_M, |s| s.max(INCOMPLETE_SIGMA_M)))
                };
                let combined = combine(trajectories, &found.markers, &found.weights, sigma_m);
                choices.push((found, combined));
            }
        }
        let most = choices.iter().map(|(_, c)| c.num_measured()).max().unwrap_or(0);
        let is_enough = |c: &Combined| c.num_measured() as f64 >= MEASURED_SHARE * most as f64;
        let whole = choices.iter().position(|(found, c)| found.is_whole() && is_enough(c));
        let chosen = whole.or_else(|| choices.iter().position(|(_, c)| is_enough(c)));
        let Some((found, combined)) = chosen.map(|i| choices.swap_remove(i)) else { return Ok(None) };
        let markers: Vec<String> = found.markers.iter().map(|i| trajectories.names()[*i].clone()).collect();
        if !found.is_whole() {
            warnings.push(format!(
                "{}: made from {} alone; the map lists {}",
                point.name,
                markers.join(", "),
                found.group.markers.join(", ")
            ));
        }
        let measured = combined.num_measured();
        let offset_m = found.group.offset_m;
        Ok(Some((MappedPoint { name: point.name.clone(), markers, offset_m, measured }, combined)))
    }
}

/// Less than this part of the way from the ankles to the head (or root) goes up in the median frame of somebody who lies.
const UPRIGHT: f64 = 0.3;

/// A warning if the head, or else the root, is not above the ankles: then most likely another axis is up.
pub fn upside_down(trajectories: &PointTrajectories) -> Option<String> {
    let column = |name: &str| trajectories.point_index(name);
    let (top, name) = column("head").map(|c| (c, "head")).or_else(|| column("root").map(|c| (c, "root")))?;
    let ankles: Vec<usize> = ["left_ankle", "right_ankle"].into_iter().filter_map(column).collect();
    let upright = |frame: usize| {
        let ankle = ankles.iter().find_map(|a| trajectories.position(frame, *a))?;
        let way = trajectories.position(frame, top)? - ankle;
        Some(way.y / way.norm()).filter(|share| share.is_finite())
    };
    let mut shares: Vec<f64> = (0..trajectories.num_frames()).filter_map(upright).collect();
    shares.sort_by(f64::total_cmp);
    let median = *shares.get(shares.len() / 2)?;
    (median < UPRIGHT).then(|| {
        format!("the {name} is not above the ankles in half of the frames: does another axis of the file point up?")
    })
}

fn find<'a>(group: &'a Group, file: &FileNames<'_>) -> Result<Found<'a>> {
    let mut found = Found { group, markers: Vec::new(), weights: Vec::new() };
    for (name, weight) in group.markers.iter().zip(&group.weights) {
        if let Some(index) = file.find(name)? {
            found.markers.push(index);
            found.weights.push(*weight);
        }
    }
    Ok(found)
}

fn names_of(point: &Point) -> impl Iterator<Item = &str> {
    point.choices.iter().flat_map(|group| &group.markers).map(String::as_str)
}

fn no_markers(point: &Point, trajectories: &PointTrajectories) -> Error {
    Error::NoMarkers {
        point: point.name.clone(),
        markers: names_of(point).collect::<Vec<_>>().join(", "),
        has: trajectories.names().join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(names: &[&str], row: &[f64]) -> PointTrajectories {
        let positions = row.iter().map(|x| Vector3::new(*x, 1.0, 2.0)).collect();
        PointTrajectories::new(names.iter().map(|n| (*n).to_owned()).collect(), 60.0, positions).unwrap()
    }

    fn map(text: &str) -> MarkerMap {
        MarkerMap::parse(text).unwrap()
    }

    #[test]
    fn points_are_means_of_their_markers_whatever_the_prefix() {
        let map = map("sigma_mm = 10\n[points]\nhead = 'T'\nleft_wrist = ['A', 'B']\nroot = 'nowhere'");
        let mapped = map.apply(&file(&["S:b", "S:A", "S:T"], &[2.0, 4.0, 7.0]), &[]).unwrap();
        assert_eq!(mapped.trajectories.names(), ["head", "left_wrist"]);
        assert_eq!(mapped.trajectories.position(0, 1).unwrap().x, 3.0);
        assert_eq!(mapped.trajectories.sigma(0, 1), Some(0.01));
        assert_eq!(mapped.points[1].markers, ["S:A", "S:b"]);
        assert_eq!(mapped.warnings, ["root: none of its markers is in the file"]);
        let wanted = ["root".to_owned()];
        let message = map.apply(&file(&["S:A"], &[0.0]), &wanted).unwrap_err().to_string();
        assert_eq!(message, "none of the markers of control point root (nowhere) is in the file; it has S:A");
    }

    #[test]
    fn a_file_without_any_marker_of_the_map_is_refused_with_both() {
        let map = map("[points]\nhead = 'T'\nroot = ['A', 'B']");
        let message = map.apply(&file(&["x", "y"], &[0.0, 1.0]), &[]).unwrap_err().to_string();
        assert_eq!(message, "the file has none of the marker map's markers (A, B, T); it has x, y");
        let preset = crate::preset("cmu-41").unwrap().apply(&file(&["x", "y"], &[0.0, 1.0]), &[]);
        let message = preset.unwrap_err().to_string();
        assert!(message.starts_with("the file has none of cmu-41's markers ("), "{message}");
    }

    #[test]
    fn the_first_choice_with_all_its_markers_is_taken() {
        let map = map("[points]\nhead = [{markers = ['A', 'B']}, {markers = ['A'], offset_mm = [9, 0, 0]}]");
        let offset = |names: &[&str], row: &[f64]| {
            let mapped = map.apply(&file(names, row), &[]).unwrap();
            (mapped.points[0].offset_m[0], mapped.warnings.len())
        };
        assert_eq!(offset(&["A", "B"], &[0.0, 1.0]), (0.0, 0));
        assert_eq!(offset(&["A"], &[0.0]), (0.009, 0));
        // of the pair only one, and no choice of it alone
        assert_eq!(offset(&["B"], &[0.0]), (0.0, 1));
        // a pair of which one was never measured is still seen as often as the other
        let mapped = map.apply(&file(&["A", "B"], &[0.0, f64::NAN]), &[]).unwrap();
        assert_eq!(mapped.points[0].measured, 1);
    }

    #[test]
    fn two_people_in_a_file_must_be_told_apart() {
        let text = "[points]\nhead = 'T'\nroot = 'R'";
        let both = file(&["Anna:T", "Anna:R", "Ben:T", "Ben:R"], &[0.0, 1.0, 2.0, 3.0]);
        let message = map(text).apply(&both, &[]).unwrap_err().to_string();
        assert!(message.contains("Anna:") && message.contains("Ben:"), "{message}");
        let ben = map(&format!("prefix = 'Ben:'\n{text}")).apply(&both, &[]).unwrap();
        assert_eq!(ben.trajectories.position(0, 0).unwrap().x, 2.0);
    }
}
