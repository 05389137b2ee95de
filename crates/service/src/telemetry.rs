//! Logging through `tracing`: for people on a terminal, or one JSON object a line.

use crate::{Error, config::TelemetryConfig, log_format::LogFormat};
use tracing_subscriber::{EnvFilter, fmt as log};

/// Starts logging to standard error. A second call in one process changes nothing.
///
/// # Errors
/// [`Error::BadValue`] if the filter can't be read.
pub fn start(config: &TelemetryConfig) -> Result<(), Error> {
    let filter = config.filter.as_deref().unwrap_or("info,sqlx=warn");
    let filter = EnvFilter::try_new(filter).map_err(|e| Error::BadValue {
        name: "MAREY_LOG",
        found: filter.to_owned(),
        expected: format!("a filter like \"info\": {e}"),
    })?;
    let builder = log::Subscriber::builder().with_env_filter(filter).with_writer(std::io::stderr);
    // An error here says only that logging was started before.
    let _ = match config.format {
        LogFormat::Pretty => tracing::subscriber::set_global_default(builder.compact().finish()),
        LogFormat::Json => tracing::subscriber::set_global_default(builder.json().finish()),
    };
    Ok(())
}
