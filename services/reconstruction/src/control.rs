//! Which trajectories of a file are the control points, and which points of the skeleton they are.

use crate::error::InputError;
use jobs::PointChoice;
use kinematics::ControlPoint;
use markers::MarkerMap;
use model::{PointTrajectories, Skeleton};
use nalgebra::Vector3;
use sparse::control_points;
use std::collections::BTreeMap;

/// What the markers of a file are.
#[derive(Debug, Clone, Default)]
pub(crate) enum Markers {
    /// Control points if they are called so, else of the preset that their names belong to.
    #[default]
    Auto,
    /// Control points under their own names.
    AsNamed,
    /// Name in the file → name of a control point or joint; the mean where several lead to one.
    Pairs(BTreeMap<String, String>),
    /// Those of a preset; what is not in the file is left out.
    Preset(MarkerMap),
    /// Those of a map that the user wrote; everything in it must be in the file.
    Map(MarkerMap),
}

impl Markers {
    /// From what a run was asked for.
    ///
    /// # Errors
    /// If the map or the set is none.
    pub fn new(choice: &PointChoice) -> Result<Self, InputError> {
        let with_prefix = |mut map: MarkerMap| {
            map.prefix = choice.marker_prefix.clone().or(map.prefix);
            map
        };
        Ok(match (choice.marker_map.as_deref(), choice.marker_set.as_deref()) {
            _ if !choice.mapping.is_empty() => Self::Pairs(choice.mapping.clone()),
            (Some(text), _) => Self::Map(with_prefix(MarkerMap::parse(text)?)),
            (None, None | Some("auto")) => Self::Auto,
            (None, Some("none")) => Self::AsNamed,
            (None, Some(name)) => Self::Preset(with_prefix(markers::preset(name)?.clone())),
        })
    }
}

/// Control points with their trajectories.
pub(crate) struct Chosen {
    pub points: Vec<ControlPoint>,
    pub trajectories: PointTrajectories,
}

/// Finds the control points among a file's trajectories. `wanted`: their names; empty: all.
///
/// # Errors
/// If names stand for nothing, or for more than one thing.
pub(crate) fn choose(
    file: &str,
    trajectories: PointTrajectories,
    markers: &Markers,
    wanted: &[String],
    skeleton: &Skeleton,
    warnings: &mut Vec<String>,
) -> Result<Chosen, InputError> {
    let in_file = |source| InputError::Markers { file: file.to_owned(), source };
    let names = trajectories.names();
    let (map, must_have) = match markers {
        Markers::AsNamed => return as_named(file, trajectories, wanted, skeleton, warnings),
        Markers::Auto if has_control_points(names, skeleton) => {
            return as_named(file, trajectories, wanted, skeleton, warnings);
        }
        Markers::Auto => {
            let found = detected(file, names, warnings);
            (
                found
                    .map_err(|source| one_point(file, names, skeleton).unwrap_or_else(|| in_file(source)))?,
                false,
            )
        }
        Markers::Pairs(pairs) => (from_pairs(pairs, names, wanted, file)?, true),
        Markers::Preset(map) => (map.clone(), false),
        Markers::Map(map) => (map.clone(), true),
    };
    let all: Vec<String> = map.points().map(|p| p.name.clone()).collect();
    let asked = if wanted.is_empty() && must_have { &all[..] } else { wanted };
    let mapped = map.apply(&trajectories, asked).map_err(in_file)?;
    warnings.extend(mapped.warnings.iter().map(|warning| format!("{file}: {warning}")));

    // In the order asked for, or else of the file.
    let mut names: Vec<String> = mapped.trajectories.names().to_vec();
    if wanted.is_empty() {
        let first = |name: &String| {
            let point = mapped.points.iter().find(|p| p.name == *name);
            point.and_then(|p| p.markers.iter().filter_map(|m| trajectories.point_index(m)).min())
        };
        names.sort_by_key(first);
    } else {
        names = wanted.to_vec();
    }
    let mut points = control_points(skeleton, &names)?;
    for point in &mut points {
        if let Some(made) = mapped.points.iter().find(|p| p.name == point.name) {
            point.offset += Vector3::from(made.offset_m);
        }
    }
    Ok(Chosen { points, trajectories: mapped.trajectories })
}

fn as_named(
    file: &str,
    trajectories: PointTrajectories,
    wanted: &[String],
    skeleton: &Skeleton,
    warnings: &mut Vec<String>,
) -> Result<Chosen, InputError> {
    warnings.extend(markers::upside_down(&trajectories).map(|warning| format!("{file}: {warning}")));
    let names = if wanted.is_empty() { trajectories.names() } else { wanted };
    Ok(Chosen { points: control_points(skeleton, names)?, trajectories })
}

/// Whether the file's names are meant as control points: two of them are.
fn has_control_points(names: &[String], skeleton: &Skeleton) -> bool {
    names.iter().filter(|name| control_points(skeleton, &[name]).is_ok()).count() >= 2
}

/// What is wrong with a file that has one control point under its own name, where it has no marker set either.
fn one_point(file: &str, names: &[String], skeleton: &Skeleton) -> Option<InputError> {
    let point = names.iter().find(|name| control_points(skeleton, &[name]).is_ok())?;
    let others = match names.len() - 1 {
        0 => String::new(),
        1 => " and a trajectory of another name".to_owned(),
        others => format!(" and {others} trajectories of other names"),
    };
    Some(InputError::OnePoint { file: file.to_owned(), point: point.clone(), others })
}

fn detected(file: &str, names: &[String], warnings: &mut Vec<String>) -> markers::Result<MarkerMap> {
    let fit = markers::detect(names)?;
    warnings.push(format!(
        "{file}: its markers are taken for the set {}, which has {} of {} control points here; \
         `marker_set` says another",
        fit.label(),
        fit.num_any(),
        fit.points.len()
    ));
    Ok(fit.with_prefix())
}

/// Pairs as a map, with the points that are wanted and that the file has under their own names. Markers may be named without
/// their prefix.
fn from_pairs(
    pairs: &BTreeMap<String, String>,
    names: &[String],
    wanted: &[String],
    file: &str,
) -> Result<MarkerMap, InputError> {
    let mut markers = Vec::with_capacity(pairs.len());
    for (name, point) in pairs {
        let found = markers::find_name(name, names)
            .map_err(|source| InputError::Markers { file: file.to_owned(), source })?;
        let Some(marker) = found else {
            let has = names.join(", ");
            return Err(InputError::Mapping { name: name.clone(), file: file.to_owned(), has });
        };
        markers.push((marker, point.as_str()));
    }
    let is_mapped = |name: &String| markers.iter().any(|(marker, _)| marker == name);
    if let Some(name) = pairs.values().find(|name| names.contains(name) && !is_mapped(name)) {
        return Err(InputError::MappedTwice { name: name.clone(), file: file.to_owned() });
    }
    let own =
        wanted.iter().filter(|name| names.contains(name) && !pairs.values().any(|point| point == *name));
    let own = own.map(|name| (name.as_str(), name.as_str()));
    Ok(MarkerMap::from_pairs(markers.into_iter().chain(own)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_control_point_is_called_so() {
        let model = body::BodyModel::shipped();
        let skeleton = model.skeleton(&model.shape(&[])).unwrap();
        let error = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            let nothing = vec![Vector3::zeros(); 2 * names.len()];
            let trajectories = PointTrajectories::new(names, 60.0, nothing).unwrap();
            let chosen = choose("a.csv", trajectories, &Markers::Auto, &[], &skeleton, &mut Vec::new());
            chosen.err().unwrap().to_string()
        };
        assert_eq!(
            error(&["left_wrist"]),
            "a.csv has 1 control point (left_wrist), expected 2 to 16 (a marker map may make them: --map FILE)"
        );
        let two = error(&["tail", "left_wrist"]);
        assert!(
            two.contains("1 control point (left_wrist) and a trajectory of another name, expected"),
            "{two}"
        );
        assert!(error(&["tail"]).contains("match no known marker set"));
    }
}
