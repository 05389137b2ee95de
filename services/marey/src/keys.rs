//! `marey migrate` and `marey key`: what is done on the database itself.

use anyhow::Context;
use client::Server;
use gateway::access::{self, Scope};
use sqlx::{Connection, PgConnection};

use crate::serve::runtime;

/// Bring a database's schema up to date
#[derive(Debug, clap::Args)]
pub struct MigrateArgs {
    /// PostgreSQL, such as postgres://user:password@host/name
    #[arg(long, env = "MAREY_DATABASE_URL", hide_env_values = true)]
    database_url: String,
}

/// `marey key …`
#[derive(Debug, clap::Subcommand)]
pub enum Command {
    #[command(after_help = "Examples:
  marey key create --project film
  marey key create --project film --scopes read --name \"wall display\"")]
    Create(CreateArgs),
}

/// Make an API key for a project, and the project if it does not exist yet
///
/// The key is printed once and can't be shown again. The database must be reachable: that of `marey up` in this folder or above
/// it, or the one named by MAREY_DATABASE_URL.
#[derive(Debug, clap::Args)]
pub struct CreateArgs {
    /// Name of the project: letters, digits, '.', '_' and '-'
    #[arg(long, value_parser = access::project_name)]
    project: String,
    /// What the key allows: read, write, admin
    #[arg(long, value_delimiter = ',', default_value = "read,write")]
    scopes: Vec<Scope>,
    /// Label to recognise the key by: a line of at most 200 characters
    #[arg(long, default_value = "", value_parser = access::key_label)]
    name: String,
    /// PostgreSQL, such as postgres://user:password@host/name
    #[arg(long, env = "MAREY_DATABASE_URL", hide_env_values = true)]
    database_url: Option<String>,
}

/// Runs `marey migrate`.
pub fn migrate(args: &MigrateArgs) -> anyhow::Result<()> {
    runtime()?.block_on(async {
        let mut db = connect(&args.database_url).await?;
        queue::MIGRATOR.run(&mut db).await.context("the database's schema can't be brought up to date")?;
        println!("the database's schema is up to date");
        Ok(())
    })
}

/// Runs `marey key`.
pub fn run(Command::Create(args): &Command) -> anyhow::Result<()> {
    let url = match &args.database_url {
        Some(url) => url.clone(),
        None => Server::local()?
            .and_then(|server| server.database_url)
            .context("no database: set MAREY_DATABASE_URL, or start `marey up` here")?,
    };
    runtime()?.block_on(async {
        let mut db = connect(&url).await?;
        let key = access::create_key(&mut db, &args.project, &args.name, &args.scopes)
            .await
            .with_context(|| format!("no key was made for project {:?}", args.project))?;
        println!("{key}");
        Ok(())
    })
}

async fn connect(url: &str) -> anyhow::Result<PgConnection> {
    PgConnection::connect(url).await.context("the database can't be reached")
}
