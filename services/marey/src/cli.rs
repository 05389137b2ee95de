//! The command line, as `marey --help` tells it.

use clap::{Parser, Subcommand};
use evaluation_commands::{bench, evaluate};

use crate::{
    body, cmu, database, demo, health, keys, live, marker_sets, results, run, sample, sample_capture, serve,
    status, up, upload,
};

/// Full-body human motion from very few measurements: a few points, a few cameras, or both.
///
/// You measured the paths of a few points of a moving person (wrists, ankles, hips, head), or filmed them with calibrated
/// cameras. Marey finds the most probable motion of the whole body and writes it as BVH for Blender or MotionBuilder, and in
/// other formats.
#[derive(Debug, Parser)]
#[command(name = "marey", version, max_term_width = 100, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
See it work, without any data of your own:
  marey demo

Start everything, and leave it running; the commands below go into another terminal:
  marey up

Examples:
  marey db build walks recordings/ --watch          # learns from a folder of ASF+AMC or BVH files
  marey upload \"take 3\" points.csv skeleton.asf
  marey run \"take 3\" --database walks --watch
  marey results \"take 3\" -o take3/                 # then open take3/motion.bvh
  marey upload \"take 4\" calib.toml cam*.mp4 plates/
  marey run \"take 4\" --watch                       # a body and its motion, from calibrated cameras
  marey results \"take 4\" -o take4/                 # then look at take4/overlay_cam01.mp4

Commands that talk to a server find the one started by `marey up` in this folder or above it. For
another one, set MAREY_URL (such as https://mocap.example) and MAREY_API_KEY.";

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Up(up::Args),
    /// Build and manage motion databases: the recordings that Marey learns from
    #[command(subcommand)]
    Db(database::Command),
    /// Learn and manage body models: the body shapes that Marey can fit (the shipped one: generated bodies, MakeHuman)
    #[command(subcommand)]
    Body(body::Command),
    Upload(upload::Args),
    Run(Box<run::Args>),
    Markers(marker_sets::Args),
    Results(results::Args),
    Status(status::Args),
    Cancel(status::CancelArgs),
    Live(live::Args),
    /// Measure how well motion is reconstructed, on your own recordings
    Evaluate(evaluate::Args),
    /// Measure how fast the parts are, on your own recordings
    Bench(bench::Args),
    Sample(sample::Args),
    SampleCapture(sample_capture::Args),
    /// Get recorded motion from public collections
    #[command(subcommand)]
    Data(Data),
    /// Run one of the services, for installations on several machines
    #[command(subcommand)]
    Serve(serve::Service),
    Migrate(keys::MigrateArgs),
    /// Make API keys
    #[command(subcommand)]
    Key(keys::Command),
    Health(health::Args),
}

#[derive(Debug, Subcommand)]
enum Data {
    Cmu(cmu::Args),
}

/// Runs one command.
pub fn run(cli: Cli) -> anyhow::Result<()> {
    match cli.command {
        Command::Demo(args) => demo::run(&args),
        Command::Up(args) => up::run(&args),
        Command::Db(command) => database::run(&command),
        Command::Body(command) => body::run(&command),
        Command::Upload(args) => upload::run(&args),
        Command::Run(args) => run::run(&args),
        Command::Markers(args) => marker_sets::run(&args),
        Command::Results(args) => results::run(&args),
        Command::Status(args) => status::run(&args),
        Command::Cancel(args) => status::cancel(&args),
        Command::Live(args) => live::run(&args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Sample(args) => sample::run(&args),
        Command::SampleCapture(args) => sample_capture::run(&args),
        Command::Data(Data::Cmu(args)) => cmu::run(&args),
        Command::Serve(service) => serve::run(&service),
        Command::Migrate(args) => keys::migrate(&args),
        Command::Key(command) => keys::run(&command),
        Command::Health(args) => health::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use clap::{Arg, Command, CommandFactory, Parser, builder::ValueParser};
    use client::numbers::finite;

    use super::Cli;

    /// Lines are wrapped beyond this.
    const WIDTH: usize = 100;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    /// All commands with what stands after their help, under `Examples:` a command a line.
    fn texts(command: &Command, path: &str, found: &mut Vec<(String, String)>) {
        let text = command.get_after_help().map(ToString::to_string);
        found.push((path.to_owned(), text.unwrap_or_default()));
        for inner in command.get_subcommands() {
            texts(inner, &format!("{path} {}", inner.get_name()), found);
        }
    }

    /// All options that are numbers with a fraction.
    fn numbers(command: &Command, found: &mut Vec<Arg>) {
        let of_number = ValueParser::new(finite).type_id();
        found
            .extend(command.get_arguments().filter(|a| a.get_value_parser().type_id() == of_number).cloned());
        for inner in command.get_subcommands() {
            numbers(inner, found);
        }
    }

    #[test]
    fn every_number_is_finite() {
        let mut found = Vec::new();
        numbers(&Cli::command(), &mut found);
        for arg in &found {
            for text in ["nan", "inf", "-inf"] {
                let alone = Arg::new("number").long("number").value_parser(arg.get_value_parser().clone());
                let parsed = Command::new("marey").arg(alone);
                let error = parsed.try_get_matches_from(["marey", &format!("--number={text}")]).unwrap_err();
                let expected = format!("found {text:?}, expected a finite number");
                assert!(error.to_string().contains(&expected), "{}: {error}", arg.get_id());
            }
        }
        assert!(found.len() > 15, "only {} options are numbers", found.len());
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_words() {
        for (words, expected) in [
            (&["up", "--workers", "0"][..], "0 is not in 1.."),
            (&["db", "build", "walks", "rec", "--shards", "0"], "0 is not in 1..=64"),
            (&["db", "build", "walks", "rec", "--shards", "65"], "65 is not in 1..=64"),
            (&["db", "add", "walks", "--without", "a,"], "found \"\", expected a name"),
            (&["body", "learn", "b", "scans", "--components", "0"], "found \"0\", expected 1 to 20"),
            (&["run", "take 3", "--points", "root,,head"], "found \"\", expected a name"),
            (&["run", " "], "found \" \", expected a name"),
            (&["upload", " ", "points.csv"], "found \" \", expected a name"),
            (&["bench", "live", "--streams", "0"], "found \"0\", expected a whole number, 1 or above"),
            (&["data", "cmu", "--subjects", "abc", "rec"], "found \"abc\", expected a number such as 16"),
            (&["live", "points.csv", "-d", "walks", "--points", ""], "found \"\", expected a name"),
        ] {
            let parsed = Cli::try_parse_from(["marey"].iter().chain(words));
            let message = parsed.map(|_| ()).unwrap_err().to_string();
            assert!(message.contains(expected), "{words:?}: {message}");
        }
    }

    fn examples(text: &str) -> impl Iterator<Item = &str> {
        let after = text.lines().skip_while(|line| *line != "Examples:").skip(1);
        after.take_while(|line| !line.is_empty())
    }

    /// The words of an example's last command, as a shell divides it.
    fn words(example: &str) -> Vec<String> {
        let command = example.split("  #").next().unwrap_or_default();
        let command =
            command.rsplit(" | ").next().unwrap_or_default().split(" > ").next().unwrap_or_default();
        let quoted = command.split('"').enumerate();
        let words = quoted.flat_map(|(index, part)| match index % 2 {
            0 => part.split_whitespace().map(str::to_owned).collect(),
            _ => vec![part.to_owned()],
        });
        words.collect()
    }

    #[test]
    fn every_example_of_the_help_is_a_command_that_there_is() {
        let mut found = Vec::new();
        texts(&Cli::command(), "marey", &mut found);
        let mut count = 0;
        for (path, text) in &found {
            for example in examples(text) {
                count += 1;
                let words = words(example);
                assert_eq!(words.first().map(String::as_str), Some("marey"), "{path}: {example}");
                if let Err(error) = Cli::try_parse_from(&words) {
                    panic!("{path}: {example}\n{error}");
                }
            }
        }
        assert!(count > 60, "only {count} examples");
    }

    #[test]
    fn no_line_after_the_help_is_broken() {
        let mut found = Vec::new();
        texts(&Cli::command(), "marey", &mut found);
        for (path, text) in &found {
            for line in examples(text) {
                assert!(line.chars().count() <= WIDTH, "{path}: {line}");
            }
        }
    }
}
