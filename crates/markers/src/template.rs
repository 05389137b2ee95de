use std::fmt::Write;

use crate::{Fit, STANDARD, standard_names};

/// A map to begin with, for people to edit: what the fit found in the file, and all names of the file. Without a fit every
/// point is left to be filled in, but for those that the file has under their own names.
pub fn template(names: &[String], fit: Option<&Fit<'_>>) -> String {
    let mut out = String::from(
        "# Marker map. Each control point is the mean of its markers. Names are without the prefix.\n",
    );
    let own = if fit.is_none() { standard_names(names) } else { Vec::new() };
    // Writing to a string cannot fail.
    let _ = match fit {
        Some(fit) => {
            writeln!(out, "# Made from the marker set {}.\nprefix = {}", fit.map.name, quoted(&fit.prefix))
        }
        None if !own.is_empty() => writeln!(
            out,
            "# The file holds control points under the standard names: it can be used without a map.\n\
             prefix = \"\""
        ),
        None => writeln!(out, "# No known marker set fits: fill in the names.\nprefix = \"\""),
    };
    out.push_str(
        "# How far a point may be off, standard deviation of each coordinate.\nsigma_mm = 15\n\n[points]\n",
    );
    out.push_str(
        "# offset_mm: from the joint to the mean of the markers in the skeleton's rest pose: left, up, forward\n",
    );
    let mut written = Vec::new();
    for point in
        fit.iter().flat_map(|fit| fit.points.iter().filter(|p| !p.found.is_empty()).map(move |p| (fit, p)))
    {
        let (fit, point) = point;
        let prefix = fit.prefix.as_str();
        let found: Vec<_> = point.found.iter().map(|i| &names[*i]).collect();
        let markers = found.iter().map(|n| quoted(n.strip_prefix(prefix).unwrap_or(n)));
        let markers = markers.collect::<Vec<_>>().join(", ");
        let choices = fit.map.point(&point.name).map(|p| p.choices.as_slice()).unwrap_or_default();
        let is_chosen = |c: &&crate::Group| c.markers.len() == point.found.len() + point.missing.len();
        let group =
            choices.iter().find(|c| is_chosen(c) && point.missing.iter().all(|m| c.markers.contains(m)));
        let mut further = String::new();
        if let Some(group) = group {
            if group.weights.iter().any(|w| *w != group.weights[0]) && point.missing.is_empty() {
                let _ = write!(further, ", weights = {:?}", group.weights);
            }
            if group.offset_m != [0.0; 3] {
                let [x, y, z] = group.offset_m.map(|v| (v * 1e6).round() / 1e3);
                let _ = write!(further, ", offset_mm = [{x}, {y}, {z}]");
            }
            if let Some(sigma) = group.sigma_m {
                let _ = write!(further, ", sigma_mm = {}", (sigma * 1e6).round() / 1e3);
            }
        }
        let _ = writeln!(out, "{} = {{ markers = [{markers}]{further} }}", key(&point.name));
        written.push(point.name.as_str());
    }
    for name in own {
        let _ = writeln!(out, "{name} = {{ markers = [{}] }}", quoted(name));
        written.push(name);
    }
    for name in STANDARD.iter().filter(|name| !written.contains(name)) {
        let _ = writeln!(out, "# {name} = [\"\", \"\"]");
    }
    out.push_str("\n# All markers of the file:\n");
    for name in names {
        let _ = writeln!(out, "#   {}", name.escape_default());
    }
    out
}

fn key(name: &str) -> String {
    let is_bare =
        !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    if is_bare { name.to_owned() } else { quoted(name) }
}

/// A TOML string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
