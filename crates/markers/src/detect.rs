//! Which preset a file's names belong to.

use crate::{Error, MarkerMap, Result, names::FileNames, names::prefixes, presets::presets};

/// Fewest control points that a preset must give to be taken unasked.
const MIN_POINTS: usize = 3;
/// Presets that give as many points and whose names agree within this (0 to 1) with the file's are rivals.
const CLOSE: f64 = 0.1;

/// How well a file's names go with a map.
#[derive(Debug, Clone)]
pub struct Fit<'a> {
    /// the map
    pub map: &'a MarkerMap,
    /// what the names begin with
    pub prefix: String,
    /// its control points
    pub points: Vec<PointFit>,
    /// names of the file with this prefix
    pub num_names: usize,
    /// of these, names that the map knows
    pub num_known: usize,
    /// agreement of the two lists of names: twice what they share over both their lengths, 0 to 1
    pub agreement: f64,
}

/// What of a control point is in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct PointFit {
    /// the control point
    pub name: String,
    /// columns of its best choice that the file has
    pub found: Vec<usize>,
    /// markers of that choice that the file lacks
    pub missing: Vec<String>,
}

impl Fit<'_> {
    /// Control points of which the file has all markers.
    pub fn num_whole(&self) -> usize {
        self.points.iter().filter(|p| p.missing.is_empty()).count()
    }

    /// Control points of which the file has any marker.
    pub fn num_any(&self) -> usize {
        self.points.iter().filter(|p| !p.found.is_empty()).count()
    }

    /// The map's name, and the prefix where there is one: `plug-in-gait for Anna:`.
    pub fn label(&self) -> String {
        if self.prefix.is_empty() {
            return self.map.name.clone();
        }
        format!("{} for {}", self.map.name, self.prefix)
    }

    /// The map with this prefix.
    pub fn with_prefix(&self) -> MarkerMap {
        MarkerMap { prefix: Some(self.prefix.clone()), ..self.map.clone() }
    }

    /// Whether the same columns make the same points in both.
    fn is_same(&self, other: &Self) -> bool {
        let found =
            |fit: &Self| -> Vec<_> { fit.points.iter().map(|p| (p.name.clone(), p.found.clone())).collect() };
        found(self) == found(other)
    }
}

/// How well the names go with a map under a prefix.
fn fit<'a>(map: &'a MarkerMap, names: &[String], prefix: &str) -> Fit<'a> {
    let file = FileNames::new(names, prefix);
    // an ambiguous name does not match
    let find = |name: &String| file.find(name).ok().flatten();
    let point = |point: &crate::Point| {
        let choices = point.choices.iter().map(|group| PointFit {
            name: point.name.clone(),
            found: group.markers.iter().filter_map(find).collect(),
            missing: group.markers.iter().filter(|n| find(n).is_none()).cloned().collect(),
        });
        // the first whole one, else the one of which most is there
        let best = choices.min_by_key(|c| match c.missing.is_empty() {
            true => (false, std::cmp::Reverse(0)),
            false => (true, std::cmp::Reverse(c.found.len())),
        });
        best.unwrap_or(PointFit { name: point.name.clone(), found: Vec::new(), missing: Vec::new() })
    };
    let num_known = map.markers.iter().filter(|name| find(name).is_some()).count();
    let lengths = (file.len() + map.markers.len()).max(1);
    Fit {
        map,
        prefix: prefix.to_owned(),
        points: map.points().map(point).collect(),
        num_names: file.len(),
        num_known,
        agreement: 2.0 * num_known as f64 / lengths as f64,
    }
}

/// All presets under all prefixes of the file that give a point, the best first.
pub fn fits(names: &[String]) -> Vec<Fit<'static>> {
    let prefixes = prefixes(names);
    let all = presets().iter().flat_map(|map| prefixes.iter().map(move |prefix| fit(map, names, prefix)));
    let mut fits: Vec<_> = all.filter(|fit| fit.num_any() > 0).collect();
    // stable: what is as good stays in the order of the presets
    fits.sort_by(|a, b| {
        let points = (b.num_whole(), b.num_any()).cmp(&(a.num_whole(), a.num_any()));
        points.then(b.agreement.total_cmp(&a.agreement))
    });
    fits
}

/// The preset that the names of a file belong to.
///
/// # Errors
/// If none gives three control points, or several would do and make different points.
pub fn detect(names: &[String]) -> Result<Fit<'static>> {
    let mut fits = fits(names);
    let Some(best) = fits.first().filter(|fit| fit.num_whole() >= MIN_POINTS).cloned() else {
        let nearest = fits.first().map(|fit| {
            format!("the closest, {}, makes {} of the control points", fit.label(), fit.num_whole())
        });
        return Err(Error::Unknown {
            nearest: nearest.unwrap_or_else(|| "no set has any of them".to_owned()),
        });
    };
    fits.retain(|fit| is_rival(fit, &best));
    if fits.is_empty() {
        return Ok(best);
    }
    let candidates = std::iter::once(&best).chain(&fits).map(Fit::label).collect::<Vec<_>>().join(", ");
    Err(Error::Ambiguous { candidates })
}

/// Whether the one could be meant as well as the best: another person, or another set that is as good and differs.
fn is_rival(fit: &Fit<'_>, best: &Fit<'_>) -> bool {
    if fit.map.name == best.map.name && fit.prefix == best.prefix || fit.is_same(best) {
        return false;
    }
    let is_other_person = fit.map.name == best.map.name && fit.num_whole() >= MIN_POINTS;
    let is_as_good = fit.num_whole() == best.num_whole() && fit.agreement > best.agreement - CLOSE;
    is_other_person || is_as_good
}

/// The prefix under which a file has the markers of a map.
///
/// # Errors
/// If several do as well.
pub(crate) fn best_prefix(map: &MarkerMap, names: &[String]) -> Result<String> {
    let mut fits: Vec<_> = prefixes(names).iter().map(|prefix| fit(map, names, prefix)).collect();
    fits.sort_by_key(|fit| std::cmp::Reverse((fit.num_whole(), fit.num_any())));
    let Some(best) = fits.first().cloned() else { return Ok(String::new()) };
    let people: Vec<_> = fits
        .iter()
        .filter(|f| {
            f.num_any() > 0 && f.num_any() == best.num_any() && (f.prefix == best.prefix || !f.is_same(&best))
        })
        .map(|f| format!("{:?}", f.prefix))
        .collect();
    if people.len() > 1 {
        return Err(Error::Ambiguous { candidates: format!("the prefixes {}", people.join(", ")) });
    }
    Ok(best.prefix)
}
