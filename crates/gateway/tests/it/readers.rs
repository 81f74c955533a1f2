//! A thousand readers, and readers that mean harm: each that reads hears of every round, and polling does not notice.

use std::time::Duration;

use serde_json::json;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};
use tokio::task::JoinSet;
use tokio::time::timeout;

use crate::support::{Bench, Client, Event, Imitation, PATIENCE, Stream, site, start, until};

/// A thousand readers in one process with their other ends take their time on a busy machine.
const LONG: Duration = Duration::from_secs(120);

/// How many values are told, one a round.
const STEPS: u16 = 20;

/// MiB that this process holds: for people, not judged.
fn resident_mib() -> usize {
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    pages.split(' ').nth(1).and_then(|pages| pages.parse::<usize>().ok()).unwrap_or(0) * 4 / 1024
}

/// The voltages that a stream tells, one after the other, up to the last.
async fn voltages(mut stream: Stream, all: bool) -> Vec<u64> {
    let mut told = Vec::new();
    let (mut last, mut is_state): (Option<u64>, bool) = (None, false);
    loop {
        let event = timeout(LONG, stream.next()).await.expect("an event in time").expect("it goes on");
        assert!(event.name != "snapshot" || last.is_none(), "it fell behind: {told:?}");
        if let Some(number) = number(&event) {
            // Every event has the next number: nothing is left out, nothing comes twice. What happened while the state
            // was told is in it.
            let is_next = |last: u64| number == last + 1 || (is_state && number > last);
            assert!(!all || last.is_none_or(is_next), "{last:?}, then {number}");
            (last, is_state) = (Some(number), event.name == "state");
        }
        let changed = event.data["changed"].as_array().into_iter().flatten();
        told.extend(
            changed
                .filter(|view| view["id"] == "genset_l1_voltage")
                .filter_map(|view| view["value"].as_u64()),
        );
        if told.last() == Some(&u64::from(230 + STEPS)) {
            return told;
        }
    }
}

/// Ids are opaque, but these are ours.
fn number(event: &Event) -> Option<u64> {
    event.id.as_ref()?.rsplit_once('-')?.1.parse().ok()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_thousand_readers_of_which_a_hundred_never_read() {
    let device = Imitation::start().await;
    let slowly = site(&format!("tcp://{}", device.address()))
        .replace("fast = \"50ms\", slow = \"200ms\"", "fast = \"250ms\", slow = \"2s\"");
    let (_gateway, client) = start(&slowly).await;
    let value = async || client.get("/api/v1/devices/gen1/values?point=genset_l1_voltage").await.json();
    until(value, |value| value[0]["quality"] == "good").await;
    let alone = resident_mib();

    let mut idle = Vec::new();
    for _ in 0..100 {
        idle.push(client.never_reads().await);
    }
    let mut readers = JoinSet::new();
    for reader in 0..900 {
        let query = ["", "?signal=genset.l1.voltage", "?device=gen1&group=genset"][reader % 3];
        let headers: &[_] = if reader % 2 == 0 { &[("accept-encoding", "gzip")] } else { &[] };
        let stream = connected(&client, query, headers).await;
        readers.spawn(voltages(stream, query.is_empty()));
    }
    let all = resident_mib();

    let mut control = client.events("?signal=genset.l1.voltage").await;
    let told: Vec<u64> = (1..=STEPS).map(|step| u64::from(230 + step)).collect();
    let reads = device.change(|device| device.reads.len());
    for (step, value) in (1..=STEPS).zip(&told) {
        device.change(|device| device.registers.insert(10_246, 2_300 + step * 10));
        let holds = |event: &Event| event.data["changed"][0]["value"] == json!(value);
        while !holds(&timeout(LONG, control.next()).await.unwrap().unwrap()) {}
    }
    let rounds = device.change(|device| device.reads.len()) - reads;
    let mut heard = 0;
    while let Some(reader) = timeout(LONG, readers.join_next()).await.expect("all of them hear it") {
        assert_eq!(reader.unwrap(), told);
        heard += 1;
    }
    assert_eq!(heard, 900);
    assert!(rounds >= usize::from(STEPS), "{rounds} reads in {STEPS} rounds");
    let times = device.change(|device| device.times.clone());
    let longest = times.windows(2).map(|pair| pair[1].0 - pair[0].0).max().unwrap();
    println!(
        "longest between two reads: {longest:?}; MiB resident, both ends of every connection: {alone} alone, {all} with 1,000 readers, {} after {STEPS} rounds",
        resident_mib()
    );
    drop(idle);
}

/// A stream whose first bytes may take their time.
async fn connected(client: &Client, query: &str, headers: &[(&str, &str)]) -> Stream {
    timeout(LONG, client.events_with(query, headers)).await.expect("an answer in time")
}

/// Asks for the stream; the other end can send little that is not read.
async fn raw(bench: &Bench, head: &str) -> TcpStream {
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(4_096).unwrap();
    let mut stream = socket.connect(bench.gateway.address()).await.unwrap();
    stream.write_all(head.as_bytes()).await.unwrap();
    stream
}

const REQUEST: &str = "GET /api/v1/events HTTP/1.1\r\nhost: localhost\r\n\r\n";

async fn is_well(bench: &Bench) {
    let mut stream = bench.client.events("?signal=genset.l1.voltage").await;
    let fast = |event: &Event| event.name == "values" && event.data["rate"] == "fast";
    for _ in 0..5 {
        stream.until(fast).await;
    }
    let value = bench.value("genset_l1_voltage").await;
    assert_eq!((&value["quality"], &value["value"]), (&json!("good"), &json!(230.2)));
}

async fn ready() -> Bench {
    let bench = Bench::new().await;
    bench.until_value("genset_l1_voltage", |value| value["quality"] == "good").await;
    bench
}

#[tokio::test(flavor = "multi_thread")]
async fn readers_that_come_and_go_cost_nothing() {
    let bench = ready().await;
    for turn in 0..2_000_usize {
        let query = ["", "?signal=mode", "?last_event_id=1-1", "?device=gen1&group=display"][turn % 4];
        let head = format!("GET /api/v1/events{query} HTTP/1.1\r\nhost: localhost\r\n\r\n");
        let mut stream = raw(&bench, &head).await;
        // Some go at once, some in the middle of the state.
        if turn % 3 > 0 {
            let mut some = vec![0; turn % 700 + 1];
            timeout(PATIENCE, stream.read_exact(&mut some)).await.unwrap().unwrap();
        }
        drop(stream);
    }
    is_well(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reader_of_one_byte_at_a_time_holds_nobody_up() {
    let bench = ready().await;
    let mut slow = Vec::new();
    for _ in 0..20 {
        slow.push(raw(&bench, REQUEST).await);
    }
    for _ in 0..10 {
        for stream in &mut slow {
            timeout(PATIENCE, stream.read_u8()).await.unwrap().unwrap();
        }
        is_well(&bench).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_id_that_is_none_of_ours_begins_anew() {
    let bench = ready().await;
    let other = ready().await;
    let mut stream = other.client.events("").await;
    let theirs = stream.until(|event| event.id.is_some()).await.id.unwrap();
    for id in ["", "0", "-1", "0-0", "ff-18446744073709551615", "\u{e4}", &"7".repeat(8_000), &theirs] {
        let mut stream = bench.client.events_with("", &[("last-event-id", id)]).await;
        assert_eq!(stream.next().await.unwrap().name, "snapshot", "{id:.40}");
    }
    let mut stream = bench.client.events(&format!("?last_event_id={}", "7".repeat(8_000))).await;
    assert_eq!(stream.next().await.unwrap().name, "snapshot");

    // One of ours goes on, and the header counts before the query.
    let ours = stream.until(|event| event.id.is_some()).await.id.unwrap();
    for (query, headers) in [
        (format!("?last_event_id={ours}"), vec![]),
        (format!("?last_event_id={theirs}"), vec![("last-event-id", ours.as_str())]),
    ] {
        let mut stream = bench.client.events_with(&query, &headers).await;
        let first = stream.next().await.unwrap();
        assert_eq!((first.name.as_str(), first.id.as_ref()), ("resumed", Some(&ours)));
        let next = stream.until(|event| event.id.is_some()).await;
        assert!(number(&next) > number(&first));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_filter_may_be_long_but_not_wrong() {
    let bench = ready().await;
    let many = vec!["gen1"; 1_000].join(",");
    let mut stream = bench.client.events(&format!("?device={many}")).await;
    assert_eq!(stream.next().await.unwrap().name, "snapshot");
    let signals = format!("?signal=genset.l1.voltage,{}", vec!["x"; 2_000].join(","));
    let mut stream = bench.client.events(&signals).await;
    stream.next().await.unwrap();
    assert_eq!(stream.next().await.unwrap().data["values"].as_array().unwrap().len(), 1);

    let unknown = bench.client.get("/api/v1/events?device=gen1,gen9").await.problem(404);
    assert_eq!(unknown, "there is no device gen9; this site has gen1");
    let unknown = bench.client.get("/api/v1/events?group=genset,nonsense").await.problem(400);
    assert!(unknown.starts_with("no device that is asked for has a group nonsense; they have "), "{unknown}");
    for query in ["device=gen1&device=gen1", "devices=gen1"] {
        bench.client.get(&format!("/api/v1/events?{query}")).await.problem(400);
    }
    // Longer than a request may be: that much is not even looked at.
    let mut stream = TcpStream::connect(bench.gateway.address()).await.unwrap();
    let head =
        format!("GET /api/v1/events?signal={} HTTP/1.1\r\nhost: localhost\r\n\r\n", "a,".repeat(50_000));
    // It may be answered and closed before everything was sent.
    let _ = stream.write_all(head.as_bytes()).await;
    let mut answer = [0; 12];
    timeout(PATIENCE, stream.read_exact(&mut answer)).await.unwrap().unwrap();
    assert!(
        answer == *b"HTTP/1.1 414" || answer == *b"HTTP/1.1 431",
        "{:?}",
        String::from_utf8_lossy(&answer)
    );
    is_well(&bench).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_compressed_stream_can_be_read_as_it_comes_and_to_its_end() {
    let bench = ready().await;
    for query in ["", "?signal=genset.l1.voltage"] {
        let mut packed = bench.client.events_with(query, &[("accept-encoding", "br, gzip")]).await;
        let mut plain = bench.client.events_with(query, &[("accept-encoding", "br")]).await;
        for stream in [&mut packed, &mut plain] {
            assert_eq!(stream.next().await.unwrap().name, "snapshot");
            let fast = |event: &Event| event.name == "values" && event.data["rate"] == "fast";
            for _ in 0..5 {
                stream.until(fast).await;
            }
        }
    }
    let mut packed = bench.client.events_with("", &[("accept-encoding", "gzip")]).await;
    packed.next().await.unwrap();
    bench.gateway.shutdown().await;
    assert!(packed.ends_well().await);
}
