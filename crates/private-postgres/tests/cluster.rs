//! A private cluster through its life, on the system's PostgreSQL.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use private_postgres::{Config, Error, PrivateCluster};
use sqlx::{Connection, PgConnection};

/// Tells the child process of a test where to start its cluster.
const CHILD_FOLDER: &str = "PRIVATE_POSTGRES_TEST_FOLDER";

/// Open to whoever runs the server.
fn folder() -> tempfile::TempDir {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::Builder::new().prefix("pp").tempdir_in("/var/tmp").unwrap();
    std::fs::set_permissions(folder.path(), std::fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

fn config(folder: &Path, durable: bool) -> Config {
    Config { data_dir: folder.join("data"), socket_dir: folder.join("socket"), durable }
}

fn postmaster(folder: &Path) -> Option<u32> {
    let file = std::fs::read_to_string(folder.join("data/postmaster.pid")).ok()?;
    file.lines().next()?.trim().parse().ok()
}

async fn execute(cluster: &PrivateCluster, statement: &'static str) -> Result<(), sqlx::Error> {
    let mut connection = PgConnection::connect_with(&cluster.connect_options("marey")).await?;
    sqlx::query(statement).execute(&mut connection).await?;
    connection.close().await
}

fn wait_until(what: &str, condition: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(20);
    while !condition() {
        assert!(Instant::now() < deadline, "{what} did not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[tokio::test]
async fn data_survive_a_stop_a_crash_and_a_killed_server() {
    let folder = folder();
    let cluster = PrivateCluster::start(config(folder.path(), true)).unwrap();
    cluster.create_database("marey").await.unwrap();
    cluster.create_database("marey").await.unwrap();
    execute(&cluster, "CREATE TABLE poses (frame integer)").await.unwrap();
    cluster.restart_immediate().unwrap();
    execute(&cluster, "INSERT INTO poses VALUES (1)").await.unwrap();
    cluster.stop().unwrap();
    assert_eq!(postmaster(folder.path()), None);

    let cluster = PrivateCluster::start(config(folder.path(), true)).unwrap();
    let server = postmaster(folder.path()).unwrap();
    assert!(Command::new("kill").args(["-9", &server.to_string()]).status().unwrap().success());
    wait_until("the end of the server", || !Path::new(&format!("/proc/{server}")).exists());
    drop(cluster);
    assert_eq!(postmaster(folder.path()), Some(server), "a stale postmaster.pid is what we recover from");

    let cluster = PrivateCluster::start(config(folder.path(), true)).unwrap();
    let mut connection = PgConnection::connect_with(&cluster.connect_options("marey")).await.unwrap();
    let frames: i64 =
        sqlx::query_scalar("SELECT count(*) FROM poses").fetch_one(&mut connection).await.unwrap();
    assert_eq!(frames, 1);
    let url_options: sqlx::postgres::PgConnectOptions = cluster.url("marey").parse().unwrap();
    PgConnection::connect_with(&url_options).await.unwrap();
}

/// What a killed server leaves: lock files of the folder and of the socket, with its pid.
fn leave_lock_files(folder: &Path, pid: u32) {
    let text = format!("{pid}\n{}\n", folder.join("data").display());
    for name in ["data/postmaster.pid", "socket/.s.PGSQL.5432.lock"] {
        std::fs::write(folder.join(name), &text).unwrap();
    }
}

#[test]
fn a_killed_server_that_nobody_reaps_is_in_nobodys_way() {
    let folder = folder();
    PrivateCluster::start(config(folder.path(), true)).unwrap().stop().unwrap();
    let mut zombie = Command::new("true").spawn().unwrap();
    let stat = format!("/proc/{}/stat", zombie.id());
    wait_until("the zombie", || std::fs::read_to_string(&stat).unwrap().contains(") Z "));

    leave_lock_files(folder.path(), zombie.id());
    let cluster = PrivateCluster::start(config(folder.path(), true)).unwrap();
    let server = postmaster(folder.path()).unwrap();
    assert_ne!(server, zombie.id());

    // and while we run: the end does not wait for it
    assert!(Command::new("kill").args(["-9", &server.to_string()]).status().unwrap().success());
    leave_lock_files(folder.path(), zombie.id());
    let begin = Instant::now();
    cluster.stop().unwrap();
    assert!(begin.elapsed() < Duration::from_secs(30), "{:?}", begin.elapsed());
    zombie.wait().unwrap();
}

#[test]
fn a_process_that_has_the_pid_of_a_killed_server_is_left_alone() {
    let folder = folder();
    PrivateCluster::start(config(folder.path(), true)).unwrap().stop().unwrap();
    let mut other = Command::new("sleep").arg("600").current_dir("/").spawn().unwrap();
    leave_lock_files(folder.path(), other.id());
    let started = PrivateCluster::start(config(folder.path(), true));
    let ended = other.try_wait().unwrap();
    other.kill().unwrap();
    other.wait().unwrap();
    started.unwrap().stop().unwrap();
    assert_eq!(ended, None);
}

#[test]
fn a_server_that_does_not_start_says_why_and_where_its_log_is() {
    let folder = folder();
    PrivateCluster::start(config(folder.path(), true)).unwrap().stop().unwrap();
    let settings = folder.path().join("data/postgresql.conf");
    let mut file = std::fs::File::options().append(true).open(settings).unwrap();
    std::io::Write::write_all(&mut file, b"\nwalk_speed = 3\n").unwrap();
    let message = PrivateCluster::start(config(folder.path(), true)).err().unwrap().to_string();
    assert!(message.starts_with("pg_ctl failed: "), "{message}");
    assert!(message.contains("unrecognized configuration parameter \"walk_speed\""), "{message}");
    let log = folder.path().join("data/server.log").display().to_string();
    assert!(message.contains(&format!("the last lines of {log}:\n")), "{message}");
}

#[test]
fn no_tcp_port_is_opened_and_nobody_else_may_enter() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let cluster = PrivateCluster::start(config(folder.path(), false)).unwrap();
    let pid_file = std::fs::read_to_string(folder.path().join("data/postmaster.pid")).unwrap();
    assert_eq!(pid_file.lines().nth(5), Some(""), "line 6 is the first listen address: {pid_file}");
    for name in ["data", "socket"] {
        let mode = folder.path().join(name).metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o700, "{name}");
    }
    cluster.stop().unwrap();
    assert!(!folder.path().join("data").exists() && !folder.path().join("socket").exists());
}

#[test]
fn a_folder_has_one_owner() {
    let folder = folder();
    let _cluster = PrivateCluster::start(config(folder.path(), true)).unwrap();
    let second = PrivateCluster::start(config(folder.path(), true));
    assert!(matches!(second, Err(Error::InUse(_))));
}

#[test]
fn a_folder_with_other_files_is_left_alone() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("data")).unwrap();
    std::fs::write(folder.path().join("data/thesis.txt"), "years of work").unwrap();
    assert!(PrivateCluster::start(config(folder.path(), true)).is_err());
    assert!(folder.path().join("data/thesis.txt").exists());
}

#[test]
fn a_socket_path_beyond_the_kernels_limit_is_refused_with_its_length() {
    let config = Config {
        data_dir: "/var/tmp/never-made".into(),
        socket_dir: PathBuf::from(format!("/var/tmp/{}", "x".repeat(100))),
        durable: false,
    };
    let error = PrivateCluster::start(config).err().unwrap();
    assert!(matches!(error, Error::SocketPathTooLong { found: 123, limit: 107, .. }), "{error}");
}

#[test]
fn the_server_ends_with_a_process_that_is_killed() {
    let folder = folder();
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "child_that_starts_a_cluster", "--nocapture"])
        .env(CHILD_FOLDER, folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    lines.map_while(Result::ok).find(|line| line.ends_with("cluster started")).expect("a started cluster");
    let server = postmaster(folder.path()).unwrap();
    child.kill().unwrap();
    child.wait().unwrap();
    wait_until("the end of the server", || !Path::new(&format!("/proc/{server}")).exists());
    wait_until("the removal of its data", || !folder.path().join("data/base").exists());
}

/// Not a test by itself: what the test above kills.
#[test]
fn child_that_starts_a_cluster() {
    let Some(folder) = std::env::var_os(CHILD_FOLDER) else { return };
    let _cluster = PrivateCluster::start(config(Path::new(&folder), false)).unwrap();
    println!("cluster started");
    loop {
        std::thread::park();
    }
}
