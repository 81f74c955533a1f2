//! Clients that mean harm, or whose programs are broken, over real sockets: each gets what it deserves, and the device
//! is polled meanwhile as if nobody was there.

use std::time::Duration;

use busbar_gateway::Limits;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::{sleep, timeout};

use crate::support::{Bench, PATIENCE, until};

/// What would make its values stale. Polled twenty times a second, a device never waits nearly as long.
const STALE: Duration = Duration::from_secs(5);

/// Limits that a test need not wait long for.
const SHORT: Duration = Duration::from_millis(300);

/// The device goes on being polled, and never had to wait until its values were stale.
async fn keeps_its_pace(bench: &Bench) {
    let reads = async || bench.device.change(|device| device.times.len());
    let before = reads().await;
    until(reads, |now| *now > before + 50).await;
    let times = bench.device.change(|device| device.times.clone());
    let longest = times.windows(2).map(|pair| pair[1].0 - pair[0].0).max().unwrap();
    assert!(longest < STALE, "polling stood still for {longest:?}");
    let value = bench.value("genset_l1_voltage").await;
    assert_eq!((&value["value"], &value["quality"]), (&serde_json::json!(230.2), &"good".into()));
}

async fn connect(bench: &Bench) -> TcpStream {
    TcpStream::connect(bench.gateway.address()).await.unwrap()
}

/// Whatever comes back until the other end closes; sends nothing any more.
async fn rest(mut stream: TcpStream) -> String {
    let mut text = Vec::new();
    // A reset is an end like any other.
    let _ = timeout(PATIENCE, stream.read_to_end(&mut text)).await.expect("it is closed in time");
    String::from_utf8_lossy(&text).into_owned()
}

/// Sends these bytes and says what came back.
async fn answer(bench: &Bench, bytes: impl AsRef<[u8]>) -> String {
    let mut stream = connect(bench).await;
    // It may be answered and closed before everything was sent.
    let _ = stream.write_all(bytes.as_ref()).await;
    rest(stream).await
}

/// A request that asks for the connection to be closed after it.
fn request(line: &str) -> String {
    format!("{line} HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
}

#[track_caller]
fn status(answer: &str) -> u16 {
    let line = answer.lines().next().unwrap_or_default();
    let code = line.strip_prefix("HTTP/1.1 ").or_else(|| line.strip_prefix("HTTP/1.0 "));
    code.and_then(|code| code.split(' ').next()?.parse().ok())
        .unwrap_or_else(|| panic!("no answer: {answer:?}"))
}

#[track_caller]
fn is_problem(answer: &str, code: u16) {
    assert_eq!(status(answer), code, "{answer}");
    assert!(answer.contains("content-type: application/problem+json\r\n"), "{answer}");
    let (_, body) = answer.split_once("\r\n\r\n").unwrap();
    let problem: serde_json::Value = serde_json::from_str(body).unwrap();
    assert_eq!(problem["status"], code);
}

async fn quick() -> Bench {
    let limits = Limits { head: SHORT, write: SHORT, ..Limits::default() };
    let bench = Bench::bound(|_| {}, Some(limits)).await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    bench
}

async fn ready() -> Bench {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    bench
}

#[tokio::test(flavor = "multi_thread")]
async fn a_head_that_comes_byte_by_byte_is_cut_off() {
    let bench = quick().await;
    let (mut reader, mut writer) = connect(&bench).await.into_split();
    let dribble = tokio::spawn(async move {
        writer.write_all(b"GET /api/v1/site HTTP/1.1\r\nhost: localhost\r\nx: ").await.unwrap();
        while writer.write_all(b"a").await.is_ok() {
            sleep(Duration::from_millis(20)).await;
        }
    });
    let mut text = Vec::new();
    let _ = timeout(PATIENCE, reader.read_to_end(&mut text)).await.expect("it is cut off");
    assert_eq!(String::from_utf8_lossy(&text), "", "there is nothing to say to half a request");
    dribble.abort();
    assert_eq!(rest(connect(&bench).await).await, "", "nor to a client that says nothing at all");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_body_that_nobody_asked_for_is_not_waited_for() {
    let bench = ready().await;
    for kind in ["content-length: 1000000000", "transfer-encoding: chunked"] {
        let mut stream = connect(&bench).await;
        let head = format!("GET /api/v1/alarms HTTP/1.1\r\nhost: localhost\r\n{kind}\r\n\r\n");
        stream.write_all(head.as_bytes()).await.unwrap();
        let answer = rest(stream).await;
        assert_eq!(status(&answer), 200, "{kind}: {answer}");
    }
    // A body that is sent as fast as it goes.
    let mut huge =
        b"GET /api/v1/alarms HTTP/1.1\r\nhost: localhost\r\ncontent-length: 50000000\r\n\r\n".to_vec();
    huge.resize(50_000_000, b'x');
    let mut stream = connect(&bench).await;
    let _ = timeout(PATIENCE, stream.write_all(&huge)).await.expect("it is not read to its end");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn heads_that_are_too_large_are_refused() {
    let bench = ready().await;
    let field = format!("GET / HTTP/1.1\r\nhost: localhost\r\nx: {}\r\n\r\n", "a".repeat(1_000_000));
    let many: String = (0..150).map(|i| format!("x{i}: 1\r\n")).collect();
    let many = format!("GET / HTTP/1.1\r\nhost: localhost\r\n{many}\r\n");
    is_problem(&answer(&bench, &many).await, 431);
    let large = answer(&bench, &field).await;
    // What is refused while much is on its way may be lost on the way back.
    if !large.is_empty() {
        is_problem(&large, 431);
    }
    is_problem(&answer(&bench, request(&format!("GET /{}", "a".repeat(10_000)))).await, 414);
    let long = answer(&bench, request(&format!("GET /{}", "a".repeat(100_000)))).await;
    assert!(long.is_empty() || [414, 431].contains(&status(&long)), "{long}");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn requests_in_one_go_are_answered_in_order() {
    let bench = ready().await;
    let one = |path: &str| format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    let mut all: String = (0..100).map(|i| one(&format!("/api/v1/devices/no{i}"))).collect();
    all.push_str(&request("GET /healthz"));
    let answers = answer(&bench, &all).await;
    let mut at = 0;
    for i in 0..100 {
        let named = format!("there is no device no{i};");
        at += answers[at..].find(&named).unwrap_or_else(|| panic!("{named} comes after the one before"));
    }
    assert!(answers.ends_with("ok\n"));
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn no_path_leads_anywhere_else() {
    let bench = ready().await;
    for path in [
        "/../../etc/passwd",
        "/api/v1/../../etc/passwd",
        "//api/v1/site",
        "/api//v1/site",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/assets/../index.html",
        "/assets/%2e%2e%2fCargo.toml",
        "/api/v1/devices/..",
        "/api/v1/devices/%2e%2e%2fsite",
        "/api/v1/devices/gen1;x=1",
        "/api/v1/site;",
        "/api/v1/devices/%00",
        "/%00",
        "/index.html%00.js",
        "/api/v1/site/",
        "/api/v1/devices/%F0%9F%92%A9",
        "/\\..\\..\\windows",
        "/api/v1/devices/gen1%2fvalues",
        "/api/v1/wires/%22%3E%3Cscript%3E",
        "*",
        "/API/V1/SITE",
        "/.",
        "/..;/metrics",
        "/api/v1/devices/",
    ] {
        is_problem(&answer(&bench, request(&format!("GET {path}"))).await, 404);
    }
    // Overlong UTF-8, and bytes that are none.
    for path in ["/api/v1/devices/%C0%AE%C0%AE", "/api/v1/wires/%FF%FE", "/api/v1/devices/%ED%A0%80/values"] {
        is_problem(&answer(&bench, request(&format!("GET {path}"))).await, 400);
    }
    let long = format!("GET /api/v1/devices/{}", "%00".repeat(2_000));
    is_problem(&answer(&bench, request(&long)).await, 404);
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_host_must_be_one_and_ours() {
    let bench = ready().await;
    let with = |hosts: &str| format!("GET /api/v1/site HTTP/1.1\r\n{hosts}connection: close\r\n\r\n");
    for hosts in ["", "host: \r\n", "host: a b\r\n", "host: localhost\r\nhost: localhost\r\n", "host: @\r\n"]
    {
        is_problem(&answer(&bench, with(hosts)).await, 400);
    }
    for host in ["evil.example", "localhost.evil.example", "127.0.0.1.nip.io", "0x7f.1"] {
        is_problem(&answer(&bench, with(&format!("host: {host}\r\n"))).await, 421);
    }
    assert_eq!(status(&answer(&bench, request("GET http://localhost:1/api/v1/site")).await), 200);
    is_problem(&answer(&bench, request("GET http://evil.example/api/v1/site")).await, 421);
    is_problem(&answer(&bench, "GET /api/v1/site HTTP/1.0\r\n\r\n").await, 421);
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_http_is_no_request() {
    let bench = ready().await;
    let framed = |fields: &str, body: &str| {
        format!(
            "POST /api/v1/site HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n{fields}\r\n\r\n{body}"
        )
    };
    for (bytes, expected) in [
        ("GET /\r\n\r\n".to_owned(), &[400][..]),
        ("GET / HTTP/9.9\r\n\r\n".to_owned(), &[400]),
        ("\x16\x03\x01\x02\x00\x01\x00\x01\x7c\x03\x03".to_owned(), &[400]),
        ("GET / HTTP/1.1\r\nhost localhost\r\n\r\n".to_owned(), &[400]),
        ("G\0T / HTTP/1.1\r\nhost: localhost\r\n\r\n".to_owned(), &[400]),
        (framed("content-length: 3\r\ncontent-length: 5", "abcde"), &[400]),
        (framed("content-length: -1", ""), &[400]),
        (framed("content-length: 99999999999999999999999", ""), &[400]),
        (framed("transfer-encoding: chunked, identity", "0\r\n\r\n"), &[400]),
        (framed("transfer-encoding: chunked\r\ncontent-length: 3", "0\r\n\r\n"), &[400, 405]),
        (framed("transfer-encoding: chunked", "zz\r\nnonsense"), &[400, 405]),
        (framed("transfer-encoding: chunked", "FFFFFFFFFFFFFFFFFF\r\n"), &[400, 405]),
    ] {
        let answer = answer(&bench, &bytes).await;
        let code = status(&answer);
        assert!(expected.contains(&code), "{bytes:?}: {answer}");
        is_problem(&answer, code);
    }
    // The preface of HTTP/2 without agreement: no answer of ours would be understood.
    let answer = answer(&bench, "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n").await;
    assert!(answer.is_empty() || status(&answer) == 400, "{answer}");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn methods_that_are_not_for_us_are_refused() {
    let bench = ready().await;
    for line in
        ["OPTIONS /api/v1/site", "TRACE /api/v1/site", "FOO /healthz", "DELETE /metrics", "CONNECT /readyz"]
    {
        let answer = answer(&bench, request(line)).await;
        is_problem(&answer, 405);
        assert!(answer.contains("allow: GET,HEAD\r\n"), "{answer}");
    }
    let answer =
        answer(&bench, "CONNECT evil.example:443 HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n")
            .await;
    assert!((400..500).contains(&status(&answer)), "{answer}");
}

#[tokio::test(flavor = "multi_thread")]
async fn who_never_reads_its_answers_is_cut_off() {
    let bench = quick().await;
    let mut stream = connect(&bench).await;
    // Far more than all buffers on the way hold.
    let asked = "GET /api/v1/devices/gen1/points HTTP/1.1\r\nhost: localhost\r\n\r\n";
    let cut = async {
        loop {
            if stream.write_all(asked.as_bytes()).await.is_err() {
                return;
            }
        }
    };
    timeout(PATIENCE, cut).await.expect("it is cut off");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn there_is_room_for_so_many_readers_of_the_stream() {
    let bench = Bench::bound(|_| {}, Some(Limits { streams: 2, ..Limits::default() })).await;
    let first = bench.client.events("").await;
    let second = bench.client.never_reads().await;
    let full =
        until(async || bench.client.ask("GET", "/api/v1/events?device=gen9", &[]).await, |a| a.status == 503)
            .await;
    assert!(full.problem(503).contains("have the event stream open"));
    assert_eq!(full.header("retry-after"), "5");
    assert_eq!(bench.client.get("/api/v1/site").await.status, 200, "everything else has room");
    drop((first, second));
    until(async || bench.client.ask("GET", "/api/v1/events?device=gen9", &[]).await, |a| a.status == 404)
        .await;
}

/// Asks from that address of this machine, and waits for the first line of the answer.
#[cfg(target_os = "linux")]
async fn asked_from(bench: &Bench, address: &str, path: &str) -> (TcpStream, String) {
    let socket = tokio::net::TcpSocket::new_v4().unwrap();
    socket.bind(format!("{address}:0").parse().unwrap()).unwrap();
    let mut stream = socket.connect(bench.gateway.address()).await.unwrap();
    stream.write_all(format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n").as_bytes()).await.unwrap();
    let mut line = vec![0; "HTTP/1.1 200".len()];
    timeout(PATIENCE, stream.read_exact(&mut line)).await.expect("it is answered in time").unwrap();
    (stream, String::from_utf8(line).unwrap())
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn one_client_cannot_have_every_place_of_the_stream() {
    let bench = Bench::bound(|_| {}, Some(Limits { streams: 3, ..Limits::default() })).await;
    let mut held = Vec::new();
    for expected in ["200", "200", "200", "503"] {
        let (stream, line) = asked_from(&bench, "127.0.0.1", "/api/v1/events").await;
        assert_eq!(line, format!("HTTP/1.1 {expected}"));
        held.push(stream);
    }
    let (_operator, line) = asked_from(&bench, "127.0.0.2", "/api/v1/events").await;
    assert_eq!(line, "HTTP/1.1 200", "another one finds a place");
    let oldest = rest(held.remove(0)).await;
    assert!(!oldest.ends_with("0\r\n\r\n"), "broken off, so that its reader knows: {oldest}");
    let (_, line) = asked_from(&bench, "127.0.0.2", "/api/v1/events").await;
    assert_eq!(line, "HTTP/1.1 503", "two and one are fair enough");
    keeps_its_pace(&bench).await;
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn one_client_cannot_have_every_connection() {
    let limits = Limits { connections: 4, streams: 9, ..Limits::default() };
    let bench = Bench::bound(|_| {}, Some(limits)).await;
    let mut held = Vec::new();
    for _ in 0..4 {
        held.push(asked_from(&bench, "127.0.0.1", "/api/v1/events").await);
    }
    let (_operator, line) = asked_from(&bench, "127.0.0.2", "/api/v1/events").await;
    assert_eq!(line, "HTTP/1.1 200");
    keeps_its_pace(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn answers_that_wait_do_not_fill_the_memory() {
    let bench = Bench::bound(|_| {}, Some(Limits { waiting_kib: 8, ..Limits::default() })).await;
    let refused = bench.client.get("/api/v1/devices/gen1/points").await;
    assert!(refused.problem(503).contains("wait for clients"));
    assert_eq!(refused.header("retry-after"), "5");
    assert_eq!(bench.client.get("/api/v1/alarms").await.status, 200);
}

/// Prints what an idle connection costs: `cargo test -p busbar-gateway connections -- --nocapture`.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread")]
async fn ten_thousand_connections_keep_nobody_out() {
    let bench = ready().await;
    let most = rustix::process::getrlimit(rustix::process::Resource::Nofile).current.unwrap_or(u64::MAX);
    // This process holds both ends, and the server's 4,096 are among them.
    let clients = most.saturating_sub(6_000).clamp(100, 10_000) as usize;
    let before = resident();
    let mut held = Vec::with_capacity(clients);
    for _ in 0..clients {
        held.push(connect(&bench).await);
    }
    for path in ["/", "/api/v1/site", "/metrics", "/healthz"] {
        assert_eq!(bench.client.get(path).await.status, 200, "{path}");
    }
    let served = clients.min(Limits::default().connections) as u64;
    let each = resident().saturating_sub(before) / served;
    println!("{clients} connections that say nothing: {each} bytes of memory for each of {served} held");
    let mut stream = bench.client.events("").await;
    stream.until(|event| event.name == "values").await;
    keeps_its_pace(&bench).await;
    drop(held);
}

/// Bytes of memory that this process uses.
#[cfg(target_os = "linux")]
fn resident() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap();
    pages.split(' ').nth(1).unwrap().parse::<u64>().unwrap() * 4_096
}
