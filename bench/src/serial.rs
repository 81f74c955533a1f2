//! Serial lines at 9600 8N1 on a pseudo-terminal that keeps line time: the silence that clients leave before a request,
//! and what a full refresh of each controller takes beside the least it can take.

use std::error::Error;
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use busbar_emulator::Config;
use busbar_link::{Endpoint, Link, Options};
use busbar_profile::plan::{Cost, Planner, items};
use busbar_profile::{Profile, builtins};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::process::{Process, python};

const BAUD: u32 = 9600;
const BITS: u32 = 10;
/// A character on the line, and 3.5 of them.
const CHARACTER: Duration = Duration::from_nanos(1_041_667);
const SILENCE: Duration = Duration::from_nanos(3_645_833);
const REQUEST: usize = 8;
const PATIENCE: Duration = Duration::from_secs(2);
const CLIENTS: [&str; 3] = ["busbar", "tokio-modbus", "pymodbus"];

pub(crate) fn run(options: &[&str]) -> Result<(), Box<dyn Error>> {
    let exchanges = match options {
        [] => 400,
        ["--exchanges", exchanges] => exchanges.parse()?,
        _ => return Err(crate::USAGE.into()),
    };
    println!(
        "Silence between the last character of an answer and the next request, 9600 8N1, reads of 16 registers"
    );
    println!("{:<16}{:>10}{:>10}{:>10}{:>10}{:>12}", "", "least", "median", "99th", "most", "too early");
    for client in CLIENTS {
        let mut gaps = silence(client, exchanges)?;
        gaps.sort();
        let at = |share: f64| ms(gaps[(gaps.len() as f64 * share) as usize]);
        let early = gaps.iter().filter(|gap| **gap < SILENCE).count();
        let most = gaps.last().copied().map_or(f64::NAN, ms);
        println!(
            "{client:<16}{:>7.2} ms{:>7.2} ms{:>7.2} ms{most:>7.2} ms{early:>6} of {}",
            at(0.0),
            at(0.5),
            at(0.99),
            gaps.len()
        );
    }
    println!("target: 3.65 to 3.80 ms; 3.646 ms is the least that the standard allows\n");

    println!("A full refresh at 9600 8N1 without the pauses that makers ask for, image and trace left out");
    println!("{:<20}{:>7}{:>13}{:>13}{:>9}", "", "reads", "least", "measured", "ratio");
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
    for profile in builtins() {
        let (reads, least, took) = runtime.block_on(refresh(profile))?;
        let ratio = took.as_secs_f64() / least.as_secs_f64();
        println!("{:<20}{reads:>7}{:>10.1} ms{:>10.1} ms{ratio:>9.3}", profile.key, ms(least), ms(took));
    }
    println!("target: within 2 % of the least");
    Ok(())
}

/// The silence before each request of a client but its first.
fn silence(client: &str, exchanges: usize) -> Result<Vec<Duration>, Box<dyn Error>> {
    let mut line = Line::open()?;
    let count = (exchanges + 1).to_string();
    let mut command = match client {
        "pymodbus" => {
            let mut command = python()?;
            command.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/pymodbus_serial.py"));
            command
        }
        _ => {
            let mut command = Command::new(std::env::current_exe()?);
            command.args(["peer", client, "serial"]);
            command
        }
    };
    let _client = Process::start(command.args([&line.path, &count]))?;
    line.answer(exchanges + 1)
}

/// The server's end of a line, which lets every byte take its time.
struct Line {
    wire: File,
    path: String,
    /// The client's end, kept open so that the line does not hang up between two clients.
    _far: OwnedFd,
}

impl Line {
    fn open() -> Result<Self, Box<dyn Error>> {
        let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&near)?;
        unlockpt(&near)?;
        let path = ptsname(&near, Vec::new())?.into_string()?;
        let far = open(&*path, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
        let mut settings = tcgetattr(&far)?;
        settings.make_raw();
        tcsetattr(&far, OptionalActions::Now, &settings)?;
        Ok(Self { wire: File::from(near), path, _far: far })
    }

    fn answer(&mut self, exchanges: usize) -> Result<Vec<Duration>, Box<dyn Error>> {
        let mut gaps = Vec::with_capacity(exchanges);
        let mut ended: Option<Instant> = None;
        for _ in 0..exchanges {
            let came = self.request()?;
            gaps.extend(ended.map(|ended| came.duration_since(ended)));
            // The request is written in one go and takes its time on the line.
            wait_until(came + CHARACTER * REQUEST as u32 + SILENCE);
            ended = Some(self.respond()?);
        }
        Ok(gaps)
    }

    /// When the first byte of a whole request came.
    fn request(&mut self) -> Result<Instant, Box<dyn Error>> {
        let mut first = None;
        let mut have = 0;
        while have < REQUEST {
            let limit = Timespec { tv_sec: PATIENCE.as_secs() as i64, tv_nsec: 0 };
            if poll(&mut [PollFd::new(&self.wire, PollFlags::IN)], Some(&limit))? == 0 {
                return Err("the client asks no more".into());
            }
            let came = Instant::now();
            have += self.wire.read(&mut [0; 64])?;
            first.get_or_insert(came);
        }
        Ok(first.unwrap_or_else(Instant::now))
    }

    /// Sixteen registers, in the pieces that a receiver with a small buffer hands on; says when the last byte was out.
    fn respond(&mut self) -> std::io::Result<Instant> {
        let began = Instant::now();
        let mut sent = 0;
        for piece in answer().chunks(8) {
            sent += piece.len();
            wait_until(began + CHARACTER * sent as u32);
            self.wire.write_all(piece)?;
        }
        Ok(Instant::now())
    }
}

/// Unit 1, function 3, 16 registers of 0 and their check sum.
fn answer() -> Vec<u8> {
    let registers = [0; 16];
    let response = busbar_modbus::Response::ReadHoldingRegisters((&registers).into());
    let mut frame = Vec::new();
    // Sixteen registers fit.
    let _ = busbar_modbus::rtu::encode_response(1, &response, &mut frame);
    frame
}

/// Sleeps most of the time and spins the rest: a line is more exact than a thread's timer.
fn wait_until(instant: Instant) {
    const SPUN: Duration = Duration::from_micros(150);
    thread::sleep(instant.saturating_duration_since(Instant::now()).saturating_sub(SPUN));
    while Instant::now() < instant {
        std::hint::spin_loop();
    }
}

/// Reads of a refresh, the least it can take, and what it took against the imitation on a line of its own.
async fn refresh(profile: &'static Profile) -> Result<(usize, Duration, Duration), Box<dyn Error>> {
    const ROUNDS: u32 = 5;
    let listen = vec!["rtu://pty?baud=9600".parse::<Endpoint>()?];
    let emulation =
        busbar_emulator::start(Config { profile: profile.key.clone(), listen, ..Config::default() }).await?;
    let endpoint = emulation.urls().first().ok_or("no line")?.clone();
    let link = Link::open(endpoint, Options::default())?;

    let planner = Planner::new(profile, Cost::rtu(BAUD, BITS, profile.wire.answer_delay()));
    let points: Vec<usize> = (0..profile.points.len())
        .filter(|index| {
            let point = &profile.points[*index];
            point.access.is_readable() && !point.data_type.is_bulk()
        })
        .collect();
    let reads = planner.reads(items(profile, &points));
    let least = Duration::from_nanos(planner.least(items(profile, &points)));
    let mut registers = Vec::new();
    link.read_registers_into(1, 3, reads[0].address, 1, &mut registers).await?;
    let began = Instant::now();
    for _ in 0..ROUNDS {
        for read in &reads {
            link.read_registers_into(1, read.function, read.address, read.count, &mut registers).await?;
        }
    }
    Ok((reads.len(), least, began.elapsed() / ROUNDS))
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
