//! The connection in use, whatever it is made of, and how each kind is made.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpStream, lookup_host};
use tokio::task::spawn_blocking;
use tokio::time::timeout;

use crate::endpoint::{Endpoint, Serial};
use crate::error::Cause;
use crate::serial::{SerialError, SerialPort};

/// One connection.
#[derive(Debug)]
pub(crate) enum Stream {
    Tcp(TcpStream),
    /// Boxed: most wires are TCP, and there may be thousands.
    Serial(Box<SerialPort>),
}

impl Stream {
    /// Connects to where the endpoint leads.
    pub(crate) async fn connect(endpoint: Arc<Endpoint>, limit: Duration) -> Result<Self, Cause> {
        match &*endpoint {
            Endpoint::Tcp { host, port } | Endpoint::RtuTcp { host, port } => {
                connect_to_host(host, *port, limit).await.map(Self::Tcp)
            }
            Endpoint::Rtu { path, serial } => open_port(path.clone(), *serial, limit).await,
            // `Link::open` lets nothing else through.
            Endpoint::Tls { .. } => Err(Cause::Unreachable),
        }
    }

    /// Writes what the system takes at once.
    pub(crate) fn try_write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Tcp(stream) => stream.try_write(bytes),
            Self::Serial(port) => {
                let mut nobody = Context::from_waker(Waker::noop());
                match Pin::new(port).poll_write(&mut nobody, bytes) {
                    Poll::Ready(result) => result,
                    Poll::Pending => Ok(0),
                }
            }
        }
    }

    pub(crate) fn poll_write(&mut self, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<Result<usize, Cause>> {
        let written = match self {
            Self::Tcp(stream) => Pin::new(stream).poll_write(cx, bytes),
            Self::Serial(port) => Pin::new(port).poll_write(cx, bytes),
        };
        written.map_err(|error| self.cause(&error))
    }

    pub(crate) fn poll_read(
        &mut self,
        cx: &mut Context<'_>,
        space: &mut ReadBuf<'_>,
    ) -> Poll<Result<(), Cause>> {
        let read = match self {
            Self::Tcp(stream) => Pin::new(stream).poll_read(cx, space),
            Self::Serial(port) => Pin::new(port).poll_read(cx, space),
        };
        read.map(|result| match result {
            Ok(()) if space.filled().is_empty() => Err(self.end()),
            Ok(()) => Ok(()),
            Err(error) => Err(self.cause(&error)),
        })
    }

    /// What it means that no more bytes will come.
    fn end(&self) -> Cause {
        match self {
            Self::Tcp(_) => Cause::Closed,
            Self::Serial(_) => Cause::Vanished,
        }
    }

    fn cause(&self, error: &io::Error) -> Cause {
        match self {
            Self::Tcp(_) => Cause::from(error),
            Self::Serial(_) => match SerialError::from(error) {
                SerialError::Gone => Cause::Vanished,
                other => Cause::Serial(other),
            },
        }
    }
}

/// Connects to a host. To look its name up takes no longer than to connect.
async fn connect_to_host(host: &str, port: u16, limit: Duration) -> Result<TcpStream, Cause> {
    let addresses = match timeout(limit, lookup_host((host, port))).await {
        Ok(Ok(addresses)) => addresses,
        Ok(Err(_)) | Err(_) => return Err(Cause::UnknownHost),
    };
    connect_to(addresses, limit).await
}

/// Connects to the first address that takes us. Each has the whole limit, so that one that is dead does not use up the
/// time of the next.
async fn connect_to(
    addresses: impl Iterator<Item = SocketAddr>,
    limit: Duration,
) -> Result<TcpStream, Cause> {
    let mut cause = Cause::UnknownHost;
    for address in addresses {
        cause = match timeout(limit, TcpStream::connect(address)).await {
            Ok(Ok(stream)) => {
                stream.set_nodelay(true).map_err(|error| Cause::from(&error))?;
                return Ok(stream);
            }
            Ok(Err(error)) => Cause::from(&error),
            Err(_) => Cause::ConnectTimedOut { after: limit },
        };
    }
    Err(cause)
}

/// Opens a serial port where it may block: some drivers take their time.
async fn open_port(path: String, serial: Serial, limit: Duration) -> Result<Stream, Cause> {
    match timeout(limit, spawn_blocking(move || SerialPort::open(&path, &serial))).await {
        Ok(Ok(opened)) => opened.map(Box::new).map(Stream::Serial).map_err(Cause::Serial),
        // A driver that does not come back has lost its device.
        Ok(Err(_)) | Err(_) => Err(Cause::Serial(SerialError::Gone)),
    }
}

#[cfg(test)]
mod tests {
    use tokio::net::{TcpListener, TcpSocket};

    use super::*;

    /// An address whose queue is full: attempts to connect to it hang.
    async fn dead_address() -> io::Result<(SocketAddr, impl Sized)> {
        let socket = TcpSocket::new_v4()?;
        socket.bind(SocketAddr::from(([127, 0, 0, 1], 0)))?;
        let listener = socket.listen(0)?;
        let address = listener.local_addr()?;
        let mut fillers = Vec::new();
        while let Ok(filler) = timeout(Duration::from_millis(100), TcpStream::connect(address)).await {
            fillers.push(filler?);
        }
        Ok((address, (listener, fillers)))
    }

    #[tokio::test]
    async fn a_dead_address_leaves_time_for_the_next() {
        let (dead, _filled) = dead_address().await.unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let good = listener.local_addr().unwrap();
        let limit = Duration::from_millis(200);
        let stream = connect_to([dead, good].into_iter(), limit).await.unwrap();
        assert_eq!(stream.peer_addr().unwrap(), good);
        let refused = connect_to([dead].into_iter(), limit).await.unwrap_err();
        assert_eq!(refused, Cause::ConnectTimedOut { after: limit });
    }
}
