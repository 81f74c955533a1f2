//! What is no request never reaches a route: hyper refuses it by itself, and without a word. Here it gets one.

use std::io::{self, IoSlice};
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use axum::http::StatusCode;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::api::Problem;

/// A stream that puts a problem into refusals that have no body.
#[derive(Debug)]
pub(crate) struct Worded<S> {
    stream: S,
    /// A refusal on its way: what is still to be written, and how much it stands for.
    refusal: Option<(Vec<u8>, usize)>,
}

impl<S: AsyncWrite + Unpin> Worded<S> {
    pub(crate) fn new(stream: S) -> Self {
        Self { stream, refusal: None }
    }

    /// Writes the refusal that is on its way to its end.
    fn finish(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<usize>> {
        while let Some((text, stands_for)) = &mut self.refusal {
            if text.is_empty() {
                let stands_for = *stands_for;
                self.refusal = None;
                return Poll::Ready(Ok(stands_for));
            }
            let written = ready!(Pin::new(&mut self.stream).poll_write(cx, text))?;
            if written == 0 {
                return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
            }
            text.drain(..written);
        }
        Poll::Ready(Ok(0))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Worded<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        if self.refusal.is_none() {
            match worded(bytes) {
                Some(text) => self.refusal = Some((text, bytes.len())),
                None => return Pin::new(&mut self.stream).poll_write(cx, bytes),
            }
        }
        self.finish(cx)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        match bytes.iter().find(|slice| !slice.is_empty()) {
            Some(first) if self.refusal.is_some() || is_bare_refusal(first) => self.poll_write(cx, first),
            _ => Pin::new(&mut self.stream).poll_write_vectored(cx, bytes),
        }
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Worded<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(cx, bytes)
    }
}

const NO_BODY: &str = "content-length: 0\r\n";

/// Every refusal of ours has a body and says of which type.
fn is_bare_refusal(bytes: &[u8]) -> bool {
    if !(bytes.starts_with(b"HTTP/1.") && bytes.get(9) == Some(&b'4') && bytes.ends_with(b"\r\n\r\n")) {
        return false;
    }
    let head = String::from_utf8_lossy(bytes);
    head.contains(NO_BODY) && !head.contains("content-type: ")
}

/// The same refusal with a problem in it.
fn worded(bytes: &[u8]) -> Option<Vec<u8>> {
    if !is_bare_refusal(bytes) {
        return None;
    }
    let head = std::str::from_utf8(bytes).ok()?;
    let status: StatusCode = head.get(9..12)?.parse().ok()?;
    let detail = match status {
        StatusCode::URI_TOO_LONG => "the address is too long; ask for less at a time",
        StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE => {
            "the head of the request has more than 100 fields or 32 KiB; send fewer and shorter ones"
        }
        _ => {
            "this is no request of HTTP/1.1: its first line, a header field or its framing is wrong; mend the client"
        }
    };
    let problem = serde_json::to_string(&Problem::new(status, detail)).ok()?;
    let fields = format!(
        "content-type: {}\r\ncontent-length: {}\r\nx-content-type-options: nosniff\r\n",
        Problem::CONTENT_TYPE,
        problem.len()
    );
    Some((head.replacen(NO_BODY, &fields, 1) + &problem).into_bytes())
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    use super::*;

    const BARE: &str = "HTTP/1.1 431 Request Header Fields Too Large\r\nconnection: close\r\ncontent-length: 0\r\ndate: today\r\n\r\n";

    #[tokio::test]
    async fn a_refusal_without_a_body_gets_one_however_slowly_it_leaves() {
        let (ours, mut theirs) = duplex(7);
        let mut ours = Worded::new(ours);
        let writer = tokio::spawn(async move {
            ours.write_all(BARE.as_bytes()).await.unwrap();
            ours.write_all(b"more").await.unwrap();
        });
        let mut text = String::new();
        theirs.read_to_string(&mut text).await.unwrap();
        writer.await.unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 431 ") && head.ends_with("\r\ndate: today"), "{head}");
        assert!(head.contains("content-type: application/problem+json\r\n"), "{head}");
        let problem = body.strip_suffix("more").unwrap();
        assert!(head.contains(&format!("content-length: {}\r\n", problem.len())), "{text}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(problem).unwrap()["status"], 431);
    }

    #[test]
    fn everything_else_leaves_as_it_is() {
        for text in [
            BARE.replace("431", "200"),
            BARE.replace("content-length: 0", "content-length: 9"),
            BARE.replace("date: today", "content-type: text/plain"),
            format!("{BARE}x"),
            format!("x{BARE}"),
            String::new(),
        ] {
            assert_eq!(worded(text.as_bytes()), None, "{text}");
        }
    }
}
