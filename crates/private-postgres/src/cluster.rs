//! Starting and stopping the cluster.

use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use sqlx::postgres::{PgConnectOptions, PgSslMode};
use sqlx::{AssertSqlSafe, Connection, Executor, PgConnection};

use crate::Error;
use crate::config::Config;
use crate::lock_file;
use crate::programs::Programs;
use crate::server_user::ServerUser;
use crate::watchdog::Watchdog;

/// The one user of the cluster. Whoever may enter the socket's folder is this user.
pub const SUPERUSER: &str = "marey";

/// Only names the socket's file: no TCP port is opened.
const PORT: u16 = 5432;

/// `sun_path` of `sockaddr_un`, less its final NUL.
const SOCKET_PATH_LIMIT: usize = 107;

/// So many lines of the server's log are told when a program fails,
const LOG_LINES: usize = 10;
/// which are looked for in its last bytes.
const LOG_BYTES: u64 = 16 << 10;

/// A cluster that runs. Dropping it stops it.
pub struct PrivateCluster {
    config: Config,
    programs: Programs,
    user: ServerUser,
    watchdog: Watchdog,
    // Held as long as we live: who holds it owns the folder.
    _lock: File,
}

impl PrivateCluster {
    /// Makes the cluster if there is none in the folder, and starts it. A server left behind in the folder by
    /// a process that is gone is stopped first; what a crash left behind is recovered.
    ///
    /// # Errors
    /// [`Error::InUse`] if another process runs it.
    pub fn start(config: Config) -> Result<Self, Error> {
        let socket = socket(&config);
        let found = socket.as_os_str().as_bytes().len();
        if found > SOCKET_PATH_LIMIT {
            return Err(Error::SocketPathTooLong { path: socket, found, limit: SOCKET_PATH_LIMIT });
        }
        let programs = Programs::find(&config.data_dir)?;
        let user = ServerUser::find()?;
        user.own_folder(&config.data_dir)?;
        user.own_folder(&config.socket_dir)?;
        let lock = lock(&config)?;
        lock_file::release(&config, &socket)?;
        if !config.data_dir.join("PG_VERSION").exists() {
            init(&programs, &user, &config)?;
        } else if pg_ctl(&programs, &user, &config)
            .arg("status")
            .status()
            .is_ok_and(|status| status.success())
        {
            // Its owner is gone, or we would not have the lock.
            tracing::warn!(data_dir = %config.data_dir.display(), "stopping a server left behind");
            run("pg_ctl", &config, pg_ctl(&programs, &user, &config).args(["stop", "-w", "-m", "fast"]))?;
        }
        write_settings(&config)?;
        let watchdog = Watchdog::start(&programs, &user, &config)?;
        let cluster = Self { config, programs, user, watchdog, _lock: lock };
        cluster.start_server()?;
        Ok(cluster)
    }

    /// How to connect to a database of the cluster.
    pub fn connect_options(&self, database: &str) -> PgConnectOptions {
        PgConnectOptions::new_without_pgpass()
            .socket(&self.config.socket_dir)
            .port(PORT)
            .username(SUPERUSER)
            .database(database)
            .ssl_mode(PgSslMode::Disable)
    }

    /// The same as a URL, for `psql` and for configuration.
    pub fn url(&self, database: &str) -> String {
        let socket: String = self
            .config
            .socket_dir
            .as_os_str()
            .as_bytes()
            .iter()
            .map(|byte| match byte {
                b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.' => char::from(*byte).to_string(),
                byte => format!("%{byte:02X}"),
            })
            .collect();
        format!("postgres://{SUPERUSER}@{socket}:{PORT}/{database}?sslmode=disable")
    }

    /// Where the cluster lives.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Makes a database unless it exists. Asynchronous, the only one of these calls.
    pub async fn create_database(&self, name: &str) -> Result<(), Error> {
        let mut connection = PgConnection::connect_with(&self.connect_options("postgres")).await?;
        let exists: bool = sqlx::query_scalar("SELECT EXISTS (SELECT FROM pg_database WHERE datname = $1)")
            .bind(name)
            .fetch_one(&mut connection)
            .await?;
        if !exists {
            let statement = format!("CREATE DATABASE \"{}\"", name.replace('"', "\"\""));
            // Names cannot be parameters; the name is quoted.
            connection.execute(AssertSqlSafe(statement)).await?;
        }
        connection.close().await?;
        Ok(())
    }

    /// Kills the server as a crash would and starts it again: connections break, open transactions are lost.
    pub fn restart_immediate(&self) -> Result<(), Error> {
        self.stop_immediate()?;
        self.start_server()
    }

    /// Kills the server as a crash would. It stays down until [`start_server`](Self::start_server).
    pub fn stop_immediate(&self) -> Result<(), Error> {
        let mut command = pg_ctl(&self.programs, &self.user, &self.config);
        run("pg_ctl", &self.config, command.args(["stop", "-w", "-m", "immediate"]))
    }

    /// Starts the server after [`stop_immediate`](Self::stop_immediate).
    pub fn start_server(&self) -> Result<(), Error> {
        let log = server_log(&self.config);
        let mut command = pg_ctl(&self.programs, &self.user, &self.config);
        run("pg_ctl", &self.config, command.args(["start", "-w", "-t", "120", "-l"]).arg(log))
    }

    /// Stops the server cleanly and, unless it is durable, removes its folders.
    pub fn stop(mut self) -> Result<(), Error> {
        self.end();
        let running = pg_ctl(&self.programs, &self.user, &self.config).arg("status").status();
        if self.config.durable && running.is_ok_and(|status| status.success()) {
            let output = "the server did not stop in time".to_owned();
            return Err(Error::Program { program: "pg_ctl", output: with_server_log(output, &self.config) });
        }
        Ok(())
    }
}

impl PrivateCluster {
    fn end(&mut self) {
        // Or the watchdog would wait for a killed server that nobody reaps.
        if let Err(error) = lock_file::release(&self.config, &socket(&self.config)) {
            tracing::warn!(%error, "lock file of the private cluster could not be let go of");
        }
        self.watchdog.finish();
        if !self.config.durable {
            // The watchdog has emptied them, but may not remove them from a folder of ours.
            for folder in [&self.config.data_dir, &self.config.socket_dir] {
                let _ = std::fs::remove_dir_all(folder);
            }
        }
    }
}

impl Drop for PrivateCluster {
    fn drop(&mut self) {
        self.end();
    }
}

fn socket(config: &Config) -> PathBuf {
    config.socket_dir.join(format!(".s.PGSQL.{PORT}"))
}

fn server_log(config: &Config) -> PathBuf {
    config.data_dir.join("server.log")
}

/// Beside the folder and not in it, so that it is never removed under another process.
fn lock(config: &Config) -> Result<File, Error> {
    let path = beside(&config.data_dir, ".lock");
    let file = File::create(&path).map_err(Error::io(&path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => return Err(Error::InUse(config.data_dir.clone())),
        Err(TryLockError::Error(source)) => return Err(Error::Io { path, source }),
    }
    if !config.durable {
        // Nobody else ever looks for a throw-away cluster: the open file is enough.
        std::fs::remove_file(&path).map_err(Error::io(&path))?;
    }
    Ok(file)
}

/// Made beside and moved into place whole: an interrupted attempt leaves nothing that looks like a cluster,
/// and a folder with somebody else's files in it is refused and not touched.
fn init(programs: &Programs, user: &ServerUser, config: &Config) -> Result<(), Error> {
    let unfinished = beside(&config.data_dir, ".unfinished");
    if unfinished.exists() {
        std::fs::remove_dir_all(&unfinished).map_err(Error::io(&unfinished))?;
    }
    user.own_folder(&unfinished)?;
    let mut command = user.command(&programs.initdb());
    command
        .arg("-D")
        .arg(&unfinished)
        .args(["-U", SUPERUSER, "--auth=trust", "--encoding=UTF8", "--no-locale"])
        .args((!config.durable).then_some("--no-sync"));
    let made = run("initdb", config, &mut command);
    let moved = made
        .and_then(|()| std::fs::rename(&unfinished, &config.data_dir).map_err(Error::io(&config.data_dir)));
    if moved.is_err() {
        // The first error is the one to tell.
        let _ = std::fs::remove_dir_all(&unfinished);
    }
    moved
}

fn beside(folder: &Path, suffix: &str) -> PathBuf {
    let mut path = folder.to_owned().into_os_string();
    path.push(suffix);
    PathBuf::from(path)
}

/// Written at every start: the folders may have moved.
fn write_settings(config: &Config) -> Result<(), Error> {
    let path = config.data_dir.join("postgresql.auto.conf");
    // The file exists, made by initdb, and stays the server user's own.
    let file = File::options().write(true).truncate(true).open(&path);
    let written = file.and_then(|mut file| file.write_all(server_settings(config).as_bytes()));
    written.map_err(Error::io(&path))
}

fn server_settings(config: &Config) -> String {
    let socket_dir = config.socket_dir.display().to_string().replace('\'', "''");
    let mut settings = format!(
        "listen_addresses = ''\nunix_socket_directories = '{socket_dir}'\nunix_socket_permissions = 0700\n\
         port = {PORT}\nmax_connections = 300\nlogging_collector = off\nlog_line_prefix = '%m [%p] '\n\
         timezone = 'UTC'\nlog_timezone = 'UTC'\n"
    );
    if !config.durable {
        settings.push_str(
            "fsync = off\nsynchronous_commit = off\nfull_page_writes = off\nshared_buffers = '64MB'\n\
             max_wal_size = '1GB'\nwal_level = minimal\nmax_wal_senders = 0\n",
        );
    }
    settings
}

/// A command on the data folder that leaves nothing of ours open in the server.
fn pg_ctl(programs: &Programs, user: &ServerUser, config: &Config) -> Command {
    let mut command = user.command(&programs.pg_ctl());
    command.arg("-D").arg(&config.data_dir);
    command.arg("-p").arg(programs.postgres());
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// The output goes to a file and not to a pipe, which the server would inherit and keep open.
fn run(program: &'static str, config: &Config, command: &mut Command) -> Result<(), Error> {
    let path = config.socket_dir.join("last-command.log");
    let log = File::options().create(true).truncate(true).read(true).write(true).open(&path);
    let mut log = log.map_err(Error::io(&path))?;
    std::fs::remove_file(&path).map_err(Error::io(&path))?;
    let stdio = |file: &File| file.try_clone().map(Stdio::from).map_err(Error::io(&path));
    command.stdin(Stdio::null()).stdout(stdio(&log)?).stderr(stdio(&log)?);
    let status = command.status().map_err(Error::io(command.get_program()))?;
    if status.success() {
        return Ok(());
    }
    let mut output = Vec::new();
    let read = log.seek(SeekFrom::Start(0)).and_then(|_| log.read_to_end(&mut output));
    read.map_err(Error::io(&path))?;
    let mut output = String::from_utf8_lossy(&output).trim().to_owned();
    if output.is_empty() {
        output = status.to_string();
    }
    Err(Error::Program { program, output: with_server_log(output, config) })
}

/// What a program printed, and the end of the server's log.
fn with_server_log(mut output: String, config: &Config) -> String {
    let path = server_log(config);
    match last_lines(&path, LOG_LINES) {
        Ok(lines) if lines.is_empty() => {}
        Ok(lines) => output.push_str(&format!("\nthe last lines of {}:\n{lines}", path.display())),
        // There is none before the server was first started.
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => output.push_str(&format!("\n{}: {error}", path.display())),
    }
    output
}

/// The last lines of a file that may be long, and in any encoding.
fn last_lines(path: &Path, count: usize) -> std::io::Result<String> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(LOG_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(LOG_BYTES).read_to_end(&mut bytes)?;
    let text = String::from_utf8_lossy(&bytes);
    let lines: Vec<&str> = text.lines().collect();
    Ok(lines[lines.len().saturating_sub(count)..].join("\n"))
}
