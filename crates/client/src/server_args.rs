use crate::Server;

/// The server to talk to, and the client for it.
#[derive(Debug, clap::Args)]
pub struct ServerArgs {
    /// Server to talk to, such as http://127.0.0.1:8080 [default: the one that `marey up` started in this folder or above]
    #[arg(long, env = "MAREY_URL", global = true, help_heading = "Server")]
    url: Option<String>,
    /// API key of a project on that server
    #[arg(long, env = "MAREY_API_KEY", global = true, hide_env_values = true, help_heading = "Server")]
    api_key: Option<String>,
}

impl ServerArgs {
    /// The server meant.
    ///
    /// # Errors
    /// If none is named and none was started here.
    pub fn server(&self) -> anyhow::Result<Server> {
        Server::find(self.url.clone(), self.api_key.clone())
    }
}
