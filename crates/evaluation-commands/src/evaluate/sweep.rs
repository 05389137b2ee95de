//! What `marey evaluate sparse` varies, as given on the command line.

use anyhow::{Context, bail};
use client::{numbers::not_negative, parameters::values};
use evaluation::{Occlusion, Sweep, Variant};
use sparse::{Method, Parameters};

/// Methods, points, parameters, databases, noise and gaps. Whatever is given several values is compared in one table.
#[derive(Debug, clap::Args)]
pub struct SweepArgs {
    /// Numbers of control points, 2 to 6
    #[arg(long, value_delimiter = ',', default_value = "2,3,4,5,6")]
    points: Vec<usize>,
    /// Methods, or all: local-regression, nearest, lpca, lpcr, gplvm (trained first, some minutes)
    #[arg(long, value_delimiter = ',', default_value = "local-regression,nearest")]
    method: Vec<String>,
    /// Window lengths, frames at 60 a second
    #[arg(long, value_delimiter = ',', value_name = "FRAMES")]
    window: Vec<usize>,
    /// Number of nearest windows
    #[arg(long, value_name = "K")]
    neighbours: Option<usize>,
    /// Sizes of the database: the first whole clips, mixed by name, with at least this many poses; or all
    #[arg(long, value_delimiter = ',', value_name = "POSES")]
    database_size: Vec<String>,
    /// Gaussian noise on the control points, standard deviation of each coordinate, millimetres
    #[arg(long, value_delimiter = ',', value_name = "MM", default_value = "0", value_parser = not_negative)]
    noise_mm: Vec<f64>,
    /// Tell the reconstruction how noisy the points are
    #[arg(long)]
    noise_known: bool,
    /// Hide a point, or all of them, for a while in the middle of each trial: one:0.5s, all:0.5s
    #[arg(long, value_delimiter = ',', value_name = "WHAT:HOW_LONG")]
    occlusion: Vec<Occlusion>,
    /// Also as an offline run, which uses what is measured up to 0.2 s later; the same as --compare smooth=true
    #[arg(long)]
    offline: bool,
    /// Any other parameter of the reconstruction: NAME=VALUE; may be given several times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Also with these parameters: NAME=VALUE[,NAME=VALUE…]; each time it is given, it is compared
    #[arg(long, value_name = "NAME=VALUE,…")]
    compare: Vec<String>,
    /// Parameters as JSON: '{"control_sigma_m": 0.003}'
    #[arg(long, value_name = "JSON")]
    parameters: Option<String>,
}

impl SweepArgs {
    /// Everything that was asked for, checked as far as it can be without motion.
    pub fn sweep(&self) -> anyhow::Result<Sweep> {
        let mut occlusions: Vec<Option<Occlusion>> = self.occlusion.iter().copied().map(Some).collect();
        // A gap is judged beside the same frames without it.
        occlusions.insert(0, None);
        Ok(Sweep {
            methods: self.methods()?,
            points: self.points.clone(),
            variants: self.variants()?,
            database_sizes: self.database_sizes()?,
            noises_m: self.noise_mm.iter().map(|mm| mm / 1e3).collect(),
            noise_is_known: self.noise_known,
            occlusions,
        })
    }

    fn methods(&self) -> anyhow::Result<Vec<Method>> {
        let mut methods: Vec<Method> = Vec::new();
        for name in &self.method {
            let named = if name == "all" { Method::ALL.to_vec() } else { vec![name.parse()?] };
            methods.extend(named.into_iter().filter(|m| !methods.contains(m)).collect::<Vec<_>>());
        }
        Ok(methods)
    }

    fn database_sizes(&self) -> anyhow::Result<Vec<Option<usize>>> {
        if self.database_size.is_empty() {
            return Ok(vec![None]);
        }
        let size = |text: &String| match text.as_str() {
            "all" => Ok(None),
            number => number.parse().ok().filter(|poses| *poses > 0).map(Some).with_context(|| {
                format!("--database-size is {number:?}, expected a number of poses, or all")
            }),
        };
        self.database_size.iter().map(size).collect()
    }

    /// Every window with the given parameters, and with each set of parameters to compare.
    fn variants(&self) -> anyhow::Result<Vec<Variant>> {
        let given = match &self.parameters {
            Some(json) => serde_json::from_str(json).context("--parameters does not parse")?,
            None => Parameters::default(),
        };
        let mut given = with(&given, &self.set)?;
        given.neighbours = self.neighbours.unwrap_or(given.neighbours);
        let mut variants = vec![Variant { name: String::new(), parameters: given.clone() }];
        let offline = self.offline.then(|| "smooth=true".to_owned());
        for compare in offline.iter().chain(&self.compare) {
            let settings: Vec<String> = compare.split(',').map(str::to_owned).collect();
            let parameters = with(&given, &settings)?;
            variants.push(Variant { name: compare.clone(), parameters });
        }
        let windows =
            if self.window.is_empty() { vec![None] } else { self.window.iter().map(Some).collect() };
        let mut all = Vec::new();
        for window in windows {
            for variant in &variants {
                let mut variant = variant.clone();
                variant.parameters.window = window.copied().unwrap_or(variant.parameters.window);
                variant.parameters.check()?;
                all.push(variant);
            }
        }
        Ok(all)
    }
}

/// The parameters with some set: a number or true where the value reads as one, else a word.
fn with(parameters: &Parameters, settings: &[String]) -> anyhow::Result<Parameters> {
    let mut json = serde_json::to_value(parameters)?;
    for (name, value) in values(settings)? {
        if name == "method" {
            bail!("methods are compared by --method");
        }
        json[&name] = value;
    }
    serde_json::from_value(json).with_context(|| settings.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        sweep: SweepArgs,
    }

    fn sweep(line: &str) -> anyhow::Result<Sweep> {
        Line::try_parse_from(std::iter::once("marey").chain(line.split_whitespace()))?.sweep.sweep()
    }

    #[test]
    fn without_options_there_is_one_case_for_each_method_and_number_of_points() {
        let sweep = sweep("").unwrap();
        assert_eq!(sweep.cases_per_database(), 2 * 5);
        assert_eq!(sweep, Sweep::new(&sweep.methods, &[2, 3, 4, 5, 6], Parameters::default()));
    }

    #[test]
    fn parameters_are_set_for_all_and_compared_in_turn() {
        let sweep = sweep(
            "--window 1,3 --set ridge_deg=5 --compare control_sigma_m=0.01,max_steps=7 --compare covariance=diagonal",
        );
        let variants = sweep.unwrap().variants;
        let names: Vec<_> = variants.iter().map(|v| (v.parameters.window, v.name.as_str())).collect();
        let compared = ["", "control_sigma_m=0.01,max_steps=7", "covariance=diagonal"];
        let expected: Vec<_> =
            [1, 3].iter().flat_map(|window| compared.iter().map(move |name| (*window, *name))).collect();
        assert_eq!(names, expected);
        assert!(variants.iter().all(|v| v.parameters.ridge_deg == 5.0));
        assert_eq!((variants[1].parameters.control_sigma_m, variants[1].parameters.max_steps), (0.01, 7));
        assert_eq!(variants[2].parameters.covariance, sparse::Covariance::Diagonal);
    }

    #[test]
    fn gaps_are_compared_with_none_and_sizes_with_all() {
        let sweep = sweep("--occlusion one:0.5s,all:1s --database-size 5000,all --noise-mm 0,2.5").unwrap();
        assert_eq!(sweep.occlusions.len(), 3);
        assert_eq!(sweep.occlusions[0], None);
        assert_eq!(sweep.database_sizes, [Some(5000), None]);
        assert_eq!(sweep.noises_m, [0.0, 0.0025]);
    }

    #[test]
    fn what_there_is_not_is_named() {
        for (line, word) in [
            ("--set speed=3", "speed"),
            ("--set ridge_deg", "NAME=VALUE"),
            ("--set ridge_deg=-1", "ridge_deg"),
            ("--database-size many", "many"),
            ("--method telepathy", "telepathy"),
            ("--occlusion half:1s", "half:1s"),
            ("--compare method=nearest", "--method"),
        ] {
            let message = format!("{:#}", sweep(line).unwrap_err());
            assert!(message.contains(word), "{line}: {message}");
        }
    }
}
