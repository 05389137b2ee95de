use std::collections::BTreeMap;

/// Which markers make which control points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarkerMap {
    /// what the map is called; empty if it does not say
    pub name: String,
    /// other names of the same marker set
    pub aliases: Vec<String>,
    /// one line about the marker set
    pub description: String,
    /// what all names of the file begin with, `None` to find out: `Subject:`
    pub prefix: Option<String>,
    /// every marker of the set, those too that make no control point: by them it is told from other sets
    pub markers: Vec<String>,
    pub(crate) points: BTreeMap<String, Point>,
}

/// A control point and the markers it may be made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// of a control point, a joint, or `joint.tip`
    pub name: String,
    /// the first of which the file has all markers is taken
    pub choices: Vec<Group>,
}

/// Markers whose weighted mean is a point fixed to a bone.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// their names, without the file's prefix
    pub markers: Vec<String>,
    /// one for each marker; they sum to 1
    pub weights: Vec<f64>,
    /// from the control point to the mean of the markers, metres, in the skeleton's rest pose: x to the left, y up, z
    /// forward
    pub offset_m: [f64; 3],
    /// standard deviation of each coordinate, metres; `None` for the run's default
    pub sigma_m: Option<f64>,
}

impl MarkerMap {
    /// A map of markers to control points by name: the points are the means of the markers given for them, exactly in
    /// the joint, as sure as the file says.
    pub fn from_pairs<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        let mut markers = BTreeMap::<&str, Vec<String>>::new();
        for (marker, point) in pairs {
            markers.entry(point).or_default().push(marker.to_owned());
        }
        let point = |(name, markers): (&str, Vec<String>)| {
            let point = Point { name: name.to_owned(), choices: vec![Group::mean(markers)] };
            (name.to_owned(), point)
        };
        Self {
            points: markers.into_iter().map(point).collect(),
            prefix: Some(String::new()),
            ..Self::default()
        }
    }

    /// The control points, in order of name.
    pub fn points(&self) -> impl Iterator<Item = &Point> {
        self.points.values()
    }

    /// The control point of that name.
    pub fn point(&self, name: &str) -> Option<&Point> {
        self.points.get(name)
    }
}

impl Group {
    /// The plain mean of markers, in the joint.
    pub(crate) fn mean(markers: Vec<String>) -> Self {
        let weights = vec![1.0 / markers.len().max(1) as f64; markers.len()];
        Self { markers, weights, offset_m: [0.0; 3], sigma_m: None }
    }
}
