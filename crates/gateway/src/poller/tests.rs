//! A poller on a real wire with an imitated D-500 at its end.

use std::sync::Mutex;

use busbar_link::{Link, Options};
use busbar_profile::builtin;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

use super::*;
use crate::device::Device;
use crate::looks::Look;
use crate::site::Poll;
use crate::stop::{self, Announcer};
use crate::testing::{site_device, table};

const PATIENCE: Duration = Duration::from_secs(20);

/// The registers of the picture.
const LCD: std::ops::Range<u16> = 10_648..11_160;

/// Every read so far, and what each register holds from now on.
#[derive(Default)]
struct Line {
    reads: Vec<(u16, u16)>,
    holds: u16,
    /// A read at this address gets no answer.
    mute: Option<u16>,
    /// A read of any of these is refused.
    lacks: std::ops::Range<u16>,
}

struct Bench {
    line: Arc<Mutex<Line>>,
    slot: Arc<Slot>,
    _stop: Announcer,
    tasks: [JoinHandle<()>; 2],
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

impl Bench {
    /// A D-500 that takes so long for each answer.
    async fn new(fast: Duration, delay: Duration) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let endpoint = format!("tcp://{}", listener.local_addr().unwrap()).parse().unwrap();
        let line = Arc::new(Mutex::new(Line::default()));
        let served = tokio::spawn(serve(listener, Arc::clone(&line), delay));

        let profile = builtin("datakom-d").unwrap();
        let poll = Poll { fast, slow: Duration::from_secs(3600) };
        let site = SiteDevice { profile, poll, ..site_device("gen1") };
        let slot = Arc::new(Slot::new(Device::new(site, "w1".to_owned())));
        let (announcer, stopped) = stop::channel();
        let mut table = table(&[]);
        table.devices.push(Arc::clone(&slot));
        let hub = Arc::new(Hub::new(table, stopped.clone()));
        let options = Options { timeout: Duration::from_millis(200), retries: 0, ..Options::default() };
        let cost = wires::cost(&endpoint, profile);
        let link = wires::for_polling(&Link::open(endpoint, options).unwrap());
        let wire = PolledWire { link, cost, place: 0 };
        let polled = tokio::spawn(Poller::new(hub, Arc::clone(&slot), wire).run(stopped));
        Self { line, slot, _stop: announcer, tasks: [served, polled] }
    }

    fn look(&self, group: &str) -> Look {
        let groups = &builtin("datakom-d").unwrap().groups;
        self.slot.looks.look(&[groups.iter().position(|known| known.id == group).unwrap()])
    }

    fn reads(&self) -> Vec<(u16, u16)> {
        self.line.lock().unwrap().reads.clone()
    }

    /// Waits until the picture is as wanted: its registers, and whether it is good.
    async fn picture(&self, wanted: impl Fn(Option<&[u16]>, bool) -> bool) {
        let lcd = builtin("datakom-d").unwrap().point_index("lcd").unwrap();
        self.until(|| {
            let live = self.slot.lock();
            let value = live.device.value(lcd);
            let is_good = value.quality == crate::api::types::Quality::Good;
            wanted(value.raw.as_deref(), is_good)
        })
        .await;
    }

    async fn until(&self, wanted: impl Fn() -> bool) {
        let met = async {
            while !wanted() {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(PATIENCE, met).await.expect("in time");
    }
}

async fn serve(listener: TcpListener, line: Arc<Mutex<Line>>, delay: Duration) {
    let (mut stream, _) = listener.accept().await.unwrap();
    let mut request = [0; 12];
    while stream.read_exact(&mut request).await.is_ok() {
        let address = u16::from_be_bytes([request[8], request[9]]);
        let count = u16::from_be_bytes([request[10], request[11]]);
        let (holds, mute, lacks) = {
            let mut line = line.lock().unwrap();
            line.reads.push((address, count));
            (line.holds, line.mute, line.lacks.clone())
        };
        if mute == Some(address) {
            continue;
        }
        tokio::time::sleep(delay).await;
        let mut answer = request[..4].to_vec();
        if address < lacks.end && lacks.start < address + count {
            answer.extend([0, 3, request[6], 0x83, 2]);
        } else {
            answer.extend((3 + 2 * count).to_be_bytes());
            answer.extend([request[6], 3, (2 * count) as u8]);
            for register in address..address + count {
                let value = if register == 10_609 { 0xD500 } else { holds };
                answer.extend(value.to_be_bytes());
            }
        }
        if stream.write_all(&answer).await.is_err() {
            return;
        }
    }
}

fn is_demand(read: &(u16, u16)) -> bool {
    LCD.contains(&read.0) || (10_404..10_504).contains(&read.0)
}

#[tokio::test]
async fn on_a_slow_wire_one_read_goes_between_two_fast_rounds() {
    // The next fast round is due before one read is over.
    let bench = Bench::new(Duration::from_millis(1), Duration::from_millis(3)).await;
    let look = bench.look("display");
    bench.picture(|_, is_good| is_good).await;
    drop(look);
    let reads = bench.reads();
    let (_, fast) = reads.split_at(reads.iter().position(is_demand).unwrap());
    let rounds: Vec<&[(u16, u16)]> = fast.split(is_demand).skip(1).collect();
    let whole = rounds[0];
    assert!(whole.len() > 10, "{whole:?}");
    // Thirty-two reads, and one whole fast round between each two of them: late by that one read and no more.
    for round in &rounds[..31] {
        assert_eq!(*round, whole);
    }
}

#[tokio::test]
async fn a_picture_is_read_while_somebody_looks_and_no_longer() {
    let bench = Bench::new(Duration::from_secs(3600), Duration::ZERO).await;
    bench.until(|| bench.slot.lock().device.is_online()).await;
    assert!(!bench.reads().iter().any(is_demand), "nobody looks");
    let lcd = builtin("datakom-d").unwrap().point_index("lcd").unwrap();
    assert!(!bench.slot.lock().device.shows(lcd));

    // Though the next fast round is an hour away.
    let look = bench.look("display");
    bench.picture(|raw, is_good| raw == Some(&[0; 512]) && is_good).await;
    let pictures = |reads: &[(u16, u16)]| reads.iter().filter(|read| read.0 == LCD.start).count();
    assert_eq!(
        (pictures(&bench.reads()), bench.reads().iter().filter(|read| is_demand(read)).count()),
        (1, 32)
    );
    drop(look);
    let _control = bench.look("control");
    let is_scope = |read: &(u16, u16)| (10_404..10_504).contains(&read.0);
    let scope = bench.look("harmonics");
    bench.until(|| bench.reads().iter().filter(|read| is_scope(read)).count() == 7).await;

    drop(scope);

    // Who goes in the middle of a picture ends it there.
    let reads = bench.reads().len();
    let look = bench.look("display");
    bench.until(|| bench.reads().len() > reads + 3).await;
    drop(look);
    let ended = bench.reads().len();
    let _scope = bench.look("harmonics");
    bench.until(|| bench.reads().iter().filter(|read| is_scope(read)).count() == 14).await;
    let last = bench.reads()[reads..].iter().filter(|read| LCD.contains(&read.0)).count();
    assert!(last >= 3 && last <= ended - reads + 1, "{last} reads of a picture that nobody wanted any more");
}

#[tokio::test]
async fn half_of_a_picture_never_goes_with_half_of_another() {
    let bench = Bench::new(Duration::from_millis(20), Duration::ZERO).await;
    let _look = bench.look("display");
    bench.picture(|raw, is_good| raw == Some(&[0; 512]) && is_good).await;
    // Of the next one the second half never comes.
    {
        let mut line = bench.line.lock().unwrap();
        (line.holds, line.mute) = (7, Some(LCD.start + 256));
    }
    bench
        .picture(|raw, is_good| {
            let raw = raw.unwrap();
            assert!(raw.iter().all(|register| *register == raw[0]), "{raw:?}");
            !is_good && raw[0] == 0
        })
        .await;
    assert!(bench.slot.lock().device.is_online());
    bench.line.lock().unwrap().mute = None;
    bench.picture(|raw, is_good| raw == Some(&[7; 512]) && is_good).await;
}

#[tokio::test]
async fn a_picture_that_the_device_does_not_have_is_no_doubt_about_the_device() {
    let bench = Bench::new(Duration::from_millis(20), Duration::ZERO).await;
    bench.line.lock().unwrap().lacks = LCD;
    bench.until(|| bench.slot.lock().device.is_online()).await;
    let _look = bench.look("display");
    let lcd = builtin("datakom-d").unwrap().point_index("lcd").unwrap();
    bench
        .until(|| {
            let live = bench.slot.lock();
            assert_eq!(live.device.fault(), None, "all the rest is there");
            live.device.value(lcd).error.is_some_and(|error| error.contains("exception 2"))
        })
        .await;
    // Asked at the start, and once because of the refusal.
    let asked = bench.reads().iter().filter(|read| **read == (10_609, 1)).count();
    assert!((1..=2).contains(&asked), "{asked}");
}
