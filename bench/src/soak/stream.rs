//! A client of the gateway: single requests, and the event stream taken apart into events.

use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::Failure;

/// Nothing of the gateway takes longer: the stream is kept alive more often than this.
const PATIENCE: Duration = Duration::from_secs(60);

/// Sends a request; what comes back is still to be read.
pub(super) async fn ask(address: SocketAddr, path: &str) -> Result<TcpStream, Failure> {
    let mut stream = TcpStream::connect(address).await?;
    let request = format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    Ok(stream)
}

/// The body of an answer, as it comes.
pub(super) struct Body {
    stream: BufReader<TcpStream>,
    /// Bytes that it still has, where the head said how many.
    left: Option<usize>,
    line: String,
}

impl Body {
    /// Asks and reads the head of the answer.
    pub(super) async fn of(address: SocketAddr, path: &str) -> Result<Self, Failure> {
        let stream = BufReader::with_capacity(65_536, ask(address, path).await?);
        let mut body = Self { stream, left: None, line: String::new() };
        if !body.line().await?.starts_with("HTTP/1.1 200 ") {
            return Err(format!("{path}: {}", body.line.trim_end()).into());
        }
        loop {
            let header = body.line().await?.trim_end().to_ascii_lowercase();
            if header.is_empty() {
                return Ok(body);
            }
            if let Some(length) = header.strip_prefix("content-length:") {
                body.left = Some(length.trim().parse()?);
            }
        }
    }

    /// The whole of it.
    pub(super) async fn whole(mut self) -> Result<Vec<u8>, Failure> {
        let mut whole = Vec::new();
        while self.more(&mut whole).await? {}
        Ok(whole)
    }

    /// Appends the next part; false at the end.
    pub(super) async fn more(&mut self, out: &mut Vec<u8>) -> Result<bool, Failure> {
        let chunked = self.left.is_none();
        let count = match self.left.take() {
            Some(left) => left,
            None => usize::from_str_radix(self.line().await?.trim_end(), 16)?,
        };
        let start = out.len();
        out.resize(start + count, 0);
        timeout(PATIENCE, self.stream.read_exact(&mut out[start..])).await??;
        if chunked {
            self.line().await?;
            return Ok(count > 0);
        }
        self.left = Some(0);
        Ok(count > 0)
    }

    async fn line(&mut self) -> Result<&str, Failure> {
        self.line.clear();
        match timeout(PATIENCE, self.stream.read_line(&mut self.line)).await?? {
            0 => Err("the gateway closed a connection".into()),
            _ => Ok(&self.line),
        }
    }
}

/// The event stream.
pub(super) struct Events {
    body: Body,
    /// What has come and was not given out yet.
    bytes: Vec<u8>,
    given: usize,
}

/// One server-sent event.
pub(super) struct Event<'a> {
    pub(super) name: &'a str,
    pub(super) data: &'a str,
}

impl Events {
    pub(super) async fn open(address: SocketAddr, query: &str) -> Result<Self, Failure> {
        let body = Body::of(address, &format!("/api/v1/events{query}")).await?;
        Ok(Self { body, bytes: Vec::new(), given: 0 })
    }

    /// The next event; comments are passed over.
    pub(super) async fn next(&mut self) -> Result<Event<'_>, Failure> {
        let mut sought = 0;
        self.bytes.drain(..std::mem::take(&mut self.given));
        loop {
            let end = self.bytes[sought..].windows(2).position(|pair| pair == b"\n\n");
            let Some(end) = end.map(|end| sought + end + 2) else {
                sought = self.bytes.len().saturating_sub(1);
                if !self.body.more(&mut self.bytes).await? {
                    return Err("the gateway ended the event stream".into());
                }
                continue;
            };
            if self.bytes.starts_with(b":") {
                self.bytes.drain(..end);
                sought = 0;
                continue;
            }
            self.given = end;
            return Event::parse(std::str::from_utf8(&self.bytes[..end])?);
        }
    }
}

impl<'a> Event<'a> {
    fn parse(text: &'a str) -> Result<Self, Failure> {
        let field = |name: &str| {
            let mut values = text.lines().filter_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
            values.next().map(str::trim_start)
        };
        let (Some(name), Some(data)) = (field("event"), field("data")) else {
            return Err(format!("an event without a name or data: {text:.200}").into());
        };
        Ok(Self { name, data })
    }
}
