//! Why a service can't start or has to stop.

/// An error of the frame around a service.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A variable that must be set is not.
    #[error("{name} is not set: expected {expected}")]
    NotSet {
        /// The variable.
        name: &'static str,
        /// What should be there.
        expected: &'static str,
    },
    /// A variable has a value that can't be used.
    #[error("{name} is {found:?}, expected {expected}")]
    BadValue {
        /// The variable.
        name: &'static str,
        /// Its value.
        found: String,
        /// What should be there.
        expected: String,
    },
    /// The database's URL can't be used.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
    /// The object store can't be opened.
    #[error(transparent)]
    Store(#[from] store::Error),
    /// The address can't be listened on.
    #[error("can't listen on {address}: {source}")]
    Listen {
        /// The address as configured.
        address: std::net::SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The gRPC server failed.
    #[error("gRPC server of {service} failed: {source}")]
    Serve {
        /// The service.
        service: &'static str,
        /// tonic's reason.
        source: tonic::transport::Error,
    },
    /// The contracts compiled into the program can't be offered for reflection.
    #[error("reflection: {0}")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// A part ended although nobody asked it to.
    #[error("{part} of {service} ended without being asked to")]
    Ended {
        /// The service.
        service: &'static str,
        /// Which part.
        part: &'static str,
    },
    /// Shutdown was asked for before the service had started.
    #[error("{service} was stopped while it waited for the database")]
    StoppedEarly {
        /// The service.
        service: &'static str,
    },
}
