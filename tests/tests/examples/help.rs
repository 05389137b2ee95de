//! The examples that `--help` gives, of every command.

use std::process::Command;

use anyhow::{Result, ensure};

/// A command as the help shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Example {
    /// such as `marey db list`
    pub line: String,
}

/// Every command, such as `db build`, with its help.
pub fn commands(program: &str) -> Result<Vec<(String, String)>> {
    let mut found = Vec::new();
    let mut open = vec![Vec::new()];
    while let Some(path) = open.pop() {
        let output = Command::new(program).args(&path).arg("--help").output()?;
        let help = String::from_utf8(output.stdout)?;
        ensure!(output.status.success(), "{path:?} --help failed");
        for name in subcommands(&help) {
            let mut longer: Vec<String> = path.clone();
            longer.push(name.to_owned());
            open.push(longer);
        }
        found.push((path.join(" "), help));
    }
    found.sort();
    Ok(found)
}

fn subcommands(help: &str) -> impl Iterator<Item = &str> {
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let listed = listed.take_while(|line| line.starts_with("  "));
    let names =
        listed.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help")
}

/// Columns that the help is wrapped to.
const WIDTH: usize = 100;

/// The examples in a command's help: lines that begin with two blanks and `marey`, without what is said about them behind
/// three blanks. A line that goes on in the next one, as its first word had no place, is put together.
pub fn examples(help: &str) -> Vec<Example> {
    let mut lines: Vec<String> = Vec::new();
    let mut width = None;
    for line in help.lines() {
        let columns = line.chars().count();
        let word = line.split_whitespace().next().map(|word| word.chars().count());
        if line.starts_with("  marey ") {
            lines.push(line.trim_start().to_owned());
            width = Some(columns);
        } else if let (Some(before), Some(word), Some(last)) = (width, word, lines.last_mut())
            && before + 1 + word > WIDTH
        {
            last.push(' ');
            last.push_str(line.trim_start());
            width = Some(columns);
        } else {
            width = None;
        }
    }
    let command = |line: String| match line.split_once("   ") {
        Some((command, _)) => command.trim_end().to_owned(),
        None => line,
    };
    lines.into_iter().map(|line| Example { line: command(line) }).collect()
}

#[test]
fn what_is_said_about_an_example_is_cut_off_and_wrapped_lines_are_put_together() {
    let long = "x".repeat(84);
    let help = format!(
        "Examples:\n  marey up                 # start\n  marey run {long}\n  --watch\n\nOptions:\n  -h\n"
    );
    let found = examples(&help);
    let lines: Vec<&str> = found.iter().map(|example| example.line.as_str()).collect();
    assert_eq!(lines, ["marey up".to_owned(), format!("marey run {long} --watch")]);
}
