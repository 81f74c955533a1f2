//! A command over a real loopback socket, against a device that does with each write what the test decides.
#![cfg(test)]

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use busbar_link::command::{self, Progress};
use busbar_link::{Backoff, Endpoint, Link, Options};
use busbar_profile::command::{Arguments, Report, Run, Verdict};
use busbar_profile::{DateTime, Profile};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

const UNIT: u8 = 7;
/// The register that all writes of function 6 go to.
const KEYS: u16 = 100;

const PROFILE: &str = r#"
format = 1
key = "test"
vendor = "Maker"
models = ["T"]
kind = "genset"
coils = [{ at = 3, id = "load_key", name = "Load key" }]

[manual]
title = "A manual"

[wire]
transports = ["tcp"]
unit = { min = 1, max = 247 }
functions = [3, 5, 6, 16]
max_read = 16
max_write = 16
over_read = "truncate"
spacing_ms = 0
answer_delay_ms = 0
timeout_ms = 1000
word_order = "low-first"
serial = { baud = [9600], parity = ["none"], stop = [1] }
readable = [[0, 40]]

[choices.mode]
values = [{ value = 0, id = "off", label = "OFF" }, { value = 1, id = "on", label = "ON" }]

[[groups]]
id = "all"
title = "All"
rate = "fast"
points = [
  { at = 0, id = "mode", type = "choice", choices = "mode", name = "Mode" },
  { at = 2, id = "load", type = "u16", name = "Load" },
  { at = 30, id = "interlock", type = "u16", name = "Interlock" },
  { at = 100, id = "keys", type = "u16", access = "w", name = "Keys" },
]

[[commands]]
id = "on"
name = "On"
risk = "none"
role = "operator"
write = { function = 6, address = 100, value = 4 }
proof = [{ point = "mode", equals = 1, within_s = 1 }]

[[commands]]
id = "guarded"
name = "On, guarded"
risk = "none"
role = "operator"
require = [{ point = "interlock", equals = 0 }, { point = "load", equals = 0 }]
already = [{ point = "mode", equals = 1 }]
write = { function = 16, address = 100, value = 4 }
proof = [{ point = "mode", equals = 1, within_s = 1 }]

[[commands]]
id = "blind"
name = "Blind"
risk = "none"
role = "operator"
write = { function = 6, address = 100, value = 8 }
no_proof = "nothing shows it"

[[commands]]
id = "on_and_load"
name = "On, then load"
risk = "none"
role = "operator"
proof = [{ point = "load", equals = 1, within_s = 1 }]

[[commands.steps]]
write = { function = 6, address = 100, value = 4 }
proof = [{ point = "mode", equals = 1, within_s = 1 }]

[[commands.steps]]
write = { function = 5, address = 3, value = 0xFF00 }
"#;

/// What the device does with one write.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reaction {
    /// Does it and confirms it.
    Obey,
    /// Confirms it and does nothing.
    Ignore,
    /// Does it, and the answer is lost.
    ObeyInSilence,
    /// Does nothing, and says nothing.
    IgnoreInSilence,
    /// Does it and hangs up in place of an answer.
    ObeyAndHangUp,
    /// Answers with an exception and does nothing.
    Refuse(u8),
    /// Answers with an exception and does it all the same.
    RefuseAndObey(u8),
    /// Confirms it and is never heard again.
    Die,
}
use Reaction::*;

/// The device: its registers, what it is to do with the next writes, and everything that came.
#[derive(Debug, Default)]
struct Device {
    registers: BTreeMap<u16, u16>,
    script: VecDeque<Reaction>,
    /// Function, address and value of every write, as it came.
    writes: Vec<[u16; 3]>,
    /// Address and count of every read.
    reads: Vec<[u16; 2]>,
    dead: bool,
    /// Reads that touch this address get exception 2.
    hole: Option<u16>,
    /// Most registers of an answer.
    limit: Option<u16>,
}

impl Device {
    fn answer(&mut self, request: &[u8; 12]) -> Option<Vec<u8>> {
        let word = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
        let (function, address, value) = (request[7], word(8), word(10));
        if self.dead || request[6] != UNIT {
            return None;
        }
        if function == 3 {
            self.reads.push([address, value]);
            if self.hole.is_some_and(|hole| (address..address + value).contains(&hole)) {
                return Some(vec![0x83, 2]);
            }
            let count = value.min(self.limit.unwrap_or(value));
            let mut pdu = vec![3, 2 * count as u8];
            for address in address..address + count {
                pdu.extend(self.registers.get(&address).copied().unwrap_or_default().to_be_bytes());
            }
            return Some(pdu);
        }
        self.writes.push([function.into(), address, value]);
        let reaction = self.script.pop_front().expect("a write that the test does not expect");
        if matches!(reaction, Obey | ObeyInSilence | ObeyAndHangUp | RefuseAndObey(_)) {
            self.registers.insert(if address == KEYS { 0 } else { 2 }, 1);
        }
        self.dead = reaction == Die;
        match reaction {
            Obey | Ignore | Die => Some(request[7..].to_vec()),
            Refuse(code) | RefuseAndObey(code) => Some(vec![function | 0x80, code]),
            ObeyInSilence | IgnoreInSilence => None,
            ObeyAndHangUp => Some(Vec::new()),
        }
    }
}

#[derive(Clone)]
struct Peer {
    device: Arc<Mutex<Device>>,
    endpoint: Endpoint,
}

impl Peer {
    async fn new(script: impl IntoIterator<Item = Reaction>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let endpoint = Endpoint::from(listener.local_addr().unwrap());
        let device = Device { script: script.into_iter().collect(), ..Device::default() };
        let peer = Self { device: Arc::new(Mutex::new(device)), endpoint };
        let served = peer.clone();
        tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                tokio::spawn(served.clone().serve(stream));
            }
        });
        peer
    }

    fn with(self, change: impl FnOnce(&mut Device)) -> Self {
        change(&mut self.device.lock().unwrap());
        self
    }

    async fn serve(self, mut stream: TcpStream) {
        let mut request = [0; 12];
        while stream.read_exact(&mut request).await.is_ok() {
            if request[7] == 16 {
                // Count, number of bytes and one register follow the first 12 bytes: 3 more.
                let mut rest = [0; 3];
                stream.read_exact(&mut rest).await.unwrap();
            }
            let answer = self.device.lock().unwrap().answer(&request);
            let Some(pdu) = answer else { continue };
            if pdu.is_empty() {
                return;
            }
            let mut frame = vec![request[0], request[1], 0, 0, 0, pdu.len() as u8 + 1, request[6]];
            frame.extend(pdu);
            stream.write_all(&frame).await.unwrap();
        }
    }

    fn writes(&self) -> Vec<[u16; 3]> {
        self.device.lock().unwrap().writes.clone()
    }

    async fn run(&self, id: &str) -> Report {
        let profile = profile();
        let link = Link::open(self.endpoint.clone(), options()).unwrap();
        let (command, arguments) = ready(&profile, id);
        let order = profile.wire.word_order;
        let run = sendable(command::run(&link, UNIT, &profile, command, arguments, order));
        tokio::time::timeout(Duration::from_secs(30), run).await.expect("the command never ends")
    }
}

/// A service runs commands in tasks of their own.
fn sendable<T: Send>(future: T) -> T {
    future
}

fn profile() -> Profile {
    Profile::parse("test.toml", PROFILE).unwrap_or_else(|findings| panic!("{findings}"))
}

fn ready<'p>(profile: &'p Profile, id: &str) -> (&'p busbar_profile::Command, Arguments) {
    let command = profile.command(id).unwrap();
    let local: DateTime = "2026-11-23T05:19:51".parse().unwrap();
    (command, command.arguments([], local).unwrap())
}

/// Short enough to be waited for, long enough for a busy machine.
fn options() -> Options {
    Options {
        timeout: Duration::from_millis(300),
        backoff: Backoff { first: Duration::from_millis(5), max: Duration::from_millis(20) },
        ..Options::default()
    }
}

#[tokio::test]
async fn what_shows_is_done() {
    let peer = Peer::new([Obey]).await;
    let report = peer.run("on").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 1), "{}", report.reason);
    assert_eq!(peer.writes(), [[6, KEYS, 4]]);
    assert_eq!(report.evidence.len(), 1);
}

#[tokio::test]
async fn functions_5_and_16_are_sent_as_they_are() {
    let peer = Peer::new([Obey]).await;
    assert_eq!(peer.run("guarded").await.verdict, Verdict::Done);
    assert_eq!(peer.writes(), [[16, KEYS, 1]], "one register");

    let peer = Peer::new([Obey, Obey]).await;
    let report = peer.run("on_and_load").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 2), "{}", report.reason);
    assert_eq!(peer.writes(), [[6, KEYS, 4], [5, 3, 0xFF00]]);
}

#[tokio::test]
async fn a_procedure_ends_where_its_first_step_does_nothing() {
    let peer = Peer::new([Ignore]).await;
    let report = peer.run("on_and_load").await;
    assert_eq!((report.verdict, report.sent), (Verdict::NoEffect, 1), "{}", report.reason);
    assert_eq!(peer.writes().len(), 1);
}

#[tokio::test]
async fn what_must_hold_is_read_first_and_nothing_is_sent() {
    let peer = Peer::new([]).await.with(|device| _ = device.registers.insert(30, 1));
    let report = peer.run("guarded").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Refused, 0), "{}", report.reason);
    assert!(report.reason.contains("Interlock is 1"), "{}", report.reason);

    let peer = Peer::new([]).await.with(|device| _ = device.registers.insert(0, 1));
    let report = peer.run("guarded").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 0), "{}", report.reason);
}

#[tokio::test]
async fn what_stays_as_it_was_is_no_effect() {
    let peer = Peer::new([Ignore]).await;
    let report = peer.run("on").await;
    assert_eq!((report.verdict, report.sent), (Verdict::NoEffect, 1), "{}", report.reason);
    assert!(report.elapsed >= Duration::from_secs(1));
    assert_eq!(peer.writes().len(), 1);
}

#[tokio::test]
async fn what_nothing_shows_is_unknown() {
    let peer = Peer::new([Obey]).await;
    let report = peer.run("blind").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Unknown, 1), "{}", report.reason);
    let reads = peer.device.lock().unwrap().reads.clone();
    assert_eq!(reads, [[0, 1]], "whether it is there at all, and nothing after the write");
}

#[tokio::test]
async fn a_lost_answer_is_resolved_by_reading_and_never_by_sending() {
    for (reaction, verdict) in
        [(ObeyInSilence, Verdict::Done), (ObeyAndHangUp, Verdict::Done), (IgnoreInSilence, Verdict::NoEffect)]
    {
        let peer = Peer::new([reaction]).await;
        let report = peer.run("on").await;
        assert_eq!((report.verdict, report.sent), (verdict, 1), "{reaction:?}: {}", report.reason);
        assert!(report.reason.contains("The answer to the write was lost"), "{}", report.reason);
        assert_eq!(peer.writes().len(), 1, "{reaction:?}");
    }
}

#[tokio::test]
async fn an_exception_that_did_nothing_is_refused() {
    for code in [1, 2, 3, 6, 10] {
        let peer = Peer::new([Refuse(code)]).await;
        let report = peer.run("on").await;
        assert_eq!((report.verdict, report.sent), (Verdict::Refused, 1), "{}", report.reason);
        assert!(report.reason.contains(&format!("exception {code}")), "{}", report.reason);
        assert_eq!(peer.writes().len(), 1);
    }
}

#[tokio::test]
async fn an_exception_that_may_have_done_it_is_resolved_by_reading() {
    for (reaction, verdict) in [
        (RefuseAndObey(4), Verdict::Done),
        (Refuse(4), Verdict::NoEffect),
        (RefuseAndObey(11), Verdict::Done),
        (RefuseAndObey(0x77), Verdict::Done),
    ] {
        let peer = Peer::new([reaction]).await;
        let report = peer.run("on").await;
        assert_eq!((report.verdict, report.sent), (verdict, 1), "{reaction:?}: {}", report.reason);
        assert!(report.reason.contains("answered the write with exception"), "{}", report.reason);
    }
    // 5 says that it was accepted, and is no doubt.
    let report = Peer::new([RefuseAndObey(5)]).await.run("on").await;
    assert_eq!(report.verdict, Verdict::Done);
    assert!(!report.reason.contains("exception"), "{}", report.reason);
}

#[tokio::test]
async fn who_is_gone_after_the_write_is_unknown() {
    let peer = Peer::new([Die]).await;
    let report = peer.run("on").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Unknown, 1), "{}", report.reason);
    assert_eq!(peer.writes().len(), 1);
}

#[tokio::test]
async fn who_was_never_there_gets_nothing() {
    let peer = Peer::new([]).await.with(|device| device.dead = true);
    let report = peer.run("on").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Refused, 0), "{}", report.reason);
}

#[tokio::test]
async fn one_missing_address_costs_its_own_point_only() {
    let peer = Peer::new([Obey]).await.with(|device| device.hole = Some(1));
    let report = peer.run("guarded").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 1), "{}", report.reason);
    let reads = peer.device.lock().unwrap().reads.clone();
    assert_eq!(reads[..4], [[0, 3], [0, 1], [2, 1], [30, 1]]);

    let peer = Peer::new([]).await.with(|device| device.hole = Some(2));
    let report = peer.run("guarded").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Refused, 0), "{}", report.reason);
    assert!(report.reason.contains("Load could not be read"), "{}", report.reason);
}

#[tokio::test]
async fn a_cut_answer_is_followed_up() {
    let peer = Peer::new([Obey]).await.with(|device| device.limit = Some(1));
    let report = peer.run("guarded").await;
    assert_eq!((report.verdict, report.sent), (Verdict::Done, 1), "{}", report.reason);
    let reads = peer.device.lock().unwrap().reads.clone();
    assert_eq!(reads[..3], [[0, 3], [2, 1], [30, 1]]);
}

#[tokio::test]
async fn whoever_waits_is_told() {
    let peer = Peer::new([Obey]).await;
    let profile = profile();
    let link = Link::open(peer.endpoint.clone(), options()).unwrap();
    let (command, arguments) = ready(&profile, "on");
    let run = Run::new(&profile, command, arguments, profile.wire.word_order);
    let mut told = Vec::new();
    command::run_with(&link, UNIT, &profile, run, |progress| {
        told.push(match progress {
            Progress::Reading { points, sent } => format!("reading {points:?} after {sent}"),
            Progress::Writing { step, frame } => format!("writing {} in step {step}", frame.value),
            Progress::Confirmed => "confirmed".to_owned(),
            other => format!("{other:?}"),
        });
    })
    .await;
    assert_eq!(told, ["reading [0] after 0", "writing 4 in step 1", "confirmed", "reading [0] after 1"]);
}

#[tokio::test]
async fn dropped_before_the_write_it_sends_nothing() {
    let peer = Peer::new([]).await;
    let profile = profile();
    let link = Link::open(peer.endpoint.clone(), options()).unwrap();
    // A person who reads waits before the command, which is dropped as soon as it wants to write.
    let (command, arguments) = ready(&profile, "on");
    let run = Run::new(&profile, command, arguments, profile.wire.word_order);
    let (tell, told) = tokio::sync::oneshot::channel();
    let mut tell = Some(tell);
    {
        let mut running = std::pin::pin!(command::run_with(&link, UNIT, &profile, run, |progress| {
            if let (Progress::Reading { .. }, Some(tell)) = (progress, tell.take()) {
                tell.send(()).unwrap();
            }
        }));
        tokio::select! {
            biased;
            _ = told => {}
            _ = &mut running => panic!("it is over before it was dropped"),
        }
    }
    // The wire is free again, and nothing but reads came.
    link.read_registers(UNIT, 3, 0, 1).await.unwrap();
    assert!(peer.writes().is_empty());
}
