//! A real HTTP client, and one that reads server-sent events as the standard says.

use std::io::Write;
use std::net::SocketAddr;

use flate2::write::GzDecoder;
use http_body_util::{BodyExt, Empty};
use hyper::body::{Bytes, Incoming};
use hyper::client::conn::http1;
use hyper::{HeaderMap, Request, Response, StatusCode};
use hyper_util::rt::TokioIo;
use serde_json::Value;
use tokio::net::TcpStream;
use tokio::task::JoinHandle;
use tokio::time::timeout;

use super::PATIENCE;

/// Talks to one gateway; every request has a connection of its own.
#[derive(Clone)]
pub(crate) struct Client {
    address: SocketAddr,
}

/// Sends requests over one connection.
type Sender = http1::SendRequest<Empty<Bytes>>;

/// One whole answer.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) status: StatusCode,
    pub(crate) headers: HeaderMap,
    pub(crate) body: String,
}

impl Answer {
    /// The body of a good answer.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        assert_eq!(self.status, StatusCode::OK, "{}", self.body);
        serde_json::from_str(&self.body).unwrap()
    }

    /// The sentence of a problem document.
    #[track_caller]
    pub(crate) fn problem(&self, status: u16) -> String {
        assert_eq!(self.status, status, "{}", self.body);
        assert_eq!(self.header("content-type"), "application/problem+json");
        let problem: Value = serde_json::from_str(&self.body).unwrap();
        assert_eq!(problem["status"], status);
        problem["detail"].as_str().unwrap().to_owned()
    }

    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }
}

impl Client {
    pub(crate) fn new(address: SocketAddr) -> Self {
        Self { address }
    }

    pub(crate) async fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[]).await
    }

    pub(crate) async fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> Answer {
        let whole = async {
            let response = self.send(method, path, headers).await;
            let (head, body) = response.into_parts();
            let body = body.collect().await.unwrap().to_bytes();
            Answer {
                status: head.status,
                headers: head.headers,
                body: String::from_utf8_lossy(&body).into_owned(),
            }
        };
        timeout(PATIENCE, whole).await.unwrap()
    }

    /// The event stream.
    pub(crate) async fn events(&self, query: &str) -> Stream {
        self.events_with(query, &[]).await
    }

    /// The same with headers; compressed if they ask for it.
    pub(crate) async fn events_with(&self, query: &str, headers: &[(&str, &str)]) -> Stream {
        let response = self.send("GET", &format!("/api/v1/events{query}"), headers).await;
        assert_eq!(response.status(), StatusCode::OK);
        assert_eq!(response.headers()["content-type"], "text/event-stream");
        let encodings: Vec<_> = response.headers().get_all("content-encoding").iter().collect();
        let packed = encodings == ["gzip"];
        assert!(packed || encodings.is_empty(), "once at most: {encodings:?}");
        let unpack = packed.then(|| GzDecoder::new(Vec::new()));
        Stream { body: response.into_body(), unpack, text: String::new() }
    }

    /// A connection that asks for the event stream and never reads a byte of it.
    pub(crate) async fn never_reads(&self) -> TcpStream {
        use tokio::io::AsyncWriteExt;
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        stream.write_all(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n").await.unwrap();
        stream
    }

    /// A connection that got an answer and now waits for nothing; the second half ends with it.
    pub(crate) async fn keeps_its_connection(&self) -> (Sender, JoinHandle<()>) {
        let (mut sender, connection) = self.connect().await;
        let request =
            Request::builder().uri("/healthz").header("host", "localhost").body(Empty::new()).unwrap();
        sender.send_request(request).await.unwrap().into_body().collect().await.unwrap();
        (sender, connection)
    }

    async fn connect(&self) -> (Sender, JoinHandle<()>) {
        let stream = TcpStream::connect(self.address).await.unwrap();
        let (sender, connection) = http1::handshake(TokioIo::new(stream)).await.unwrap();
        let connection = tokio::spawn(async {
            // How it ends does not matter, only that it does.
            let _ = connection.await;
        });
        (sender, connection)
    }

    async fn send(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> Response<Incoming> {
        let (mut sender, _) = self.connect().await;
        let mut request = Request::builder().method(method).uri(path);
        if !headers.iter().any(|(name, _)| *name == "host") {
            request = request.header("host", self.address.to_string());
        }
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        sender.send_request(request.body(Empty::<Bytes>::new()).unwrap()).await.unwrap()
    }
}

/// A reader of the event stream.
pub(crate) struct Stream {
    body: Incoming,
    unpack: Option<GzDecoder<Vec<u8>>>,
    text: String,
}

/// One event.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Event {
    pub(crate) name: String,
    pub(crate) data: Value,
    pub(crate) id: Option<String>,
}

impl Stream {
    /// The next event; none when the stream has ended.
    pub(crate) async fn next(&mut self) -> Option<Event> {
        loop {
            if let Some((event, rest)) = self.text.split_once("\n\n") {
                let event = parse(event);
                self.text = rest.to_owned();
                match event {
                    Some(event) => return Some(event),
                    None => continue,
                }
            }
            let frame = timeout(PATIENCE, self.body.frame()).await.expect("an event in time")?;
            let data = frame.ok()?.into_data().unwrap();
            let data = self.unpacked(&data);
            self.text.push_str(std::str::from_utf8(&data).unwrap());
        }
    }

    /// What can be read of what came: all of it, or the sender held something back.
    fn unpacked(&mut self, data: &[u8]) -> Vec<u8> {
        let Some(unpack) = &mut self.unpack else { return data.to_vec() };
        unpack.write_all(data).unwrap();
        unpack.flush().unwrap();
        std::mem::take(unpack.get_mut())
    }

    /// Reads to the end; whether the stream was sent to its end, and its checksum is right.
    pub(crate) async fn ends_well(&mut self) -> bool {
        while self.next().await.is_some() {}
        self.unpack.as_mut().is_none_or(|unpack| unpack.try_finish().is_ok())
    }

    /// The next event that is as wanted; what comes before it is passed over.
    pub(crate) async fn until(&mut self, wanted: impl Fn(&Event) -> bool) -> Event {
        let found = async {
            loop {
                let event = self.next().await.expect("the stream goes on");
                if wanted(&event) {
                    return event;
                }
            }
        };
        timeout(PATIENCE, found).await.expect("such an event in time")
    }
}

/// An event, or none for a comment.
fn parse(text: &str) -> Option<Event> {
    let field = |name: &str| text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
    Some(Event {
        name: field("event")?.to_owned(),
        data: serde_json::from_str(field("data")?).unwrap(),
        id: field("id").map(str::to_owned),
    })
}
