//! `marey markers`, and what `--map` may be.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use client::parameters;
use formats::{PointsOptions, Read, session};
use markers::{Fit, MarkerMap, fits, standard_names};
use model::{Axis, PointTrajectories, shown_rate};
use serde_json::{Map, Value};

use model::counted;

/// Fits that are shown.
const SHOWN: usize = 3;

/// Show which markers a file has and which control points they make
///
/// Compares the names in a C3D, TRC or CSV file with the known marker sets. `marey run` picks the best one by
/// itself if there is no doubt, and needs none for control points under their standard names, such as
/// left_wrist. --write makes a marker map from it, a text file to edit and to give to `marey run --map`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey markers take3.c3d
  marey markers take3.c3d --write take3.toml
  marey markers take3.c3d --map take3.toml
  marey markers --list")]
pub struct Args {
    /// C3D, TRC or CSV file, also compressed (.gz, .zst)
    #[arg(required_unless_present = "list")]
    file: Option<PathBuf>,
    /// Show this marker set, or the marker map in this file, instead of the set that fits best
    #[arg(long, value_name = "SET or FILE")]
    map: Option<String>,
    /// New file to write a marker map to, for editing
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Axis of the file that points up: x, y or z [default: what the file says, else z for C3D, y for TRC
    /// and CSV]
    #[arg(long, value_name = "AXIS")]
    up: Option<Axis>,
    /// List the known marker sets
    #[arg(long)]
    list: bool,
}

/// Runs `marey markers`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let Some(path) = args.file.as_ref().filter(|_| !args.list) else {
        list();
        return Ok(());
    };
    let read = read(path, args.up)?;
    for warning in &read.warnings {
        eprintln!("warning: {warning}");
    }
    let file = read.value;
    let seconds = file.num_frames() as f64 / file.frame_rate();
    println!(
        "{}: {}, {} at {} Hz ({seconds:.1} s)",
        path.display(),
        counted(file.num_points(), "marker"),
        counted(file.num_frames(), "frame"),
        shown_rate(file.frame_rate())
    );
    let is_measured = is_measured(&file);
    if !is_measured {
        println!("nothing is measured in it: no run can use it");
    }
    // as runs take them: names that are control points come before any marker set
    let standard = if args.map.is_none() { standard_names(file.names()) } else { Vec::new() };
    if !standard.is_empty() {
        if is_measured {
            println!("{}", as_they_are(file.names(), &standard));
        }
        show(&MarkerMap::from_pairs(standard.iter().map(|name| (*name, *name))), &file)?;
        if let Some(to) = &args.write {
            write(to, &file, None)?;
        }
        return Ok(());
    }
    let found = fits(file.names());
    let detected = markers::detect(file.names());
    let map = match (&args.map, &detected) {
        (Some(name), _) => Some(named(name)?),
        (None, Ok(fit)) => Some(fit.with_prefix()),
        (None, Err(error)) => {
            println!("{error}");
            None
        }
    };
    if let Some(map) = &map {
        let prefix = map.prefix.as_deref().unwrap_or_default();
        let name = if map.name.is_empty() { "marker map" } else { &map.name };
        println!("{name}{}:", if prefix.is_empty() { String::new() } else { format!(" for {prefix}") });
        show(map, &file)?;
    }
    println!("\nknown marker sets that have some of the names:");
    for fit in found.iter().take(SHOWN) {
        println!(
            "  {:<28} {} of {} control points; {} of {} in the file",
            fit.label(),
            fit.num_whole(),
            fit.points.len(),
            fit.num_known,
            counted(fit.num_names, "name")
        );
    }
    if found.is_empty() {
        println!("  none; the file has {}", file.names().join(", "));
    }
    if let Some(to) = &args.write {
        write(to, &file, detected.ok().as_ref())?;
    }
    Ok(())
}

fn list() {
    for map in markers::presets() {
        println!("{:<20} {}", map.name, map.description);
        if !map.aliases.is_empty() {
            println!("{:<20} also {}", "", map.aliases.join(", "));
        }
    }
}

/// Whether any point is measured in any frame.
fn is_measured(file: &PointTrajectories) -> bool {
    (0..file.num_frames()).any(|frame| (0..file.num_points()).any(|p| file.position(frame, p).is_some()))
}

/// What a file is whose names are control points. Those beside the standard ones must be joints: only a run,
/// which has a skeleton, can tell.
fn as_they_are(names: &[String], standard: &[&str]) -> String {
    let standard_list = standard.join(",");
    let others: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| !standard.contains(name)).collect();
    if others.is_empty() {
        return "holds control points under their standard names and can be used as it is: \
                a sparse run needs no --map"
            .to_owned();
    }
    format!(
        "holds control points under their standard names: a sparse run needs no --map. Its other \
         names ({}) must be joints of the skeleton; if they are not, choose with --points {standard_list}",
        others.join(", ")
    )
}

/// The control points that a map makes of a file.
fn show(map: &MarkerMap, file: &PointTrajectories) -> anyhow::Result<()> {
    let mapped = map.apply(file, &[])?;
    for point in &mapped.points {
        println!(
            "  {:<12} {:<44} {:>5.1} % of the frames",
            point.name,
            point.markers.join(", "),
            100.0 * point.measured as f64 / file.num_frames().max(1) as f64
        );
    }
    for warning in &mapped.warnings {
        println!("  {warning}");
    }
    Ok(())
}

fn write(to: &Path, file: &PointTrajectories, fit: Option<&Fit<'_>>) -> anyhow::Result<()> {
    if to.exists() {
        bail!("{} exists already; remove it or choose another name", to.display());
    }
    fs::write(to, markers::template(file.names(), fit)).with_context(|| to.display().to_string())?;
    println!(
        "\nwrote {}; edit it, then\n  marey run SESSION --database NAME --map {}",
        to.display(),
        to.display()
    );
    Ok(())
}

/// A marker set by name, or a map from a file.
fn named(name: &str) -> anyhow::Result<MarkerMap> {
    if is_file(name) {
        return MarkerMap::parse(&text(name)?).with_context(|| name.to_owned());
    }
    Ok(markers::preset(name)?.clone())
}

fn is_file(name: &str) -> bool {
    name.ends_with(".toml") || Path::new(name).is_file()
}

fn text(name: &str) -> anyhow::Result<String> {
    fs::read_to_string(name).with_context(|| name.to_owned())
}

fn read(path: &Path, up: Option<Axis>) -> anyhow::Result<Read<PointTrajectories>> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let points = PointsOptions { up, ..PointsOptions::default() };
    let options = session::Options { points, ..session::Options::default() };
    session::read_points(&path.to_string_lossy(), &bytes, &options)
        .with_context(|| path.display().to_string())
}

/// The fields of a request that `--map` stands for: pairs, one file, or one marker set.
///
/// # Errors
/// If they are mixed, or a file or a set is none.
pub fn request(given: &[String]) -> anyhow::Result<Map<String, Value>> {
    let is_pair = |text: &&String| text.contains('=') && !is_file(text);
    let pairs: Vec<&String> = given.iter().filter(is_pair).collect();
    let mut request = Map::new();
    match (pairs.len(), given) {
        (0, []) => {}
        (0, [name]) if is_file(name) => {
            let text = text(name)?;
            // what is wrong with it is said before anything is sent
            MarkerMap::parse(&text).with_context(|| name.clone())?;
            request.insert("marker_map".to_owned(), text.into());
        }
        (0, [name]) => {
            if !matches!(name.as_str(), "auto" | "none") {
                markers::preset(name).with_context(|| {
                    format!("--map {name} is neither a file, a marker set nor MARKER=POINT")
                })?;
            }
            request.insert("marker_set".to_owned(), name.clone().into());
        }
        (count, all) if count == all.len() => {
            let pairs = parameters::pairs(all, "MARKER=POINT", |point| point.into())?;
            request.insert("mapping".to_owned(), pairs.into());
        }
        _ => bail!("--map takes one file, one marker set, or any number of MARKER=POINT"),
    }
    Ok(request)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use serde_json::json;

    use super::*;

    fn asked(given: &[&str]) -> anyhow::Result<Value> {
        let given: Vec<String> = given.iter().map(|g| (*g).to_owned()).collect();
        request(&given).map(Value::Object)
    }

    #[test]
    fn a_map_is_pairs_a_set_or_a_file() {
        assert_eq!(asked(&[]).unwrap(), json!({}));
        assert_eq!(asked(&["plug-in-gait"]).unwrap(), json!({"marker_set": "plug-in-gait"}));
        let pairs = json!({"mapping": {"LWRA": "left_wrist", "LWRB": "left_wrist"}});
        assert_eq!(asked(&["LWRA=left_wrist", "LWRB = left_wrist"]).unwrap(), pairs);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.toml");
        fs::write(&path, "[points]\nhead = 'T'\n").unwrap();
        assert_eq!(
            asked(&[path.to_str().unwrap()]).unwrap(),
            json!({"marker_map": "[points]\nhead = 'T'\n"})
        );
        fs::write(&path, "[points]\nhead = 3\n").unwrap();
        assert!(format!("{:#}", asked(&[path.to_str().unwrap()]).unwrap_err()).contains("line 2"));
    }

    #[test]
    fn control_points_need_no_map() {
        let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let standard = names(&["left_wrist", "right_wrist"]);
        let said = as_they_are(&standard, &standard_names(&standard));
        assert!(said.contains("can be used as it is") && said.contains("needs no --map"), "{said}");
        let more = names(&["left_wrist", "LeftKnee", "right_wrist"]);
        let said = as_they_are(&more, &standard_names(&more));
        assert!(said.contains("(LeftKnee)") && said.ends_with("--points left_wrist,right_wrist"), "{said}");
    }

    #[test]
    fn a_file_without_a_measured_sample_is_known() {
        let file = |x: f64| {
            let positions = vec![Vector3::from_element(f64::NAN), Vector3::new(x, 1.0, 0.0)];
            PointTrajectories::new(vec!["head".to_owned()], 60.0, positions).unwrap()
        };
        assert!(is_measured(&file(0.5)));
        assert!(!is_measured(&file(f64::NAN)));
    }

    #[test]
    fn a_map_that_is_nothing_or_several_things_is_refused() {
        for given in [
            &["nobody"][..],
            &["a=b", "plug-in-gait"],
            &["cmu-41", "plug-in-gait"],
            &["gone.toml"],
            &["a=b", "a=c"],
        ] {
            assert!(asked(given).is_err(), "{given:?}");
        }
    }
}
