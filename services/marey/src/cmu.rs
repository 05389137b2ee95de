//! `marey data cmu`: the CMU Graphics Lab Motion Capture Database, subject by subject.

use std::{
    collections::BTreeSet,
    fs,
    io::{Read, Seek, Write},
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, bail};
use formats::asf;
use ureq::{Agent, http::StatusCode};

use model::counted;

/// Where the database is.
const CMU: &str = "http://mocap.cs.cmu.edu";
/// Where there is no listing, numbers are tried until so many in a row are missing.
const MISSING_IN_A_ROW: u32 = 10;
/// Frames per second at which its trials were recorded.
const FRAME_RATE: f64 = 120.0;
/// Tries of one file.
const TRIES: u32 = 4;

/// Download ASF and AMC files of the CMU Graphics Lab Motion Capture Database
///
/// Writes DIR/16/16.asf, DIR/16/16_01.amc, … Files that are already there are not downloaded again, and an interrupted download
/// is resumed (its file is called .part until it is whole): just start it again. The data are free for all uses, but may not be
/// resold; see http://mocap.cs.cmu.edu.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey data cmu --subjects 16,35 recordings/
  marey data cmu --subjects 16 --trials 15,16,21 recordings/")]
pub struct Args {
    /// Subjects, by number, separated by commas
    #[arg(long, required = true, value_delimiter = ',', value_parser = number)]
    subjects: Vec<u32>,
    /// Trials, by number, separated by commas [default: all]
    #[arg(long, value_delimiter = ',', value_parser = number)]
    trials: Vec<u32>,
    /// Folder to write to
    dir: PathBuf,
    /// Server with the same files in the same places
    #[arg(long, default_value = CMU)]
    base_url: String,
}

/// The number of a subject or trial.
fn number(text: &str) -> Result<u32, String> {
    text.trim().parse().map_err(|_| format!("found {text:?}, expected a number such as 16"))
}

/// Runs `marey data cmu`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let agent = Agent::config_builder()
        .http_status_as_error(false)
        .timeout_connect(Some(Duration::from_secs(15)))
        .timeout_recv_response(Some(Duration::from_secs(60)))
        .timeout_per_read(Some(Duration::from_secs(60)))
        .user_agent(concat!("marey/", env!("CARGO_PKG_VERSION")))
        .build()
        .new_agent();
    let mut num_trials = 0;
    let mut refused = Vec::new();
    for subject in &args.subjects {
        let source = Subject {
            agent: &agent,
            url: format!("{}/subjects/{subject:02}", args.base_url.trim_end_matches('/')),
            name: format!("{subject:02}"),
            folder: args.dir.join(format!("{subject:02}")),
        };
        let outcome = source.download(&args.trials)?;
        num_trials += outcome.num_trials;
        refused.extend(outcome.refused);
    }
    println!(
        "{} of {} in {}",
        counted(num_trials, "trial"),
        counted(args.subjects.len(), "subject"),
        args.dir.display()
    );
    println!(
        "The data used in this project was obtained from mocap.cs.cmu.edu.\n\
         The database was created with funding from NSF EIA-0196217."
    );
    if refused.is_empty() {
        Ok(())
    } else {
        bail!("{} could not be downloaded:\n{}", counted(refused.len(), "file"), refused.join("\n"))
    }
}

struct Subject<'a> {
    agent: &'a Agent,
    url: String,
    /// two digits
    name: String,
    folder: PathBuf,
}

struct Outcome {
    num_trials: usize,
    refused: Vec<String>,
}

impl Subject<'_> {
    fn download(&self, wanted: &[u32]) -> anyhow::Result<Outcome> {
        fs::create_dir_all(&self.folder).with_context(|| self.folder.display().to_string())?;
        let name = format!("{}.asf", self.name);
        let is_skeleton = |bytes: &[u8]| asf::read(bytes).map(|_| ()).map_err(|e| e.to_string());
        let Some(skeleton) = self.file(&name, is_skeleton)? else {
            self.leave_nothing_empty(None);
            bail!("there is no subject {} at {}", self.name, self.url);
        };
        let acclaim = match skeleton {
            Ok(bytes) => asf::read(&bytes)?.value,
            Err(reason) => bail!("{reason}"),
        };
        let mut outcome = Outcome { num_trials: 0, refused: Vec::new() };
        let listed = if wanted.is_empty() { self.listed()? } else { wanted.iter().copied().collect() };
        let probing = listed.is_empty();
        let numbers: Box<dyn Iterator<Item = u32>> =
            if probing { Box::new(1..=999) } else { Box::new(listed.into_iter()) };
        let mut missing = 0;
        for number in numbers {
            let name = format!("{}_{number:02}.amc", self.name);
            let is_motion = |bytes: &[u8]| {
                formats::amc::read(bytes, &acclaim, FRAME_RATE).map(|_| ()).map_err(|e| e.to_string())
            };
            match self.file(&name, is_motion)? {
                Some(Ok(_)) => {
                    missing = 0;
                    outcome.num_trials += 1;
                }
                Some(Err(reason)) => {
                    missing = 0;
                    outcome.refused.push(reason);
                }
                None if probing => {
                    missing += 1;
                    if missing == MISSING_IN_A_ROW {
                        break;
                    }
                }
                None => outcome.refused.push(format!("{}/{name} does not exist", self.url)),
            }
        }
        Ok(outcome)
    }

    /// Numbers of the trials that the subject's page links to; none if there is no such page.
    fn listed(&self) -> anyhow::Result<BTreeSet<u32>> {
        let url = format!("{}/", self.url);
        let mut response = self.agent.get(&url).call().with_context(|| url.clone())?;
        if !response.status().is_success() {
            return Ok(BTreeSet::new());
        }
        let page = response.body_mut().read_to_string().with_context(|| url.clone())?;
        Ok(trial_numbers(&page, &self.name))
    }

    /// A file that can be read: its content, or why it can't be; `None` if the server has none.
    fn file(
        &self,
        name: &str,
        check: impl Fn(&[u8]) -> Result<(), String>,
    ) -> anyhow::Result<Option<Result<Vec<u8>, String>>> {
        let path = self.folder.join(name);
        let at = || path.display().to_string();
        if path.exists() {
            let bytes = fs::read(&path).with_context(at)?;
            if check(&bytes).is_ok() {
                return Ok(Some(Ok(bytes)));
            }
            // not what it should be: again
            fs::remove_file(&path).with_context(at)?;
        }
        let url = format!("{}/{name}", self.url);
        let part = self.folder.join(format!("{name}.part"));
        match self.fetch(&url, &part) {
            Ok(true) => {}
            Ok(false) => return Ok(None),
            Err(error) => {
                self.leave_nothing_empty(Some(&part));
                return Err(error);
            }
        }
        let bytes = fs::read(&part).with_context(at)?;
        if let Err(reason) = check(&bytes) {
            fs::remove_file(&part).with_context(at)?;
            return Ok(Some(Err(format!("{url}: {reason}"))));
        }
        fs::rename(&part, &path).with_context(at)?;
        println!("{} ({:.1} MB)", path.display(), bytes.len() as f64 / 1e6);
        Ok(Some(Ok(bytes)))
    }

    /// Removes what an attempt left that got nothing: the empty file, and the folder if nothing else is in it.
    fn leave_nothing_empty(&self, part: Option<&Path>) {
        // what can't be removed is in use or has gone: neither matters here
        if let Some(part) = part.filter(|part| fs::metadata(part).is_ok_and(|file| file.len() == 0)) {
            let _ = fs::remove_file(part);
        }
        let _ = fs::remove_dir(&self.folder);
    }

    /// Downloads to `part`, going on where an earlier try broke off; `false` if the server has no such file.
    fn fetch(&self, url: &str, part: &Path) -> anyhow::Result<bool> {
        let mut last = None;
        for attempt in 0..TRIES {
            if attempt > 0 {
                std::thread::sleep(Duration::from_millis(300 << attempt));
            }
            match self.fetch_once(url, part) {
                Ok(found) => return Ok(found),
                Err(error) => last = Some(error),
            }
        }
        Err(last.unwrap_or_else(|| anyhow::anyhow!("not tried")).context(url.to_owned()))
    }

    fn fetch_once(&self, url: &str, part: &Path) -> anyhow::Result<bool> {
        let mut file = fs::OpenOptions::new().create(true).truncate(false).write(true).open(part)?;
        let have = file.metadata()?.len();
        let mut request = self.agent.get(url);
        if have > 0 {
            request = request.header("Range", format!("bytes={have}-"));
        }
        let response = request.call().context("the server can't be asked")?;
        match response.status() {
            StatusCode::NOT_FOUND => {
                fs::remove_file(part)?;
                return Ok(false);
            }
            StatusCode::PARTIAL_CONTENT => {
                file.seek(std::io::SeekFrom::Start(have))?;
            }
            // what is there is all there is, or not of this file: begin anew
            StatusCode::RANGE_NOT_SATISFIABLE => {
                file.set_len(0)?;
                bail!("the server can't go on at byte {have}");
            }
            status if status.is_success() => file.set_len(0)?,
            status => bail!("the server answered {status}"),
        }
        let length = response.body().content_length();
        let mut body = response.into_body().into_reader();
        let mut received = 0u64;
        let mut buffer = vec![0; 64 << 10];
        loop {
            let n = body.read(&mut buffer)?;
            if n == 0 {
                break;
            }
            file.write_all(&buffer[..n])?;
            received += n as u64;
        }
        match length {
            Some(length) if length != received => bail!("{received} of {length} bytes came"),
            _ => Ok(true),
        }
    }
}

/// Numbers NN in links to `SUBJECT_NN.amc`.
fn trial_numbers(page: &str, subject: &str) -> BTreeSet<u32> {
    let prefix = format!("{subject}_");
    page.split(['"', '\'', '>', '<', '/', ' '])
        .filter_map(|word| word.strip_prefix(&prefix)?.strip_suffix(".amc")?.parse().ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trials_are_found_in_a_listing() {
        let page =
            r#"<a href="16_15.amc">16_15.amc</a> <a href='/subjects/16/16_02.amc'>x</a> <a href="16.asf">"#;
        assert_eq!(trial_numbers(page, "16"), BTreeSet::from([2, 15]));
    }
}
