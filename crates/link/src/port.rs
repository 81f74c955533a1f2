//! Where a wire meets the system: the connection and the frame under way.

use std::task::{Context, Poll, ready};

use tokio::io::ReadBuf;

use crate::error::Cause;
use crate::stream::Stream;

/// A connection that never makes anybody wait: what the system does not take or give at once comes later.
#[derive(Debug, Default)]
pub(crate) struct Port {
    stream: Option<Stream>,
    /// The request under way; to be written just before `start`.
    pub(crate) frame: Vec<u8>,
    sent: usize,
}

impl Port {
    pub(crate) fn open(&mut self, stream: Stream) {
        self.stream = Some(stream);
    }

    pub(crate) fn close(&mut self) {
        self.stream = None;
        self.frame.clear();
        self.sent = 0;
    }

    /// Sends a new frame, and says how much of it the system took.
    pub(crate) fn start(&mut self) -> usize {
        // An error shows again when the rest is sent, and is told then.
        let sent = self.stream.as_mut().map(|stream| stream.try_write(&self.frame));
        self.sent = sent.and_then(Result::ok).unwrap_or(0);
        self.sent
    }

    /// How much of the frame the system has taken.
    pub(crate) fn sent(&self) -> usize {
        self.sent
    }

    /// Whether some of the frame is still to be sent.
    pub(crate) fn is_blocked(&self) -> bool {
        self.sent < self.frame.len()
    }

    /// Sends the rest of the frame.
    pub(crate) fn poll_rest(&mut self, cx: &mut Context<'_>) -> Poll<Result<(), Cause>> {
        while let (Some(stream), Some(rest @ [_, ..])) = (&mut self.stream, self.frame.get(self.sent..)) {
            match ready!(stream.poll_write(cx, rest)) {
                Ok(bytes) => self.sent += bytes,
                Err(cause) => return Poll::Ready(Err(cause)),
            }
        }
        Poll::Ready(Ok(()))
    }

    /// Takes in what has come. Whoever asked last and got nothing is woken when something comes.
    pub(crate) fn poll_read(
        &mut self,
        cx: &mut Context<'_>,
        space: &mut ReadBuf<'_>,
    ) -> Poll<Result<(), Cause>> {
        match &mut self.stream {
            Some(stream) => stream.poll_read(cx, space),
            None => Poll::Pending,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use tokio::io::AsyncReadExt;
    use tokio::net::{TcpListener, TcpStream};

    use super::*;

    /// A port, and the other end of its connection.
    async fn connected() -> (Port, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).await.unwrap();
        let mut port = Port::default();
        port.open(Stream::Tcp(stream));
        (port, listener.accept().await.unwrap().0)
    }

    #[tokio::test]
    async fn sends_the_rest_when_the_peer_takes_it() {
        let (mut port, mut peer) = connected().await;
        // No frame is so long, but buffers of the system are.
        port.frame = (0..16_000_000_u32).map(|byte| byte.to_le_bytes()[0]).collect();
        assert!(port.start() < port.frame.len(), "more than the system takes at once");
        assert!(port.is_blocked());

        let mut received = vec![0; port.frame.len()];
        let (rest, read) = tokio::join!(poll_fn(|cx| port.poll_rest(cx)), peer.read_exact(&mut received));
        assert_eq!(rest, Ok(()));
        read.unwrap();
        assert!(!port.is_blocked());
        assert!(received == port.frame);
    }

    #[tokio::test]
    async fn tells_of_a_broken_connection_when_the_rest_is_sent() {
        let (mut port, peer) = connected().await;
        peer.set_zero_linger().unwrap();
        drop(peer);
        let mut space = [0; 8];
        let read = poll_fn(|cx| port.poll_read(cx, &mut ReadBuf::new(&mut space))).await;
        assert_eq!(read, Err(Cause::Reset));

        port.frame = vec![0; 12];
        assert_eq!(port.start(), 0);
        assert_eq!(poll_fn(|cx| port.poll_rest(cx)).await, Err(Cause::Reset));
        port.close();
        assert!(!port.is_blocked());
    }
}
