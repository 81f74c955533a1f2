//! The soak: imitated D-500 polled each second by the real gateway, judged by what readers of its event stream are told.
//!
//! The controllers are those of `busbar emulate`, plant and all, in this process; the gateway is `busbar run`, a process
//! of its own. Then come many readers of the event stream, of which one in ten never reads.

mod crowd;
mod gateway;
mod rounds;
mod site;
mod stream;

use std::error::Error;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use jiff::Timestamp;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use tokio::signal::ctrl_c;
use tokio::signal::unix::{SignalKind, signal};
use tokio::task::{JoinHandle, yield_now};
use tokio::time::{sleep, timeout};

use self::crowd::Crowd;
use self::gateway::Gateway;
use self::rounds::Rounds;
use self::site::{Fleet, Person};
use self::stream::Events;

/// An error that may go from task to task.
type Failure = Box<dyn Error + Send + Sync>;

/// Most of a processor that the gateway may take.
const MOST_PROCESSOR: f64 = 0.5;
/// Most memory that the gateway may take, in MiB.
const MOST_MEMORY: f64 = 100.0;
/// Most memory that it may take for each reader in addition, in KiB, whether that one reads or not.
const MOST_EACH: f64 = 64.0;

/// How often what counts only is tried before it is given up.
const TRIES: usize = 3;
/// Every device answers in this time after the start, on a slow machine too.
const START: Duration = Duration::from_secs(120);
/// Between the first answers and the judgement.
const SETTLE: Duration = Duration::from_secs(5);
/// A change that was not told after this is not told any more.
const TELL: Duration = Duration::from_secs(10);
/// How long the crowd of readers stays, at most.
const CROWDED: Duration = Duration::from_secs(30);
/// Controllers with a person in front of them.
const PEOPLE: usize = 97;
/// Between two presses of a button.
const PRESS: Duration = Duration::from_millis(70);

pub(crate) fn run(options: &[&str]) -> Result<(), Box<dyn Error>> {
    let options = Options::parse(options)?;
    raise_handles();
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let done = runtime.block_on(async {
        let mut stopped = signal(SignalKind::terminate())?;
        tokio::select! {
            done = tries(&options) => done,
            // The gateway must not outlive this.
            _ = stopped.recv() => Err("stopped by a signal".into()),
            _ = ctrl_c() => Err("stopped by a signal".into()),
        }
    });
    runtime.shutdown_background();
    done.map_err(|error| -> Box<dyn Error> { error })
}

struct Options {
    devices: usize,
    lasts: Duration,
    readers: usize,
    /// Counts are judged, speed is not: what is right on any machine.
    count: bool,
}

impl Options {
    fn parse(options: &[&str]) -> Result<Self, Box<dyn Error>> {
        let mut parsed =
            Self { devices: 1_000, lasts: Duration::from_secs(600), readers: 1_000, count: false };
        let mut options = options.iter();
        while let Some(option) = options.next() {
            let mut number = || options.next().ok_or(crate::USAGE);
            match *option {
                "--devices" => parsed.devices = number()?.parse()?,
                "--seconds" => parsed.lasts = Duration::from_secs(number()?.parse()?),
                "--readers" => parsed.readers = number()?.parse()?,
                "--count" => parsed.count = true,
                _ => return Err(crate::USAGE.into()),
            }
        }
        Ok(parsed)
    }
}

/// Every device takes a socket here, and so does every reader.
fn raise_handles() {
    let Rlimit { maximum, .. } = getrlimit(Resource::Nofile);
    // Where it is not allowed, the first socket too many says so.
    let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
}

/// A machine that is busy with something else for a second misses a poll; a program that is wrong misses it each time.
async fn tries(options: &Options) -> Result<(), Failure> {
    let tries = if options.count { TRIES } else { 1 };
    for _ in 1..tries {
        match soak(options).await {
            Ok(()) => return Ok(()),
            Err(error) => {
                println!("{error}\nonce more, should the machine have been busy with something else")
            }
        }
    }
    soak(options).await
}

async fn soak(options: &Options) -> Result<(), Failure> {
    let fleet = Fleet::start(options.devices).await?;
    let folder = tempfile::tempdir()?;
    let gateway = Gateway::start(&fleet.write_site(folder.path())?)?;
    let reader = Reader::start(&gateway).await?;
    println!(
        "{} imitated D-500, plant and all, each on a wire of its own, polled each second",
        options.devices
    );

    reader.wait_for_all(options.devices).await?;
    sleep(SETTLE).await;
    gateway.memory()?;
    let polled = polled(options, &fleet, &gateway, &reader).await?;
    let crowded = crowded(options, &gateway, &reader).await?;
    let statistics = gateway.statistics().await?;
    println!(
        "wires             {} time-outs, {} retries, {} reconnections",
        statistics.timeouts, statistics.retries, statistics.reconnects
    );

    let mut verdict = Verdict::default();
    verdict.none("missed polls", polled.missed);
    verdict.none("missed polls with readers", crowded.missed);
    verdict.none("time-outs", statistics.timeouts);
    verdict.none("reconnections", statistics.reconnects);
    verdict.none("changes that were never told", polled.untold as u64);
    verdict.none("times that the reader fell behind", reader.rounds().snapshots - 1);
    verdict.none("readers that were cut off", crowded.lost as u64);
    verdict.at_least("rounds that the reader told least was told of", crowded.fewest, 1);
    if !options.count {
        verdict.at_most("of a processor", polled.processor, MOST_PROCESSOR);
        verdict.at_most("MiB", polled.memory, MOST_MEMORY);
    }
    let most = MOST_MEMORY + MOST_EACH * options.readers as f64 / 1_024.0;
    verdict.at_most("MiB with readers", crowded.memory, most);
    verdict.given()
}

/// What was found while the devices were polled.
struct Polled {
    missed: u64,
    untold: usize,
    /// Share of one processor.
    processor: f64,
    memory: f64,
}

async fn polled(
    options: &Options,
    fleet: &Fleet,
    gateway: &Gateway,
    reader: &Reader,
) -> Result<Polled, Failure> {
    let devices = options.devices;
    let people: Result<Vec<_>, _> =
        (0..devices.min(PEOPLE)).map(|device| Person::new(fleet.endpoint(device)?)).collect();
    let mut people = people?;
    reader.rounds().begin();
    let (began, before, start) = (Timestamp::now(), gateway.processor_time()?, Instant::now());
    while start.elapsed() < options.lasts {
        for (device, person) in people.iter_mut().enumerate() {
            let made = Instant::now();
            reader.rounds().await_mode(format!("d{device}"), person.next_mode(), made);
            person.press().await?;
            sleep(PRESS.saturating_sub(made.elapsed())).await;
            if start.elapsed() >= options.lasts {
                break;
            }
        }
    }
    let (spent, lasted) = (gateway.processor_time()? - before, start.elapsed());
    let (missed, finished) = {
        let rounds = reader.rounds();
        (rounds.missed(devices, began, Timestamp::now()), rounds.finished())
    };
    let told = async {
        while reader.rounds().untold() > 0 {
            sleep(Duration::from_millis(50)).await;
        }
    };
    // Who is late is counted below.
    let _ = timeout(TELL, told).await;
    reader.check()?;

    let untold = reader.rounds().untold();
    let delays = reader.rounds().delays();
    let (processor, memory) = (spent.as_secs_f64() / lasted.as_secs_f64(), gateway.memory()?);
    println!("rounds            {finished} in {:.0} s, {missed} missed", lasted.as_secs_f64());
    println!("gateway           {processor:.2} of a processor, {memory:.0} MiB at most");
    let share = |share: f64| {
        let at = share * delays.len().saturating_sub(1) as f64;
        delays.get(at.round() as usize).copied().unwrap_or_default().as_secs_f64()
    };
    println!(
        "register to event {:.2} s in the middle, {:.2} s at the 99th percentile, {:.2} s at most, of {} changes;\n\
         {:18}up to 1 s of it is the wait for the next poll",
        share(0.5),
        share(0.99),
        share(1.0),
        delays.len(),
        ""
    );
    Ok(Polled { missed, untold, processor, memory })
}

/// What was found while many read along.
struct Crowded {
    missed: u64,
    memory: f64,
    lost: usize,
    fewest: u64,
}

async fn crowded(options: &Options, gateway: &Gateway, reader: &Reader) -> Result<Crowded, Failure> {
    reader.rounds().begin();
    gateway.memory()?;
    let (began, before, start) = (Timestamp::now(), gateway.processor_time()?, Instant::now());
    let mut crowd = Crowd::gather(gateway.address, options.readers, options.devices).await?;
    sleep(CROWDED.min(options.lasts / 3)).await;
    let spent = gateway.processor_time()? - before;
    let missed = reader.rounds().missed(options.devices, began, Timestamp::now());
    let memory = gateway.memory()?;
    reader.check()?;
    println!(
        "with readers      {} of the event stream, {} of them never read: {:.2} of a processor, {memory:.0} MiB at \
         most, {missed} polls missed",
        options.readers,
        crowd.mute(),
        spent.as_secs_f64() / start.elapsed().as_secs_f64()
    );
    // Nobody who reads is left out; where all of them are mute there is nobody.
    let fewest = if crowd.mute() == options.readers { 1 } else { crowd.fewest() };
    Ok(Crowded { missed, memory, lost: crowd.lost(), fewest })
}

/// The reader of the whole site by whose eyes the gateway is judged.
struct Reader {
    rounds: Arc<Mutex<Rounds>>,
    task: JoinHandle<String>,
}

impl Reader {
    async fn start(gateway: &Gateway) -> Result<Self, Failure> {
        let rounds = Arc::<Mutex<Rounds>>::default();
        let events = Events::open(gateway.address, "").await?;
        let task = tokio::spawn(follow(events, Arc::clone(&rounds)));
        Ok(Self { rounds, task })
    }

    fn rounds(&self) -> MutexGuard<'_, Rounds> {
        self.rounds.lock().unwrap_or_else(PoisonError::into_inner)
    }

    async fn wait_for_all(&self, devices: usize) -> Result<(), Failure> {
        let all = async {
            while self.rounds().devices() < devices && !self.task.is_finished() {
                sleep(Duration::from_millis(50)).await;
            }
        };
        if timeout(START, all).await.is_err() {
            let seen = self.rounds().devices();
            return Err(format!("only {seen} of {devices} devices were polled in {START:?}").into());
        }
        self.check()
    }

    /// Whether it still reads.
    fn check(&self) -> Result<(), Failure> {
        match self.task.is_finished() {
            true => Err("the reader of the whole site was cut off".into()),
            false => Ok(()),
        }
    }
}

/// Reads until the stream ends, and says why it did.
async fn follow(mut events: Events, rounds: Arc<Mutex<Rounds>>) -> String {
    loop {
        let event = match events.next().await {
            Ok(event) => event,
            Err(error) => return error.to_string(),
        };
        let came = Instant::now();
        let taken = rounds.lock().unwrap_or_else(PoisonError::into_inner).event(event.name, event.data, came);
        if let Err(error) = taken {
            return error.to_string();
        }
        yield_now().await;
    }
}

/// What is not as it should be.
#[derive(Default)]
struct Verdict(Vec<String>);

impl Verdict {
    fn none(&mut self, what: &str, found: u64) {
        if found > 0 {
            self.0.push(format!("{found} {what} in place of 0"));
        }
    }

    fn at_least(&mut self, what: &str, found: u64, least: u64) {
        if found < least {
            self.0.push(format!("{found} {what} in place of {least} at least"));
        }
    }

    fn at_most(&mut self, what: &str, found: f64, most: f64) {
        if found > most {
            self.0.push(format!("{found:.2} {what} in place of {most:.2} at most"));
        }
    }

    fn given(self) -> Result<(), Failure> {
        match self.0.as_slice() {
            [] => {
                println!("as it should be");
                Ok(())
            }
            wrong => Err(format!("not as it should be: {}", wrong.join("; ")).into()),
        }
    }
}
