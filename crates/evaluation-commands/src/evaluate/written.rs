//! What an evaluation prints, and the files it writes.

use std::{fs, path::PathBuf};

use anyhow::Context;
use client::outputs;
use evaluation::{
    ALL, Case, Row, SparseEvaluation, TrialResult, poses_at_60,
    report::{About, sparse_report},
    tables::{Table, comparison_tables, papers, reference, table, tables},
};
use model::counted;
use serde::Serialize;
use serde_json::Value;
use sparse::Parameters;

/// Files to be written.
#[derive(Debug, clap::Args)]
pub struct Written {
    /// Write rows, tables and the errors of each trial to this file; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write the tables to this file, as Markdown; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write a report to this file, one page with tables and plots, to be opened in a browser; overwritten if it exists
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

/// A finished evaluation.
pub struct Outcome<'a> {
    pub evaluation: &'a SparseEvaluation<'a>,
    pub results: &'a [TrialResult],
    pub rows: &'a [Row],
    /// trials that the defaults were tuned on, when these are others
    pub tuning: &'a [String],
    /// whether any of the motion was sampled, not recorded
    pub synthetic: bool,
    /// how long it took
    pub seconds: f64,
}

#[derive(Serialize)]
struct Json<'a> {
    rows: &'a [Row],
    tables: &'a [Table],
    protocol: evaluation::Protocol,
    command: String,
    parameters: &'a Parameters,
    compared_parameters: Vec<(&'a str, &'a Parameters)>,
    threads: usize,
    database_trials: usize,
    database_poses: usize,
    tuning_trials: &'a [String],
    tested_trials: Vec<&'a str>,
    /// whether any of the motion was sampled, not recorded
    synthetic: bool,
    trials: &'a [TrialResult],
}

impl Outcome<'_> {
    fn tested(&self) -> Vec<&str> {
        self.evaluation.test.iter().map(|clip| clip.name.as_str()).collect()
    }

    /// Everything in plain text.
    pub fn print(&self) {
        print!("{}", table(self.rows));
        if self.synthetic {
            println!(
                "\nThe motion is synthetic: its figures say nothing about recorded motion and are not comparable with the papers'."
            );
        } else {
            self.print_papers();
        }
        if self.is_compared() {
            for table in comparison_tables(self.rows, !self.synthetic) {
                println!("\n{}\n{}\n\n{}", table.title, table.note, table.text().trim_end());
            }
        }
        let Self { evaluation, .. } = self;
        let tested = self.tested();
        println!(
            "\nprotocol {}; trials in the database: {}; tested on {}:",
            evaluation.protocol,
            evaluation.train.len(),
            tested.len()
        );
        println!("{}", tested.join(" "));
        if !self.tuning.is_empty() {
            println!("the defaults were tuned on others: {}", self.tuning.join(" "));
        }
        if evaluation.threads > 1 {
            println!(
                "{} at once; with --threads 1, frames/s are higher",
                counted(evaluation.threads, "trial")
            );
        }
    }

    /// Whether more is compared than numbers of points and the two methods that are compared by default.
    fn is_compared(&self) -> bool {
        let first = &self.rows[0].case;
        self.rows.iter().map(|row| &row.case).any(|case| {
            let is_published = papers::METHODS[..3].contains(&case.method.to_string().as_str());
            let plain = Case { method: first.method, points: first.points, ..case.clone() };
            is_published || plain != *first
        })
    }

    fn print_papers(&self) {
        println!("\ncompared with the paper (local regression, trial out, its own database):");
        let Some(reference) = reference(self.rows) else { return };
        let is_plain =
            |r: &&Row| r.case == Case { method: r.case.method, points: r.case.points, ..reference.clone() };
        for row in self.rows.iter().filter(|r| r.action == ALL).filter(is_plain) {
            let method = row.case.method.to_string();
            let Some(paper) = papers::for_points(&method, row.case.points) else { continue };
            if method == papers::METHODS[3] {
                println!(
                    "{} points: RMS {:.2}, mean absolute {:.2}, paper {paper:.2} degrees; {:.0} frames/s, paper {:.0}",
                    row.case.points,
                    row.rms_deg,
                    row.mae_deg,
                    row.frames_per_second,
                    papers::FRAMES_PER_SECOND[1]
                );
            }
        }
    }

    fn about(&self) -> About {
        let Self { evaluation, .. } = self;
        let parameters = serde_json::to_value(&evaluation.sweep.variants[0].parameters).unwrap_or_default();
        let word = |value: &Value| value.as_str().map_or(value.to_string(), str::to_owned);
        let poses: usize = evaluation.train.iter().map(poses_at_60).sum();
        let mut actions: Vec<&str> =
            evaluation.test.iter().map(|c| c.action.as_str()).filter(|a| !a.is_empty()).collect();
        actions.sort_unstable();
        actions.dedup();
        let mut facts = vec![
            (
                "protocol".to_owned(),
                format!("{}: {}", evaluation.protocol, evaluation.protocol.explanation()),
            ),
            ("trials".to_owned(), format!("{} ({})", evaluation.test.len(), actions.join(", "))),
            (
                "frames of each".to_owned(),
                format!("the first {} at 60 a second, at most", evaluation.max_frames),
            ),
            (
                "database".to_owned(),
                format!("{}, {poses} poses at 60 a second", counted(evaluation.train.len(), "clip")),
            ),
            (
                "took".to_owned(),
                format!("{:.0} s with {} at once", self.seconds, counted(evaluation.threads, "trial")),
            ),
        ];
        if !self.tuning.is_empty() {
            facts.push(("defaults tuned on".to_owned(), counted(self.tuning.len(), "other trial")));
        }
        About {
            title: "How well motion is reconstructed".to_owned(),
            introduction: "Full-body motion was reconstructed from a few points of each recorded trial and compared with \
                           what was recorded."
                .to_owned(),
            facts,
            command: command(),
            parameters: parameters.as_object().into_iter().flatten().map(|(n, v)| (n.clone(), word(v))).collect(),
            warning: if self.synthetic {
                "The motion is synthetic: its figures say nothing about recorded motion and are not comparable with the papers'."
                    .to_owned()
            } else {
                String::new()
            },
        }
    }
}

/// The command line, as it was given.
pub fn command() -> String {
    std::env::args()
        .enumerate()
        .map(|(i, argument)| if i == 0 { "marey".to_owned() } else { quoted(argument) })
        .collect::<Vec<_>>()
        .join(" ")
}

/// An argument as a shell would want it.
fn quoted(argument: String) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:@+".contains(c);
    if !argument.is_empty() && argument.chars().all(is_plain) {
        return argument;
    }
    format!("'{}'", argument.replace('\'', "'\\''"))
}

impl Written {
    /// That each can be written, to a file of its own: known before the evaluation takes its time.
    pub fn check(&self) -> anyhow::Result<()> {
        outputs::check(
            &[],
            &[
                ("--json", self.json.as_ref()),
                ("--markdown", self.markdown.as_ref()),
                ("--html", self.html.as_ref()),
            ],
        )
    }

    /// Writes what was asked for.
    pub fn write(&self, outcome: &Outcome<'_>) -> anyhow::Result<()> {
        let evaluation = outcome.evaluation;
        let tables = tables(outcome.rows, !outcome.synthetic);
        let variants = &evaluation.sweep.variants;
        if let Some(path) = &self.json {
            let json = Json {
                rows: outcome.rows,
                tables: &tables,
                protocol: evaluation.protocol,
                command: command(),
                parameters: &variants[0].parameters,
                compared_parameters: variants[1..].iter().map(|v| (v.name.as_str(), &v.parameters)).collect(),
                threads: evaluation.threads,
                database_trials: evaluation.train.len(),
                database_poses: evaluation.train.iter().map(poses_at_60).sum(),
                tuning_trials: outcome.tuning,
                tested_trials: outcome.tested(),
                synthetic: outcome.synthetic,
                trials: outcome.results,
            };
            write(path, serde_json::to_vec_pretty(&json)?)?;
        }
        if let Some(path) = &self.markdown {
            let text: Vec<String> = tables.iter().map(Table::markdown).collect();
            let command = format!("```sh\n{}\n```\n", command());
            write(path, (command + "\n" + &text.join("\n")).into_bytes())?;
        }
        if let Some(path) = &self.html {
            let Outcome { results, rows, synthetic, .. } = outcome;
            let html = sparse_report(&outcome.about(), evaluation.protocol, results, rows, !synthetic);
            write(path, html.into_bytes())?;
        }
        Ok(())
    }
}

/// Writes a file and says so.
pub fn write(path: &PathBuf, content: Vec<u8>) -> anyhow::Result<()> {
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
}
