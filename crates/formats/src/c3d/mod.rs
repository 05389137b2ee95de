//! C3D: marker trajectories in binary, as motion capture systems write them.

mod bytes;
mod frames;
mod header;
mod parameters;
mod write;

use model::{Axis, PointTrajectories, counted};

use crate::{
    Error, Place, PointsOptions, Read, Result, error::at_byte, points, points::PointNames, read::Warnings,
    text::quote,
};
pub use write::write;

use header::Header;
use parameters::Parameters;

/// Residuals above this are not believed: cameras don't err so, but files with arbitrary scales say it. Metres.
const MAX_RESIDUAL: f64 = 0.1;

/// Reads marker trajectories; analog channels are skipped.
///
/// Samples with a negative residual, that are not finite, or at exactly 0 0 0 are missing. Up is the axis of
/// `POINT:Y_SCREEN` (its sign is not: files with z up say `-Z` too), else z. A residual above the options' `sigma_m`, and
/// of at most 10 cm, is the standard deviation of its sample.
///
/// # Errors
/// If the header, a parameter or the data is not as the format wants it, or ends early.
pub fn read(bytes: &[u8], options: &PointsOptions) -> Result<Read<PointTrajectories>> {
    let mut warnings = Warnings::default();
    let (processor, parameters) = Parameters::read(bytes)?;
    let header = Header::read(bytes, processor, &parameters, &mut warnings)?;
    let place = |name| parameters.get("POINT", name).map_or(Place::File, |p| Place::Byte(p.offset));
    let unit = parameters.get("POINT", "UNITS").and_then(|p| p.texts().next()).unwrap_or_default();
    let metres = points::metres_or_mm(unit, place("UNITS"), &mut warnings)?;
    let up = match options.up {
        Some(up) => {
            // what the screen's axis is worth is no matter here, unless it is another
            let stated = up_of_screen(&parameters, &mut Warnings::default());
            if let Some(stated) = stated.ok().filter(|stated| is_stated(&parameters) && *stated != up) {
                let message = format!(
                    "POINT:Y_SCREEN says {} is up; the {} that was asked for is taken instead",
                    points::letter(stated),
                    points::letter(up)
                );
                warnings.add(place("Y_SCREEN"), message);
            }
            up
        }
        None => up_of_screen(&parameters, &mut warnings)?,
    };
    let mut at_origin = 0;
    let mut positions = Vec::new();
    let mut sigmas = Vec::new();
    for sample in frames::read(bytes, &header, processor)? {
        let zero = sample.as_ref().is_some_and(|s| s.position == nalgebra::Vector3::zeros());
        at_origin += usize::from(zero);
        let known = sample.filter(|_| !zero);
        let sigma = known.as_ref().map(|s| s.residual * metres).filter(|s| *s > options.sigma_m);
        let sigma = sigma.filter(|s| *s <= MAX_RESIDUAL);
        if sigma.is_some() && sigmas.is_empty() {
            sigmas.resize(positions.len(), f64::NAN);
        }
        if sigma.is_some() || !sigmas.is_empty() {
            sigmas.push(sigma.unwrap_or(f64::NAN));
        }
        let position = known.map(|s| points::y_up(up, s.position * metres));
        positions.push(position.unwrap_or(nalgebra::Vector3::repeat(f64::NAN)));
    }
    if at_origin > 0 {
        let message = format!("{} at exactly 0 0 0 taken as missing", counted(at_origin, "sample"));
        warnings.add(Place::File, message);
    }
    let names = names(&parameters, header.points, &mut warnings);
    let trajectories = PointTrajectories::new(names, header.rate, positions)?.with_sigmas(sigmas)?;
    Ok(warnings.beside(trajectories))
}

/// Whether `POINT:Y_SCREEN` says anything.
fn is_stated(parameters: &Parameters<'_>) -> bool {
    parameters.get("POINT", "Y_SCREEN").and_then(|p| p.texts().next()).is_some_and(|text| !text.is_empty())
}

fn up_of_screen(parameters: &Parameters<'_>, warnings: &mut Warnings) -> Result<Axis> {
    let found = parameters.get("POINT", "Y_SCREEN");
    let text = found.and_then(|p| p.texts().next()).unwrap_or_default();
    let Some(screen) = found.filter(|_| !text.is_empty()) else {
        warnings.add(Place::File, "POINT:Y_SCREEN doesn't say which axis is up; z is taken");
        return Ok(Axis::Z);
    };
    if text.starts_with(b"-") {
        let message =
            format!("POINT:Y_SCREEN is {}; the axis is taken to point up all the same", quote(text));
        warnings.add(Place::Byte(screen.offset), message);
    }
    match text.strip_prefix(b"+").or(text.strip_prefix(b"-")).unwrap_or(text) {
        b"X" | b"x" => Ok(Axis::X),
        b"Y" | b"y" => Ok(Axis::Y),
        b"Z" | b"z" => Ok(Axis::Z),
        _ => Err(at_byte(screen.offset, quote(text), "POINT:Y_SCREEN: +X, +Y, +Z or with -")),
    }
}

/// `POINT:LABELS`, then `LABELS2` and so on, as one parameter holds at most 255.
fn names(parameters: &Parameters<'_>, points: usize, warnings: &mut Warnings) -> Vec<String> {
    let mut names = PointNames::default();
    for number in 1.. {
        let parameter = if number == 1 { "LABELS".into() } else { format!("LABELS{number}") };
        let Some(labels) = parameters.get("POINT", &parameter) else { break };
        for label in labels.texts().take(points - names.list.len()) {
            let label = String::from_utf8_lossy(label);
            let unnamed = format!("point_{}", names.list.len() + 1);
            let name = if label.is_empty() { unnamed.as_str() } else { &label };
            names.push(name, Place::Byte(labels.offset), warnings);
        }
    }
    let labelled = names.list.len();
    if labelled < points {
        warnings
            .add(Place::File, format!("{labelled} of {points} points have a label; the others are numbered"));
    }
    for number in labelled..points {
        names.push(&format!("point_{}", number + 1), Place::File, warnings);
    }
    names.list
}

/// What is at an offset lies behind the end of the file.
fn ends_early(bytes: &[u8], expected: impl Into<String>) -> Error {
    at_byte(bytes.len() as u64, "the end of the file", expected)
}
