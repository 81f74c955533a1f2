//! A controller for scripts: registers that a test sets, and a wire whose every answer the test decides.

use std::time::Duration;

use busbar_profile::command::{Frame, Next, ReadFailure, Report, Run, WriteOutcome};
use busbar_profile::{Command, DateTime, Image, Profile, WordOrder, builtin};

/// What an exchange takes, and how long the wire waits for an answer that does not come.
const EXCHANGE: Duration = Duration::from_millis(50);
const TIMEOUT: Duration = Duration::from_secs(1);
/// The origin of the caller's clock means nothing: it is not where the command begins.
const ORIGIN: Duration = Duration::from_secs(1_000_000);

/// The controller as its registers show it.
pub(crate) struct World {
    pub(crate) profile: &'static Profile,
    pub(crate) image: Image,
}

impl World {
    pub(crate) fn new(key: &str) -> Self {
        let profile = builtin(key).unwrap_or_else(|| panic!("no profile {key}"));
        Self { profile, image: Image::zeroed(profile) }
    }

    /// Sets a point to a raw code, or one bit of it.
    pub(crate) fn set(&mut self, id: &str, bit: Option<u16>, code: u32) {
        let index = self.profile.point_index(id).unwrap_or_else(|| panic!("no point {id}"));
        let point = &self.profile.points[index];
        let (_, low) = point.field.unwrap_or((15, 0));
        let registers = self.image.registers_mut(index).unwrap_or_else(|| panic!("{id} cannot be read"));
        match bit {
            Some(bit) => {
                let register = &mut registers[usize::from(bit / 16)];
                *register = *register & !(1 << (bit % 16)) | (code as u16) << (bit % 16);
            }
            None => {
                registers[0] = (code as u16) << low;
                if let Some(high) = registers.get_mut(1) {
                    *high = (code >> 16) as u16;
                }
            }
        }
    }

    /// `id=code` or `id.bit=code`, several with spaces between them.
    pub(crate) fn set_all(&mut self, text: &str) {
        for word in text.split_whitespace() {
            let (what, code) = word.split_once('=').unwrap_or_else(|| panic!("what is `{word}`?"));
            let code = match code.strip_prefix("0x") {
                Some(hex) => u32::from_str_radix(hex, 16).unwrap(),
                None => code.parse().unwrap_or_else(|_| panic!("what is `{word}`?")),
            };
            match what.split_once('.') {
                Some((id, bit)) => self.set(id, Some(bit.parse().unwrap()), code),
                None => self.set(what, None, code),
            }
        }
    }
}

/// A command under way, by the caller's clock.
pub(crate) struct Bench<'p> {
    pub(crate) world: World,
    pub(crate) run: Run<'p>,
    pub(crate) now: Duration,
}

/// `2026-11-23T05:19:20` unless a test says otherwise.
pub(crate) fn local() -> DateTime {
    "2026-11-23T05:19:20".parse().unwrap()
}

impl Bench<'static> {
    pub(crate) fn new(key: &str, command: &str, args: &[(&str, &str)]) -> Self {
        let world = World::new(key);
        let profile = world.profile;
        let command = profile.command(command).unwrap_or_else(|| panic!("{key} has no command {command}"));
        Self::of(world, command, args)
    }

    pub(crate) fn of(world: World, command: &'static Command, args: &[(&str, &str)]) -> Self {
        let arguments = command.arguments(args.iter().copied(), local()).unwrap();
        let run = Run::new(world.profile, command, arguments, WordOrder::LowFirst);
        Self { world, run, now: ORIGIN }
    }

    /// Since the command began.
    pub(crate) fn elapsed(&self) -> Duration {
        self.now - ORIGIN
    }

    /// What is asked for next, after the waiting.
    pub(crate) fn ask(&mut self) -> Next {
        loop {
            match self.run.next(self.now) {
                Next::WaitUntil(at) => {
                    assert!(at > self.now, "waiting for the past");
                    self.now = at;
                }
                other => return other,
            }
        }
    }

    /// Answers a reading from the registers, or fails it.
    pub(crate) fn answer(&mut self, points: &[usize], failure: Option<ReadFailure>) {
        let unanswered = matches!(failure, Some(ReadFailure::Silent | ReadFailure::Down));
        self.now += if unanswered { TIMEOUT } else { EXCHANGE };
        if failure.is_none() {
            for &point in points {
                let registers = self.world.image.registers(point).unwrap().to_vec();
                self.run.store(self.world.profile.points[point].address, &registers);
            }
        }
        self.run.read(self.now, failure.map_or(Ok(()), Err));
    }

    pub(crate) fn outcome(&mut self, outcome: WriteOutcome) {
        self.now += if outcome == WriteOutcome::Lost { TIMEOUT } else { EXCHANGE };
        self.run.written(self.now, outcome);
    }
}

/// Plays a script: each line is what must be asked for next and what comes of it.
///
/// ```text
/// read [id=code | id.bit=code]...     registers change, then a reading is answered
/// read* [...]                         the same for every reading until something else is asked for
/// read silent | down | exception N
/// write FUNCTION ADDRESS VALUE ack | lost | unsent | exception N
/// at SECONDS                          the time since the command began, to 0.1 s
/// VERDICT SENT REASON
/// ```
pub(crate) fn play(key: &str, command: &str, args: &[(&str, &str)], script: &str) -> Report {
    let mut bench = Bench::new(key, command, args);
    let mut asked = bench.ask();
    for line in script.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "at" => {
                let at = format!("{:.1}", bench.elapsed().as_secs_f64());
                assert_eq!(at, rest, "{key} {command}: at `{line}`");
            }
            "read" | "read*" => loop {
                let Next::Read(points) = &asked else { panic!("{key} {command}: {asked:?} at `{line}`") };
                let failure = failure(rest);
                if failure.is_none() {
                    bench.world.set_all(rest);
                }
                bench.answer(points, failure);
                asked = bench.ask();
                if word == "read" || !matches!(asked, Next::Read(_)) {
                    break;
                }
            },
            "write" => {
                let Next::Write(frame) = asked else { panic!("{key} {command}: {asked:?} at `{line}`") };
                let (wanted, outcome) = write(rest);
                let found = (frame.function, frame.address, frame.value);
                assert_eq!(found, wanted, "{key} {command}: at `{line}`");
                bench.outcome(outcome);
                asked = bench.ask();
            }
            verdict => {
                let Next::Done(report) = &asked else { panic!("{key} {command}: {asked:?} at `{line}`") };
                let found = format!("{} {} {}", report.verdict, report.sent, report.reason);
                assert_eq!(found, format!("{verdict} {rest}"), "{key} {command}");
                assert_eq!(report.elapsed, bench.elapsed());
                return report.clone();
            }
        }
    }
    panic!("{key} {command}: the script ends before the command: {asked:?}");
}

fn failure(text: &str) -> Option<ReadFailure> {
    match text.split_once(' ').unwrap_or((text, "")) {
        ("silent", _) => Some(ReadFailure::Silent),
        ("down", _) => Some(ReadFailure::Down),
        ("exception", code) => Some(ReadFailure::Exception(code.parse().unwrap())),
        _ => None,
    }
}

fn write(text: &str) -> ((u8, u16, u16), WriteOutcome) {
    let words: Vec<_> = text.split_whitespace().collect();
    let number = |text: &str| match text.strip_prefix("0x") {
        Some(hex) => u16::from_str_radix(hex, 16).unwrap(),
        None => text.parse().unwrap(),
    };
    let outcome = match words[3..] {
        ["ack"] => WriteOutcome::Acknowledged,
        ["lost"] => WriteOutcome::Lost,
        ["unsent"] => WriteOutcome::NotSent,
        ["exception", code] => WriteOutcome::Exception(code.parse().unwrap()),
        _ => panic!("what is `{text}`?"),
    };
    ((number(words[0]) as u8, number(words[1]), number(words[2])), outcome)
}

/// A frame for comparison.
pub(crate) fn frame(frame: Frame) -> (u8, u16, u16) {
    (frame.function, frame.address, frame.value)
}
