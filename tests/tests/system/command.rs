//! The `marey` command as people use it.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Child, Command, Output, Stdio},
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use anyhow::{Context, Result, ensure};
use tempfile::TempDir;
use tests::{System, trials};

use crate::faults::MAREY;

/// A folder that the user who runs PostgreSQL may enter too.
fn open_folder() -> Result<TempDir> {
    let folder = TempDir::new_in("/var/tmp")?;
    fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755))?;
    Ok(folder)
}

fn marey(folder: &Path, args: &[&str]) -> Result<String> {
    let Output { status, stdout, stderr } = Command::new(MAREY)
        .args(args)
        .current_dir(folder)
        .env_remove("MAREY_URL")
        .env_remove("MAREY_API_KEY")
        .stdin(Stdio::null())
        .output()?;
    let (stdout, stderr) = (String::from_utf8(stdout)?, String::from_utf8(stderr)?);
    ensure!(status.success(), "marey {args:?} failed: {stdout}{stderr}");
    Ok(stdout)
}

/// `marey up` in a folder.
struct Up {
    child: Child,
    /// what it has said until it was up
    said: String,
}

impl Up {
    fn start(folder: &Path) -> Result<Self> {
        let mut child = Command::new(MAREY)
            .args(["up", "--listen", "127.0.0.1:0"])
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut said = String::new();
        let mut lines = BufReader::new(child.stdout.take().context("no stdout")?).lines();
        while let Some(line) = lines.next().transpose()? {
            said.push_str(&line);
            said.push('\n');
            if line.contains("Ctrl-C") {
                return Ok(Self { child, said });
            }
        }
        child.wait()?;
        anyhow::bail!("marey up ended: {said}")
    }

    fn stop(mut self) -> Result<()> {
        let id = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(id, rustix::process::Signal::TERM)?;
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(30) {
            if let Some(status) = self.child.try_wait()? {
                ensure!(status.success(), "marey up ended with {status}");
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        anyhow::bail!("marey up did not stop in 30 s")
    }
}

impl Drop for Up {
    fn drop(&mut self) {
        // of a test that failed; otherwise it has ended
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Processes whose command line mentions `text`.
fn processes(text: &str) -> Vec<String> {
    let matching_line = |entry: fs::DirEntry| {
        let bytes = fs::read(entry.path().join("cmdline")).ok()?;
        let line = String::from_utf8_lossy(&bytes).replace('\0', " ");
        line.contains(text).then_some(line)
    };
    fs::read_dir("/proc").into_iter().flatten().flatten().filter_map(matching_line).collect()
}

#[test]
fn the_first_session_goes_by_the_commands_of_the_help() -> Result<()> {
    let folder = open_folder()?;
    let here = folder.path();
    let recordings = here.join("recordings");
    fs::create_dir(&recordings)?;
    fs::write(recordings.join("1.asf"), trials::skeleton())?;
    for seed in 1..=5 {
        fs::write(recordings.join(format!("1_{seed:02}.amc")), trials::motion(seed, 360))?;
    }
    fs::write(here.join("points.csv"), crate::points_csv(41, 360)?)?;
    fs::write(here.join("skeleton.asf"), trials::skeleton())?;

    let up = Up::start(here)?;
    assert!(up.said.contains("http://127.0.0.1:") && up.said.contains("mk_"), "{}", up.said);
    let kept = fs::metadata(here.join(".marey/connection.json"))?;
    assert_eq!(kept.permissions().mode() & 0o777, 0o600);

    let said = marey(here, &["db", "build", "walks", "recordings", "--watch"])?;
    assert!(said.contains("ready: 900 poses of 5 clips"), "{said}");
    assert!(marey(here, &["db", "list"])?.contains("walks@1"));
    marey(here, &["upload", "take 3", "points.csv", "skeleton.asf"])?;
    let said = marey(here, &["run", "take 3", "--database", "walks", "--watch"])?;
    let run = said.lines().find_map(|line| line.strip_prefix("run ")).context("no run")?.to_owned();
    assert!(marey(here, &["status"])?.contains(&run));
    assert!(marey(here, &["status", &run])?.contains("state    succeeded\n"));
    marey(here, &["results", &run, "-o", "take3"])?;
    assert!(fs::read_to_string(here.join("take3/motion.bvh"))?.starts_with("HIERARCHY"));
    // a session's name stands for its newest run
    assert_eq!(marey(here, &["status", "take 3"])?, marey(here, &["status", &run])?);
    marey(here, &["results", "take 3", "-o", "by-name"])?;
    assert_eq!(fs::read(here.join("by-name/motion.bvh"))?, fs::read(here.join("take3/motion.bvh"))?);
    leaves_no_session_behind(here)?;
    follows_what_is_piped_in(here)?;
    let untold = marey(here, &["evaluate", "run", &run]).unwrap_err().to_string();
    assert!(untold.contains("marey upload") && untold.contains("--truth"), "{untold}");
    fs::write(here.join("truth.amc"), trials::motion(41, 360))?;
    let told = marey(here, &["evaluate", "run", &run, "--truth", "truth.amc"])?;
    assert!(told.contains("joint angles, RMS, degrees"), "{told}");
    // uploaded after the run, it is found without being named
    marey(here, &["upload", "take 3", "truth.amc"])?;
    let args = ["evaluate", "run", &run, "--json", "errors.json", "--html", "errors.html"];
    assert!(marey(here, &args)?.starts_with(told.trim_end()), "the same as with the file");
    let errors: serde_json::Value = serde_json::from_slice(&fs::read(here.join("errors.json"))?)?;
    assert_eq!(errors["errors"]["frames"], 180);
    let rms = errors["errors"]["rms_deg"].as_f64().context("no error")?;
    assert!(rms > 0.0 && rms < 10.0, "{rms}");
    assert!(fs::read_to_string(here.join("errors.html"))?.ends_with("</html>\n"));
    let key = marey(here, &["key", "create", "--project", "film", "--scopes", "read"])?;
    let sessions = marey(here, &["status", "--api-key", key.trim()])?;
    assert!(sessions.contains("no runs yet"), "another project sees none: {sessions}");
    up.stop()?;

    // all is there again, and the same key is good
    let up = Up::start(here)?;
    assert!(marey(here, &["status"])?.contains(&run));
    up.stop()?;
    assert_eq!(processes(&here.display().to_string()), Vec::<String>::new());
    Ok(())
}

/// An upload that fails at once, and what is asked of the session that it does not make.
fn leaves_no_session_behind(here: &Path) -> Result<()> {
    fs::write(here.join("notes.txt"), "a stand-in for the performer")?;
    for (file, expected) in
        [("missing.csv", "missing.csv"), ("notes.txt", "control-points .csv, .trc or .c3d")]
    {
        let refused = marey(here, &["upload", "take 9", file]).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
        let none = marey(here, &["run", "take 9", "--database", "walks"]).unwrap_err().to_string();
        assert!(none.contains("there is no session \"take 9\""), "{none}");
    }
    let none = marey(here, &["results", "take 9"]).unwrap_err().to_string();
    assert!(none.contains("no run and no session \"take 9\""), "{none}");
    Ok(())
}

/// 360 lines of 120 a second, all there at once: every second one is a frame, and none is dropped.
fn follows_what_is_piped_in(here: &Path) -> Result<()> {
    let begin = Instant::now();
    let output = Command::new(MAREY)
        .args(["live", "-", "--database", "walks", "--skeleton", "skeleton.asf", "-o", "poses.csv"])
        .current_dir(here)
        .stdin(fs::File::open(here.join("points.csv"))?)
        .output()?;
    let said = String::from_utf8(output.stderr)?;
    assert!(output.status.success() && said.contains("180 frames, 180 poses, 0 dropped"), "{said}");
    assert_eq!(fs::read_to_string(here.join("poses.csv"))?.lines().count(), 1 + 180);
    assert!(begin.elapsed() > Duration::from_millis(2500), "it takes as long as the motion");
    Ok(())
}

#[test]
fn up_that_is_killed_leaves_no_postgres_and_comes_back() -> Result<()> {
    let folder = open_folder()?;
    let mut up = Up::start(folder.path())?;
    assert!(!processes(&folder.path().display().to_string()).is_empty());
    up.child.kill()?;
    up.child.wait()?;
    let begin = Instant::now();
    while !processes(&folder.path().display().to_string()).is_empty() {
        assert!(
            begin.elapsed() < Duration::from_secs(30),
            "{:?}",
            processes(&folder.path().display().to_string())
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    Up::start(folder.path())?.stop()
}

#[test]
fn without_a_server_a_command_says_how_to_get_one() -> Result<()> {
    let folder = open_folder()?;
    let message = marey(folder.path(), &["status"]).unwrap_err().to_string();
    assert!(message.contains("marey up") && message.contains("MAREY_URL"), "{message}");
    Ok(())
}

#[test]
fn health_tells_a_service_that_is_well_from_one_that_is_not() -> Result<()> {
    let system = System::start()?;
    let folder = open_folder()?;
    assert_eq!(marey(folder.path(), &["health", system.stranger().url()])?.trim(), "ok");
    let free = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
    assert!(marey(folder.path(), &["health", &format!("http://{free}")]).is_err());
    assert!(marey(folder.path(), &["health", &format!("grpc://{free}")]).is_err());
    Ok(())
}

/// A server of files that breaks off the first answer for each of them in the middle.
struct FlakyFiles {
    url: String,
    requests: Arc<Mutex<Vec<String>>>,
}

impl FlakyFiles {
    fn start(files: Vec<(String, String)>) -> Result<Self> {
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let url = format!("http://{}", listener.local_addr()?);
        let requests = Arc::new(Mutex::new(Vec::new()));
        let log = requests.clone();
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                // a client that goes away is its own affair
                let _ = answer(stream, &files, &log);
            }
        });
        Ok(Self { url, requests })
    }

    fn requests(&self) -> Vec<String> {
        self.requests.lock().map(|r| r.clone()).unwrap_or_default()
    }
}

fn answer(mut stream: TcpStream, files: &[(String, String)], log: &Mutex<Vec<String>>) -> Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let (mut request, mut from) = (String::new(), None);
    reader.read_line(&mut request)?;
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 || line.trim().is_empty() {
            break;
        }
        if let Some(range) = line.to_ascii_lowercase().strip_prefix("range: bytes=") {
            from = range.trim().trim_end_matches('-').parse::<usize>().ok();
        }
    }
    let path = request.split(' ').nth(1).unwrap_or_default().to_owned();
    let known = format!("{path}{}", from.map(|f| format!(" from {f}")).unwrap_or_default());
    let is_first = {
        let mut log = log.lock().map_err(|_| anyhow::anyhow!("poisoned"))?;
        let is_first = !log.iter().any(|l| l.starts_with(&path));
        log.push(known);
        is_first
    };
    let Some((_, content)) = files.iter().find(|(name, _)| *name == path) else {
        write!(stream, "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")?;
        return Ok(());
    };
    let rest = &content.as_bytes()[from.unwrap_or(0).min(content.len())..];
    let status = if from.is_some() { "206 Partial Content" } else { "200 OK" };
    write!(stream, "HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", rest.len())?;
    let end = if is_first && path.ends_with(".amc") { rest.len() / 2 } else { rest.len() };
    stream.write_all(&rest[..end])?;
    let mut sink = [0; 1];
    stream.shutdown(std::net::Shutdown::Write)?;
    let _ = stream.read(&mut sink);
    Ok(())
}

#[test]
fn cmu_subjects_are_downloaded_continued_and_not_downloaded_again() -> Result<()> {
    let listing = "<a href=\"16_01.amc\">a</a> <a href=\"16_15.amc\">b</a> <a href=\"16.asf\">c</a>";
    let server = FlakyFiles::start(vec![
        ("/subjects/16/".into(), listing.into()),
        ("/subjects/16/16.asf".into(), trials::skeleton()),
        ("/subjects/16/16_01.amc".into(), trials::motion(1, 60)),
        ("/subjects/16/16_15.amc".into(), trials::motion(2, 60)),
        // no listing: numbers are tried
        ("/subjects/07/07.asf".into(), trials::skeleton()),
        ("/subjects/07/07_02.amc".into(), trials::motion(3, 60)),
    ])?;
    let folder = open_folder()?;
    let args = ["data", "cmu", "--subjects", "16,7", "--base-url", &server.url, "cmu"];
    let said = marey(folder.path(), &args)?;
    assert!(said.contains("3 trials of 2 subjects") && said.contains("NSF EIA-0196217"), "{said}");
    let read = |name: &str| fs::read_to_string(folder.path().join("cmu").join(name));
    assert_eq!(read("16/16.asf")?, trials::skeleton());
    assert_eq!(read("16/16_15.amc")?, trials::motion(2, 60));
    assert_eq!(read("07/07_02.amc")?, trials::motion(3, 60));
    let requests = server.requests();
    assert!(requests.iter().any(|r| r.starts_with("/subjects/16/16_15.amc from ")), "{requests:?}");

    marey(folder.path(), &args)?;
    let again = server.requests()[requests.len()..].to_vec();
    assert!(again.iter().all(|r| !r.contains("16_15") && !r.contains(".asf")), "{again:?}");
    Ok(())
}

#[test]
fn a_download_that_gets_nothing_leaves_nothing() -> Result<()> {
    let nobody = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
    let folder = open_folder()?;
    let url = format!("http://{nobody}");
    let args = ["data", "cmu", "--subjects", "16", "--base-url", &url, "recordings"];
    let message = marey(folder.path(), &args).unwrap_err().to_string();
    assert!(message.contains("16.asf"), "{message}");
    assert_eq!(fs::read_dir(folder.path().join("recordings"))?.count(), 0);
    Ok(())
}

#[test]
fn what_came_and_can_not_be_read_is_named_and_not_kept() -> Result<()> {
    let server = FlakyFiles::start(vec![
        ("/subjects/16/16.asf".into(), trials::skeleton()),
        ("/subjects/16/16_01.amc".into(), "<html>down for maintenance</html>".into()),
    ])?;
    let folder = open_folder()?;
    let args = ["data", "cmu", "--subjects", "16", "--trials", "1", "--base-url", &server.url, "cmu"];
    let message = marey(folder.path(), &args).unwrap_err().to_string();
    assert!(message.contains("16_01.amc"), "{message}");
    assert!(!folder.path().join("cmu/16/16_01.amc").exists());
    Ok(())
}
