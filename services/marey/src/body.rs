//! `marey body`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use ::body::{BodyModel, LearnOptions, Sex, Wanted};
use anyhow::{Context, anyhow, bail};
use body::{ScanOptions, ScanSet, shipped};
use client::{
    Client, Request, Run, ServerArgs, encode,
    numbers::{finite, not_negative, positive},
};
use formats::archive::{self, Entry, Limits};
use serde_json::Value;

use model::counted;

use crate::{database::or_removed, pack, watch, words::unit};

/// `marey body …`
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// List all body models and their versions
    #[command(after_help = "Examples:
  marey body list")]
    List(ServerArgs),
    #[command(after_help = "Examples:
  marey body show shipped
  marey body show athletes.marey-body")]
    Show(ShowArgs),
    #[command(after_help = "Examples:
  marey body learn athletes scans/ --watch                       # on the server, for its runs
  marey body learn athletes scans/ --out athletes.marey-body     # here, into a file")]
    Learn(LearnArgs),
    #[command(after_help = "Examples:
  marey body sample --stature 1.80 --mass 75 --out body.glb
  marey body sample --model athletes.marey-body --alpha 1.5,-0.5 --out body.ply")]
    Sample(SampleArgs),
    #[command(after_help = "Examples:
  marey body delete athletes@1")]
    Delete(DeleteArgs),
}

/// Show a body model: its size, its components and what it was learned from
#[derive(Debug, clap::Args)]
pub struct ShowArgs {
    /// The model: NAME (its latest version), NAME@VERSION, 'shipped', or a .marey-body file
    #[arg(value_name = "MODEL")]
    which: String,
    #[command(flatten)]
    server: ServerArgs,
}

/// Learn a body model from registered scans
///
/// Scans are OBJ or PLY files with the same vertices in the same order, or vertices.npy with faces.npy. Beside them may lie
/// rig.json, skin_joints.npy and skin_weights.npy (without these, the scans must have the shipped model's topology), and
/// scans.csv and subjects.csv, which give pose, sex and age. With --out the model is learned here, without a server.
#[derive(Debug, clap::Args)]
pub struct LearnArgs {
    /// Name of the model: letters, digits, '.', '_' and '-'; if it exists, it gets a new version
    name: String,
    /// Archives (zip, tar, tar.gz, tar.zst), folders or files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Learn here, without a server, and write this file
    #[arg(long, short, visible_alias = "output", value_name = "FILE", conflicts_with = "watch")]
    out: Option<PathBuf>,
    /// Maximum number of principal components
    #[arg(long, default_value_t = ::body::MAX_COMPONENTS, value_parser = components)]
    components: usize,
    /// Length of one unit of the scans, in metres [default: 1; for NPY it is worked out]
    #[arg(long, value_name = "METRES", value_parser = unit)]
    unit: Option<f64>,
    /// Show the progress and wait until it is learned
    #[arg(long, short)]
    watch: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Make a body: the most probable one with these measurements
#[derive(Debug, clap::Args)]
pub struct SampleArgs {
    /// The model: 'shipped', a .marey-body file, or NAME or NAME@VERSION on the server
    #[arg(long, default_value = jobs::body_model::SHIPPED)]
    model: String,
    /// Stature in metres
    #[arg(long, value_name = "METRES", value_parser = positive)]
    stature: Option<f64>,
    /// Mass in kilograms
    #[arg(long, value_name = "KG", value_parser = positive)]
    mass: Option<f64>,
    /// Age in years
    #[arg(long, value_name = "YEARS", value_parser = not_negative)]
    age: Option<f64>,
    /// female or male
    #[arg(long)]
    sex: Option<Sex>,
    /// Coefficients of the components, in standard deviations, instead of measurements
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', allow_hyphen_values = true, value_parser = finite)]
    #[arg(conflicts_with_all = ["stature", "mass", "age", "sex"])]
    alpha: Vec<f64>,
    /// File to write: .glb (with skeleton and skin), .ply or .obj
    #[arg(long, short, visible_alias = "output", value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    server: ServerArgs,
}

/// Delete a version of a body model
///
/// Refused while it is in use. Results of finished runs stay.
#[derive(Debug, clap::Args)]
pub struct DeleteArgs {
    /// The model: NAME@VERSION, or its id
    #[arg(value_name = "MODEL")]
    which: String,
    #[command(flatten)]
    server: ServerArgs,
}

fn components(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| (1..=::body::MAX_COMPONENTS).contains(number));
    number.ok_or_else(|| format!("found {text:?}, expected 1 to {}", ::body::MAX_COMPONENTS))
}

/// Runs `marey body`.
pub fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::List(args) => list(&Client::new(args.server()?)),
        Command::Show(args) => show(args),
        Command::Learn(args) => match &args.out {
            Some(out) => learn_here(args, out),
            None => learn_there(args),
        },
        Command::Sample(args) => sample(args),
        Command::Delete(args) => {
            let client = Client::new(args.server.server()?);
            client.delete(&format!("/v1/body-models/{}", encode(&args.which)))?;
            println!("deleted body model {}", args.which);
            Ok(())
        }
    }
}

fn list(client: &Client) -> anyhow::Result<()> {
    let models: Vec<Value> = client.list_all("/v1/body-models")?;
    for model in models {
        println!(
            "{:<24} {:<9} {:>8} vertices {:>3} components",
            format!("{}@{}", model["name"].as_str().unwrap_or("?"), model["version"]),
            model["state"].as_str().unwrap_or("?"),
            model["num_vertices"].as_u64().map_or("-".to_owned(), |n| n.to_string()),
            model["num_components"].as_u64().map_or("-".to_owned(), |n| n.to_string()),
        );
    }
    Ok(())
}

fn show(args: &ShowArgs) -> anyhow::Result<()> {
    if Path::new(&args.which).is_file() || args.which == jobs::body_model::SHIPPED {
        let model = open(&args.which, &args.server)?;
        let measurements = model.shape(&[]).measurements(&model);
        println!("{}", model.description());
        println!("mesh        {} vertices, {} faces", model.num_vertices(), model.faces().len());
        println!(
            "skeleton    {} joints, {} degrees of freedom",
            model.rig().num_joints(),
            model.rig().num_dofs()
        );
        println!("components  {}, which keep {}", model.num_components(), kept(model.variance_kept()));
        println!("mean        {:.3} m, {:.1} kg", measurements.stature_m, measurements.mass_kg);
        return Ok(());
    }
    let client = Client::new(args.server.server()?);
    let model: Value = client.get(&format!("/v1/body-models/{}", encode(&args.which)))?;
    println!("model       {}@{}", model["name"].as_str().unwrap_or("?"), model["version"]);
    println!("state       {}", model["state"].as_str().unwrap_or("?"));
    let contents = &model["contents"];
    if contents.is_object() {
        println!("from        {}", contents["description"].as_str().unwrap_or("?"));
        println!("mesh        {} vertices, {} faces", model["num_vertices"], contents["num_faces"]);
        println!(
            "skeleton    {} joints, {} degrees of freedom",
            contents["num_joints"], contents["num_dofs"]
        );
        let variance: Vec<f64> =
            contents["variance_kept"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        println!("components  {}, which keep {}", model["num_components"], kept(&variance));
        for warning in contents["warnings"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            println!("warning     {warning}");
        }
    }
    Ok(())
}

/// Variance kept by the first components, at a few places.
fn kept(variance: &[f64]) -> String {
    let places = [1, 2, 5, 10, 20].into_iter().filter(|&n| n <= variance.len());
    let shown: Vec<String> =
        places.map(|n| format!("{:.1} % (first {n})", 100.0 * variance[n - 1])).collect();
    if shown.is_empty() { "nothing".to_owned() } else { shown.join(", ") }
}

/// The model of a name or file.
fn open(which: &str, server: &ServerArgs) -> anyhow::Result<BodyModel> {
    if which == jobs::body_model::SHIPPED {
        return Ok((*shipped().model).clone());
    }
    if Path::new(which).is_file() {
        let bytes = fs::read(which).with_context(|| which.to_owned())?;
        return BodyModel::from_bytes(&bytes).with_context(|| which.to_owned());
    }
    let client = Client::new(server.server()?);
    let model: Value = client.get(&format!("/v1/body-models/{}", encode(which)))?;
    let blake3 = model["blake3"].as_str().with_context(|| format!("body model {which} is not ready"))?;
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("model");
    client.download(&format!("/v1/body-models/{}/model", encode(which)), blake3, &file)?;
    Ok(BodyModel::from_bytes(&fs::read(file)?)?)
}

/// Every file that counts, out of folders and archives.
fn entries(paths: &[PathBuf]) -> anyhow::Result<Vec<Entry>> {
    let mut files = Vec::new();
    for path in paths {
        let base =
            if path.is_dir() { path.clone() } else { path.parent().unwrap_or(Path::new("")).to_owned() };
        pack::collect_where(&base, path, &|_| true, &mut files)?;
    }
    let mut entries = Vec::new();
    for (path, name) in files {
        let name = name.to_string_lossy().into_owned();
        if !body::is_part_of_scan_set(&name) && !pack::is_archive(&name) {
            continue;
        }
        let bytes = fs::read(&path).with_context(|| path.display().to_string())?;
        let found = archive::entries_where(&name, &bytes, &Limits::default(), body::is_part_of_scan_set);
        entries.extend(found.with_context(|| path.display().to_string())?);
    }
    Ok(entries)
}

fn learn_here(args: &LearnArgs, out: &Path) -> anyhow::Result<()> {
    gateway::check_versioned_name("body model", &args.name)?;
    let set = ScanSet::read(entries(&args.files)?, &ScanOptions { metres_per_unit: args.unit })?;
    for warning in &set.warnings {
        eprintln!("warning: {warning}");
    }
    let scans = counted(set.num_scans(), "scan");
    println!("learning from {scans}");
    let description = format!("{}, learned from {scans}", args.name);
    let learned =
        set.learn(&LearnOptions { components: args.components, description, ..LearnOptions::default() })?;
    let bytes = learned.model.to_bytes();
    fs::write(out, &bytes).with_context(|| out.display().to_string())?;
    let components = learned.model.num_components();
    let keep = if components == 1 { "keeps" } else { "keep" };
    println!("{} {keep} {}", counted(components, "component"), kept(&learned.variance_kept));
    println!("{} bytes  {}", bytes.len(), out.display());
    Ok(())
}

fn learn_there(args: &LearnArgs) -> anyhow::Result<()> {
    let client = Client::new(args.server.server()?);
    let uploads = pack::pack_where(&args.name, &args.files, &|name| body::is_part_of_scan_set(name))?;
    let made = Request::default().with("name", "NAME", Some(args.name.as_str()));
    let model: Value = client.post_request("/v1/body-models", &made)?;
    let id = model["id"].as_str().context("the answer has no id")?;
    let request = Request::default().with("components", "--components", Some(args.components)).with(
        "metres_per_unit",
        "--unit",
        args.unit,
    );
    let path = format!("/v1/body-models/{id}");
    let called = format!("body model {}@{}", args.name, model["version"]);
    let run: Run = or_removed(&client, &path, &called, || {
        for upload in uploads {
            println!("uploading {}", upload.name);
            client.put_file(&format!("{path}/files/{}", encode(&upload.name)), upload.file)?;
        }
        client.post_request(&format!("{path}/build"), &request)
    })?;
    println!("building {called} in run {}", run.id);
    if args.watch {
        watch::until_end(&client, &run.id)?;
        let model: Value = client.get(&format!("/v1/body-models/{id}"))?;
        let components = counted(&model["num_components"], "component");
        println!("ready: {components}, {} vertices", model["num_vertices"]);
    }
    Ok(())
}

fn sample(args: &SampleArgs) -> anyhow::Result<()> {
    let model = open(&args.model, &args.server)?;
    let wanted = Wanted { stature_m: args.stature, mass_kg: args.mass, age_years: args.age, sex: args.sex };
    let options = Request::default()
        .with("stature_m", "--stature", args.stature)
        .with("mass_kg", "--mass", args.mass)
        .with("age_years", "--age", args.age);
    let alpha = if args.alpha.is_empty() {
        model.alpha_for(&wanted).map_err(|error| anyhow!(options.in_options(&error.to_string())))?
    } else {
        args.alpha.clone()
    };
    if alpha.len() > model.num_components() || alpha.iter().any(|a| a.is_nan() || a.abs() > 6.0) {
        bail!(
            "--alpha: each number must be -6 to 6, at most {} of them; found {}",
            model.num_components(),
            alpha.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
        );
    }
    let shape = model.shape(&alpha);
    let name = args.out.to_string_lossy().to_ascii_lowercase();
    let bytes = match name.rsplit('.').next() {
        Some("glb") => body::glb(&model, &shape, None)?,
        Some("ply") => formats::ply::write(&shape.mesh(&model)),
        Some("obj") => formats::obj::write(&shape.mesh(&model)).into_bytes(),
        _ => bail!("{}: expected a name that ends in .glb, .ply or .obj", args.out.display()),
    };
    fs::write(&args.out, bytes).with_context(|| args.out.display().to_string())?;
    let m = shape.measurements(&model);
    println!(
        "stature {:.3} m, mass {:.1} kg, arm span {:.3} m, inseam {:.3} m",
        m.stature_m, m.mass_kg, m.arm_span_m, m.inseam_m
    );
    println!("girths: chest {:.3} m, waist {:.3} m, hips {:.3} m", m.chest_m, m.waist_m, m.hip_m);
    println!("{}", args.out.display());
    Ok(())
}
