//! Every example of README.md, the pages of `docs/` and `--help` is run as it stands, against a real `marey up` and drawn data.
//!
//! A block that can't run here says so in a comment above it, with the reason: `<!-- not run by the tests: REASON -->`; one that
//! is a file is marked `<!-- saved as NAME -->`. A block that is neither run nor marked fails the test. What is put in for names that
//! the reader has to fill in is listed in `substitutions.rs`.

mod files;
mod help;
mod page;
mod server;
mod substitutions;

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::Mutex,
    time::Instant,
};

use anyhow::{Context, Result, ensure};
use help::Example;
use server::{MAREY, Server};
use substitutions::{NOT_RUN, SETUPS, SUBSTITUTIONS, Substitution};

/// Runs that were started and not watched must succeed too, unless the page cancelled them.
const EPILOGUE: &str = r#"
for run in $(sort -u "$SCRATCH/runs" 2>/dev/null); do
    "$MAREY_UNDER_TEST" status "$run" --watch >"$SCRATCH/end" 2>&1 || grep -q cancelled "$SCRATCH/end" || { cat "$SCRATCH/end" >&2; exit 1; }
done
"#;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Paths of all pages from the repository's root, with their text.
fn pages() -> Result<Vec<(String, String)>> {
    let mut names = vec!["README.md".to_owned(), "CONTRIBUTING.md".to_owned(), "ARCHITECTURE.md".to_owned()];
    for entry in fs::read_dir(repository().join("docs"))? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name.ends_with(".md") {
            names.push(format!("docs/{name}"));
        }
    }
    names.sort();
    names.into_iter().map(|name| Ok((name.clone(), fs::read_to_string(repository().join(&name))?))).collect()
}

/// Name of the test below.
const SELF: &str = "every_example_of_the_pages_and_of_help_runs";

#[test]
fn every_example_of_the_pages_and_of_help_runs() -> Result<()> {
    let (mut scripts, mut failures) = (Vec::new(), Vec::new());
    let mut used = HashSet::new();
    let python = has_websockets();
    for (name, text) in pages()? {
        let mut script = page::script(&text, true).with_context(|| name.clone())?;
        let mut runnable = substituted(&name, &script.text, &mut used);
        if script.has_python && !python {
            println!("skipped: {SELF}: {name}, the client in Python: no python3 with websockets");
            script = page::script(&text, false)?;
            runnable = substituted(&name, &script.text, &mut used);
        }
        if script.num_blocks > 0 {
            scripts.push((name, runnable));
        }
    }
    let mut left: HashSet<&str> = NOT_RUN.iter().map(|(line, _)| *line).collect();
    for (command, examples) in examples_of_help()? {
        let is_run = |example: &Example| NOT_RUN.iter().all(|(line, _)| *line != example.line);
        let (run, not_run): (Vec<Example>, Vec<Example>) = examples.into_iter().partition(is_run);
        left.retain(|line| not_run.iter().all(|example| example.line != *line));
        if !run.is_empty() {
            let name = format!("marey {command} --help");
            let lines: String = run.iter().map(|example| format!("{}\n", example.line)).collect();
            scripts.push((name.clone(), substituted(&name, &lines, &mut used)));
        }
    }
    failures.extend(left.iter().map(|line| format!("declared as not run, but in no help: {line}")));
    let unused = (0..SUBSTITUTIONS.len()).filter(|index| !used.contains(index));
    failures.extend(unused.map(|index| format!("substituted nowhere: {:?}", SUBSTITUTIONS[index])));
    failures.extend(run_all(&scripts)?);
    ensure!(failures.is_empty(), "{} failed:\n\n{}", failures.len(), failures.join("\n\n"));
    Ok(())
}

/// Runs scripts by name, two at a time; what failed.
fn run_all(scripts: &[(String, String)]) -> Result<Vec<String>> {
    let server = Server::start()?;
    let drawn = server.folder().join("drawn");
    fs::create_dir(&drawn)?;
    files::draw(&drawn)?;
    let (next, failures) = (Mutex::new(scripts.iter()), Mutex::new(Vec::new()));
    let work = || {
        // a lock that a panic left behind is of no use to the other thread either
        while let Some((name, script)) = next.lock().ok().and_then(|mut next| next.next()) {
            if let Err(error) = attempt(&server, &drawn, name, script)
                && let Ok(mut failures) = failures.lock()
            {
                failures.push(format!("{name}: {error:#}"));
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    Ok(failures.into_inner().unwrap_or_default())
}

/// Runs a script in a folder and a project of its own, after what its page takes for granted.
fn attempt(server: &Server, drawn: &Path, name: &str, script: &str) -> Result<()> {
    let begin = Instant::now();
    let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let folder = server.folder().join(&plain);
    files::copy(drawn, &folder)?;
    let key = server.key(&plain)?;
    for (_, setup) in SETUPS.iter().filter(|(page, _)| name.starts_with(page)) {
        server.run(setup, &folder, &key).context("what the page takes for granted")?;
    }
    let end = server.run(&format!("{script}{EPILOGUE}"), &folder, &key);
    println!("{:5.1} s  {name}", begin.elapsed().as_secs_f64());
    end
}

fn substituted(name: &str, text: &str, used: &mut HashSet<usize>) -> String {
    let mut text = text.to_owned();
    for (index, Substitution { page, from, to, .. }) in SUBSTITUTIONS.iter().enumerate() {
        if name.starts_with(page) && text.contains(from) {
            used.insert(index);
            text = text.replace(from, to);
        }
    }
    text
}

fn examples_of_help() -> Result<Vec<(String, Vec<Example>)>> {
    let commands = help::commands(MAREY)?;
    Ok(commands.into_iter().map(|(command, text)| (command, help::examples(&text))).collect())
}

fn has_websockets() -> bool {
    let tried = Command::new("python3").args(["-c", "import websockets.asyncio.client"]).output();
    tried.is_ok_and(|output| output.status.success())
}

/// `marey …` in running text, such as in tables, names commands and options that there are.
#[test]
fn commands_named_in_running_text_exist() -> Result<()> {
    let commands = help::commands(MAREY)?;
    let mut unknown = Vec::new();
    for (name, text) in pages()? {
        for (number, line) in (1..).zip(text.lines()) {
            let spans = line.split('`').skip(1).step_by(2).filter(|span| span.starts_with("marey "));
            for span in spans {
                let words: Vec<&str> = span.split_whitespace().skip(1).collect();
                let is_of = |path: &str| {
                    let path: Vec<&str> = path.split_whitespace().collect();
                    !path.is_empty() && words.starts_with(&path)
                };
                let command =
                    commands.iter().filter(|(path, _)| is_of(path)).max_by_key(|(path, _)| path.len());
                let options = words.iter().filter(|word| word.starts_with("--"));
                let missing = options.filter(|option| {
                    let option =
                        option.split('=').next().unwrap_or_default().trim_end_matches(['`', ',', ')']);
                    !command.is_some_and(|(_, help)| help.contains(option))
                });
                let missing: Vec<&&str> = missing.collect();
                if (command.is_none() && words[0].starts_with(|c: char| c.is_ascii_lowercase()))
                    || !missing.is_empty()
                {
                    unknown.push(format!("{name}:{number}: `{span}`: {missing:?}"));
                }
            }
        }
    }
    ensure!(unknown.is_empty(), "no such command or option:\n{}", unknown.join("\n"));
    Ok(())
}

/// Links between pages lead to files that are there, and every page stands in the index.
#[test]
fn links_lead_somewhere_and_the_index_has_every_page() -> Result<()> {
    let mut broken = Vec::new();
    let pages = pages()?;
    for (name, text) in &pages {
        let folder = repository().join(name).parent().context("no folder")?.to_owned();
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let path = target.split('#').next().unwrap_or_default();
            if !path.is_empty() && !path.contains("://") && !folder.join(path).exists() {
                broken.push(format!("{name}: {target}"));
            }
        }
    }
    let index = fs::read_to_string(repository().join("docs/README.md"))?;
    let in_docs = pages.iter().filter_map(|(name, _)| name.strip_prefix("docs/"));
    let absent = in_docs.filter(|name| *name != "README.md" && !index.contains(&format!("]({name}")));
    broken.extend(absent.map(|name| format!("docs/README.md does not list {name}")));
    ensure!(broken.is_empty(), "{}", broken.join("\n"));
    Ok(())
}
