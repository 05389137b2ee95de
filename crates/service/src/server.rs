//! The frame of a service process: a gRPC server and a worker loop that live and end together.

use crate::{Config, Error, database, health};
use queue::WorkerHandle;
use sqlx::PgPool;
use std::{net::SocketAddr, time::Duration};
use tokio::{
    net::TcpListener,
    task::{JoinError, JoinHandle},
};
use tokio_stream::{StreamExt, wrappers::TcpListenerStream};
use tokio_util::sync::CancellationToken;
use tonic::{service::Routes, transport::Server};

/// What makes one service different from another.
pub struct Parts<W> {
    /// Name in logs, such as `motion-index`.
    pub name: &'static str,
    /// Full names of its gRPC services, such as `marey.v1.MotionIndex`, for health.
    pub grpc_names: &'static [&'static str],
    /// Its gRPC services.
    pub routes: Routes,
    /// Encoded `FileDescriptorSet` of them, for reflection.
    pub descriptors: &'static [u8],
    /// Starts its worker loop; the token asks it to stop. `None` serves gRPC only.
    pub worker: Option<W>,
}

/// A service that was started.
#[derive(Debug)]
pub struct Running {
    /// Where its gRPC server listens.
    pub address: SocketAddr,
    task: JoinHandle<Result<(), Error>>,
}

impl Running {
    /// Waits until the service has stopped: asked to by its token, or because a part failed.
    ///
    /// # Errors
    /// Whatever made it stop, if that was not its token.
    pub async fn stopped(self) -> Result<(), Error> {
        joined(self.task.await)
    }
}

/// Listens, and starts the gRPC server (with health and reflection) and the worker loop.
///
/// The server answers at once; it says that it is ready, and jobs are claimed, when the database is there.
///
/// # Errors
/// If the address can't be listened on.
pub async fn start<W>(
    config: &Config,
    parts: Parts<W>,
    pool: PgPool,
    shutdown: CancellationToken,
) -> Result<Running, Error>
where
    W: FnOnce(CancellationToken) -> WorkerHandle + Send + 'static,
{
    let at = config.grpc.listen;
    let refuse = |source| Error::Listen { address: at, source };
    let listener = TcpListener::bind(at).await.map_err(refuse)?;
    let address = listener.local_addr().map_err(refuse)?;
    let (reporter, health_service) = tonic_health::server::health_reporter();
    // Whoever asks before the database was looked at must hear that the service is known and not ready.
    health::report(&reporter, parts.grpc_names, false).await;
    let reflection = tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(parts.descriptors)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        .build_v1()?;
    let routes = parts.routes.add_service(health_service).add_service(reflection);

    // Not the caller's token: a part that fails stops the others, not other services of the process.
    let stop = shutdown.child_token();
    let server = tokio::spawn(serve(parts.name, listener, routes, config.grpc.shutdown_grace, stop.clone()));
    tracing::info!(service = parts.name, %address, "listening");

    let task = async move {
        let follow = tokio::spawn(health::follow(reporter, parts.grpc_names, pool.clone(), stop.clone()));
        let work = work(parts.name, parts.worker, &pool, stop.clone());
        let (served, worked) = tokio::join!(ended(server, &stop), async {
            let result = work.await;
            stop.cancel();
            result
        });
        stop.cancel();
        let _ = follow.await;
        tracing::info!(service = parts.name, "stopped");
        served.and(worked)
    };
    Ok(Running { address, task: tokio::spawn(task) })
}

/// The server's result; whatever ends it stops the rest.
async fn ended(server: JoinHandle<Result<(), Error>>, stop: &CancellationToken) -> Result<(), Error> {
    let result = server.await;
    stop.cancel();
    joined(result)
}

/// A panic of a task goes on in whoever waits for it; a task that the runtime dropped has nothing to say.
fn joined(result: Result<Result<(), Error>, JoinError>) -> Result<(), Error> {
    match result.map_err(JoinError::try_into_panic) {
        Ok(result) => result,
        Err(Ok(panic)) => std::panic::resume_unwind(panic),
        Err(Err(_)) => Ok(()),
    }
}

async fn serve(
    service: &'static str,
    listener: TcpListener,
    routes: Routes,
    grace: Duration,
    stop: CancellationToken,
) -> Result<(), Error> {
    // Small answers must not wait for the acknowledgement of the last one.
    let incoming = TcpListenerStream::new(listener).map(|accepted| {
        let connection = accepted?;
        connection.set_nodelay(true)?;
        Ok::<_, std::io::Error>(connection)
    });
    let server = Server::builder()
        .http2_keepalive_interval(Some(Duration::from_secs(30)))
        .trace_fn(|request| tracing::debug_span!("rpc", method = request.uri().path()))
        .add_routes(routes)
        .serve_with_incoming_shutdown(incoming, stop.clone().cancelled_owned());
    let too_long = async {
        stop.cancelled().await;
        tokio::time::sleep(grace).await;
    };
    tokio::select! {
        result = server => match result {
            Err(source) => Err(Error::Serve { service, source }),
            Ok(()) if stop.is_cancelled() => Ok(()),
            Ok(()) => Err(Error::Ended { service, part: "gRPC server" }),
        },
        () = too_long => {
            tracing::warn!(service, "gRPC calls were cut off at the end of the grace period");
            Ok(())
        }
    }
}

async fn work<W>(
    service: &'static str,
    worker: Option<W>,
    pool: &PgPool,
    stop: CancellationToken,
) -> Result<(), Error>
where
    W: FnOnce(CancellationToken) -> WorkerHandle,
{
    match database::wait_until_ready(service, pool, &stop).await {
        Err(Error::StoppedEarly { .. }) => return Ok(()),
        other => other?,
    }
    let Some(start) = worker else {
        stop.cancelled().await;
        return Ok(());
    };
    start(stop.clone()).stopped().await;
    if stop.is_cancelled() { Ok(()) } else { Err(Error::Ended { service, part: "worker" }) }
}
