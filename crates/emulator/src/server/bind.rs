//! From an endpoint to something that clients can reach.

use std::io;
use std::sync::Arc;

use busbar_link::{Endpoint, LineTimer, Serial, SerialPort};
use tokio::net::{TcpListener, lookup_host};
use tokio::task::JoinSet;

use super::door::Door;
use super::serial::{self, Port};
use super::tcp;
use crate::error::StartError;

/// What stands for a new pseudo-terminal where a device path could stand.
pub(crate) const NEW_PTY: &str = "pty";

/// Bound, and nobody served yet.
#[derive(Debug)]
pub(super) enum Socket {
    Listener(TcpListener),
    Line { port: Port, timer: LineTimer, serial: Serial },
}

impl Socket {
    /// Binds an endpoint; the endpoint that comes back is what clients use.
    pub(super) async fn bind(endpoint: &Endpoint) -> Result<(Endpoint, Self), StartError> {
        match endpoint {
            Endpoint::Tcp { host, port } => {
                let (listener, host, port) = listen(endpoint, host, *port).await?;
                Ok((Endpoint::Tcp { host, port }, Self::Listener(listener)))
            }
            Endpoint::RtuTcp { host, port } => {
                let (listener, host, port) = listen(endpoint, host, *port).await?;
                Ok((Endpoint::RtuTcp { host, port }, Self::Listener(listener)))
            }
            Endpoint::Rtu { path, serial } => {
                let (port, path) = match path.as_str() {
                    NEW_PTY => pseudo(endpoint, serial)?,
                    path => {
                        let port = SerialPort::open(path, serial).map_err(|problem| {
                            StartError::SerialDevice { endpoint: endpoint.clone(), problem }
                        })?;
                        (Port::Device(port), path.to_owned())
                    }
                };
                let (serial, url) = (*serial, Endpoint::Rtu { path, serial: *serial });
                Ok((url, Self::Line { port, timer: LineTimer::new(), serial }))
            }
            _ => Err(StartError::Transport { endpoint: endpoint.clone() }),
        }
    }

    /// Serves whoever comes, in tasks of the set.
    pub(super) fn open(self, door: Arc<Door>, tasks: &mut JoinSet<()>) {
        match self {
            Self::Listener(listener) => tasks.spawn(tcp::accept(listener, door)),
            Self::Line { port, timer, serial } => tasks.spawn(serial::serve(port, timer, serial, door)),
        };
    }
}

async fn listen(
    endpoint: &Endpoint,
    host: &str,
    port: u16,
) -> Result<(TcpListener, String, u16), StartError> {
    let addresses: Vec<_> = match lookup_host((host, port)).await {
        Ok(addresses) => addresses.collect(),
        Err(_) => return Err(StartError::UnknownHost { endpoint: endpoint.clone() }),
    };
    let failed = |error| refused(endpoint, &error);
    let listener = TcpListener::bind(addresses.as_slice()).await.map_err(failed)?;
    let local = listener.local_addr().map_err(failed)?;
    Ok((listener, local.ip().to_string(), local.port()))
}

#[cfg(target_os = "linux")]
fn pseudo(endpoint: &Endpoint, serial: &Serial) -> Result<(Port, String), StartError> {
    let pty = super::pty::Pty::open(serial).map_err(|error| refused(endpoint, &error))?;
    let path = pty.path().to_owned();
    Ok((Port::Pseudo(pty), path))
}

#[cfg(not(target_os = "linux"))]
fn pseudo(endpoint: &Endpoint, _: &Serial) -> Result<(Port, String), StartError> {
    Err(StartError::NoPseudoTerminal { endpoint: endpoint.clone() })
}

fn refused(endpoint: &Endpoint, error: &io::Error) -> StartError {
    StartError::Listen { endpoint: endpoint.clone(), kind: error.kind() }
}
