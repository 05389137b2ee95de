use std::path::PathBuf;

/// Where a cluster lives.
#[derive(Debug, Clone)]
pub struct Config {
    /// Folder of the data, absolute; made when missing, given to the user that runs the server.
    pub data_dir: PathBuf,
    /// Folder of the socket, absolute and short; likewise.
    pub socket_dir: PathBuf,
    /// Whether the data survive a crash of the machine, and the end of this process. If not, nothing is
    /// flushed to the disk and both folders are removed in the end.
    pub durable: bool,
}
