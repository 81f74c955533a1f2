//! A server of its own for one program: accepts connections, bounds them, and ends with the program.

use std::io;
use std::net::SocketAddr;
use std::pin::pin;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinSet;
use tokio::time::{sleep, timeout};

use super::token::Token;
use super::{Control, guard, router};

/// Further connections wait until one of these ends.
const MOST_CONNECTIONS: usize = 64;
/// A client has this long to send the head of a request, and a connection may be idle for as long.
const HEAD: Duration = Duration::from_secs(10);
/// No connection lasts longer, whatever its client does or does not read.
const LIFETIME: Duration = Duration::from_secs(600);
/// The longest head of a request.
const BUFFER: usize = 16 * 1024;

/// The control was not started; nothing of it is left running.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// Others than this machine could reach it, and nothing keeps them from using it.
    #[error(
        "the control does not listen on {address} without a token, for others can reach that; listen on 127.0.0.1, or \
         give a token"
    )]
    NoToken {
        /// The address asked for.
        address: SocketAddr,
    },
    /// The system refused the port.
    #[error("the control cannot listen on {address}: {}", crate::error::listen_reason(*.kind))]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// What the system said.
        kind: io::ErrorKind,
    },
}

/// A running control. Dropped, it ends.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    tasks: JoinSet<()>,
}

/// Whether a control may be served at an address: with a token anywhere, without one for this machine alone.
///
/// # Errors
/// [`ServeError::NoToken`].
pub fn may_listen(address: SocketAddr, token: Option<&Token>) -> Result<(), ServeError> {
    match token.is_some() || address.ip().to_canonical().is_loopback() {
        true => Ok(()),
        false => Err(ServeError::NoToken { address }),
    }
}

/// Serves API and page at the root of an address; port 0 takes a free one.
///
/// # Errors
/// The address is not of this machine alone and there is no token, or it cannot be listened on.
pub async fn serve(address: SocketAddr, control: Control) -> Result<Server, ServeError> {
    may_listen(address, control.token.as_ref())?;
    let refused = |error: io::Error| ServeError::Listen { address, kind: error.kind() };
    let listener = TcpListener::bind(address).await.map_err(refused)?;
    let bound = listener.local_addr().map_err(refused)?;
    let routes = guard::hosted(router(control), bound.ip());
    let mut tasks = JoinSet::new();
    tasks.spawn(accept(listener, routes));
    Ok(Server { address: bound, tasks })
}

impl Server {
    /// Where it listens, with the port that the system chose.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Drops every connection and frees the port.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
    }
}

async fn accept(listener: TcpListener, routes: Router) {
    let mut connections = JoinSet::new();
    loop {
        while connections.len() >= MOST_CONNECTIONS {
            connections.join_next().await;
        }
        while connections.try_join_next().is_some() {}
        match listener.accept().await {
            Ok((stream, _)) => {
                connections.spawn(connection(stream, routes.clone()));
            }
            Err(error) => {
                // Out of file handles, most likely: it passes, and trying at once would only burn the processor.
                tracing::warn!(%error, "the control cannot accept a connection");
                sleep(Duration::from_millis(100)).await;
            }
        }
    }
}

async fn connection(stream: TcpStream, routes: Router) {
    let mut server = http1::Builder::new();
    server.timer(TokioTimer::new()).header_read_timeout(HEAD).max_buf_size(BUFFER);
    let service = TowerToHyperService::new(routes);
    let mut connection = pin!(server.serve_connection(TokioIo::new(stream), service));
    match timeout(LIFETIME, connection.as_mut()).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::debug!(%error, "a connection to the control broke"),
        Err(_) => {
            connection.as_mut().graceful_shutdown();
            let _ = timeout(HEAD, connection).await;
        }
    }
}
