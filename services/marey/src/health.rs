//! `marey health`: for probes of containers, which have no other client.

use std::time::Duration;

use anyhow::{Context, bail};
use tonic_health::pb::{
    HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient,
};

use crate::serve::runtime;

/// An answer that takes longer is none.
const TIMEOUT: Duration = Duration::from_secs(3);

/// Ask a service whether it is healthy; for health checks of containers
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  marey health http://127.0.0.1:8080         # the gateway: asks /readyz
  marey health grpc://127.0.0.1:50051        # a gRPC service: asks grpc.health.v1")]
pub struct Args {
    /// http://…, https://… or grpc://…
    url: String,
}

/// Runs `marey health`.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match args.url.strip_prefix("grpc://") {
        Some(address) => runtime()?.block_on(grpc(address))?,
        None => http(&args.url)?,
    }
    println!("ok");
    Ok(())
}

fn http(url: &str) -> anyhow::Result<()> {
    let has_path = url.split_once("://").is_some_and(|(_, rest)| rest.trim_end_matches('/').contains('/'));
    let url = if has_path { url.to_owned() } else { format!("{}/readyz", url.trim_end_matches('/')) };
    let agent = ureq::Agent::config_builder().timeout_global(Some(TIMEOUT)).build().new_agent();
    match agent.get(&url).call() {
        Ok(_) => Ok(()),
        Err(ureq::Error::StatusCode(status)) => bail!("{url} answers {status}"),
        Err(error) => Err(error).with_context(|| format!("{url} can't be asked")),
    }
}

async fn grpc(address: &str) -> anyhow::Result<()> {
    let check = async {
        let channel = tonic::transport::Endpoint::from_shared(format!("http://{address}"))?.connect().await?;
        let asked = HealthClient::new(channel).check(HealthCheckRequest { service: String::new() }).await;
        let answer = asked.map_err(|status| anyhow::anyhow!("{}", status.message()))?;
        anyhow::Ok(answer.into_inner().status())
    };
    let status = tokio::time::timeout(TIMEOUT, check)
        .await
        .with_context(|| format!("{address} does not answer"))?
        .with_context(|| format!("{address} can't be asked"))?;
    if status != ServingStatus::Serving {
        bail!("{address} says {}", status.as_str_name());
    }
    Ok(())
}
