use std::collections::{BTreeMap, BTreeSet};

use jobs::PointChoice;
use model::counted;
use serde::Deserialize;
use utoipa::ToSchema;

use crate::error::{Error, Result};

/// Most names in a mapping.
const MAX_NAMES: usize = 256;
/// Numbers of control points that can be reconstructed from.
const POINTS: std::ops::RangeInclusive<usize> = 2..=16;

/// Which control points are used, and which markers of the file make them.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(default)]
pub(super) struct MarkerFields {
    /// control points to use, by name; all that the files have when left out
    #[schema(example = json!(["left_wrist", "right_wrist", "left_ankle", "right_ankle"]))]
    pub points: Vec<String>,
    /// name in the file -> name of a control point or joint, for files with marker names of their own
    #[schema(example = json!({"LWRA": "left_wrist"}))]
    pub mapping: BTreeMap<String, String>,
    /// marker set whose names the file has: `auto` to find out, `none` if they are names of control points, or a preset
    /// such as `plug-in-gait`; `auto` when left out
    #[schema(example = "auto")]
    pub marker_set: Option<String>,
    /// a marker map (TOML): which markers make which control point, with offsets and standard deviations
    #[schema(example = "[points]\nleft_wrist = [\"LWRA\", \"LWRB\"]\nhead = \"TOP\"\n")]
    pub marker_map: Option<String>,
    /// what the names of the performer's markers begin with, where a file has several people
    #[schema(example = "Anna:")]
    pub marker_prefix: Option<String>,
}

impl From<MarkerFields> for PointChoice {
    fn from(fields: MarkerFields) -> Self {
        let MarkerFields { points, mapping, marker_set, marker_map, marker_prefix } = fields;
        Self { points, mapping, marker_set, marker_map, marker_prefix }
    }
}

impl MarkerFields {
    /// Refuses points that can't be used, and markers that are given in several ways or in one that makes no sense.
    pub fn check(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        if self.mapping.len() > MAX_NAMES {
            return refuse(format!("mapping has {} names, expected at most {MAX_NAMES}", self.mapping.len()));
        }
        let is_empty = |name: &String| name.trim().is_empty();
        if self.mapping.iter().any(|(name, point)| is_empty(name) || is_empty(point)) {
            return refuse("mapping has an empty name".into());
        }
        if self.points.iter().any(is_empty) {
            return refuse("points has an empty name".into());
        }
        self.check_markers()?;
        if self.points.is_empty() {
            return Ok(());
        }
        if !POINTS.contains(&self.points.len()) {
            return refuse(format!("points has {}, expected 2 to 16", counted(self.points.len(), "name")));
        }
        let mut seen = BTreeSet::new();
        match self.points.iter().find(|name| !seen.insert(*name)) {
            Some(twice) => refuse(format!("points has {twice:?} twice, expected every point once")),
            None => Ok(()),
        }
    }

    fn check_markers(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::Unprocessable(what));
        let set = self.marker_set.as_deref().filter(|set| *set != "auto");
        let ways = [!self.mapping.is_empty(), self.marker_map.is_some(), set.is_some()];
        if ways.iter().filter(|is_given| **is_given).count() > 1 {
            return refuse("expected one of mapping, marker_map and marker_set, found several".into());
        }
        let checked = match (&self.marker_map, set) {
            (Some(text), _) => markers::MarkerMap::parse(text).map(drop),
            (None, Some(set)) if set != "none" => markers::preset(set).map(drop),
            _ if self.marker_prefix.is_some() => {
                return refuse("marker_prefix needs a marker_map, or a marker_set by name".into());
            }
            _ => Ok(()),
        };
        checked.map_err(|error| Error::Unprocessable(error.to_string()))
    }
}
