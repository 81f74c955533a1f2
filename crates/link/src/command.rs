//! One remote command over a wire: the rules are `profile::command`, here are the frames and the clock.
//!
//! What the rules ask to read is read ahead of everything else on the wire; what they write is handed to
//! [`Link::write`] once and never again. All time is tokio's, so that a test can pause it.

use std::collections::VecDeque;

use busbar_modbus::ExceptionCode;
use busbar_profile::command::{Arguments, Command, Frame, Next, ReadFailure, Report, Run, WriteOutcome};
use busbar_profile::plan::{Read, items, plan};
use busbar_profile::{OverRead, Profile, WordOrder};
use tokio::time::{Duration, Instant, sleep_until};

use crate::error::LinkError;
use crate::job::{Priority, Write};
use crate::link::Link;

/// Acknowledge: accepted, and still at work. The rules know what to make of it.
const ACKNOWLEDGE: u8 = 0x05;

/// What a command is doing, for whoever waits for its end.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Progress<'a> {
    /// The device is asked for these points, by their indexes in the profile.
    Reading {
        /// The points.
        points: &'a [usize],
        /// How many writes have been sent before.
        sent: u32,
    },
    /// A reading is not whole.
    NotRead {
        /// Why not.
        error: &'a LinkError,
    },
    /// A write is handed to the wire. From here on it may leave.
    Writing {
        /// The step of the command, from 1.
        step: usize,
        /// What is written.
        frame: Frame,
    },
    /// The device confirmed the write.
    Confirmed,
    /// The write has no confirmation; [`LinkError::may_have_taken_effect`] says whether it may have left its mark.
    NotConfirmed {
        /// What came instead.
        error: &'a LinkError,
    },
}

/// Sends a command of `profile` to a unit and watches for its effect, with arguments that [`Command::arguments`] made.
///
/// Every write leaves at most once, whatever becomes of its answer. Times in the report count from this call. Dropped
/// early, nothing more is sent; what has left may still take effect.
pub async fn run(
    link: &Link,
    unit: u8,
    profile: &Profile,
    command: &Command,
    arguments: Arguments,
    order: WordOrder,
) -> Report {
    run_with(link, unit, profile, Run::new(profile, command, arguments, order), |_| {}).await
}

/// Like [`run`], for a command that was made ready with [`Run::new`] of the same profile; `progress` is told what it is
/// doing.
pub async fn run_with(
    link: &Link,
    unit: u8,
    profile: &Profile,
    mut run: Run<'_>,
    mut progress: impl FnMut(Progress<'_>),
) -> Report {
    let started = Instant::now();
    let device = Device {
        link: link
            .with_priority(Priority::Command)
            .with_short_answers(profile.wire.over_read == OverRead::Truncate),
        unit,
        profile,
    };
    let mut doubts = String::new();
    loop {
        match run.next(started.elapsed()) {
            Next::Read(points) => {
                progress(Progress::Reading { points: &points, sent: run.sent() });
                let outcome = device.read(&points, &mut run).await;
                if let Err(error) = &outcome {
                    progress(Progress::NotRead { error });
                }
                run.read(started.elapsed(), outcome.map_err(|error| failure(&error)));
            }
            Next::Write(frame) => {
                progress(Progress::Writing { step: run.step(), frame });
                let result = device.write(frame).await;
                match &result {
                    Ok(()) => progress(Progress::Confirmed),
                    Err(error) => progress(Progress::NotConfirmed { error }),
                }
                let outcome = device.outcome(&result);
                if let (WriteOutcome::Lost, Err(LinkError::Exception { code, .. })) = (outcome, &result) {
                    doubts.push_str(&format!(
                        " The device answered the write with exception {code}, which does not say that nothing was done."
                    ));
                }
                run.written(started.elapsed(), outcome);
            }
            Next::WaitUntil(at) => sleep_until(started + at).await,
            // Never: whatever is asked for above is answered there.
            Next::Pending => sleep_until(Instant::now() + Duration::from_millis(100)).await,
            Next::Done(mut report) => {
                report.reason.push_str(&doubts);
                return report;
            }
        }
    }
}

/// The device that a command is for.
struct Device<'a> {
    link: Link,
    unit: u8,
    profile: &'a Profile,
}

impl Device<'_> {
    /// Reads points into the running command. The first read without an answer ends it: the rules decide by whole
    /// readings, and a silent device is not to be asked for the rest of one.
    async fn read(&self, points: &[usize], run: &mut Run<'_>) -> Result<(), LinkError> {
        let mut reads = VecDeque::from(plan(self.profile, points));
        let mut refusal = Ok(());
        while let Some(read) = reads.pop_front() {
            let answer = self.link.read_registers(self.unit, read.function, read.address, read.count).await;
            match answer {
                Ok(registers) => {
                    run.store(read.address, &registers);
                    let came = u16::try_from(registers.len()).unwrap_or(read.count);
                    self.again(&mut reads, &self.cut_off(points, read, came));
                }
                Err(error @ LinkError::Exception { code, .. }) => {
                    let parts = self.parts(points, read);
                    if code == ExceptionCode::ILLEGAL_DATA_ADDRESS && !parts.is_empty() {
                        // One address that the device lacks takes the others of its read with it.
                        parts.iter().rev().for_each(|part| self.again(&mut reads, &[*part]));
                    } else {
                        refusal = Err(error);
                    }
                }
                Err(error) => return Err(error),
            }
        }
        refusal
    }

    /// Puts the reads for these points in front.
    fn again(&self, reads: &mut VecDeque<Read>, points: &[usize]) {
        plan(self.profile, points).into_iter().rev().for_each(|read| reads.push_front(read));
    }

    /// The points of a read that lie behind its first `came` registers; none when the cut leaves nothing to begin with.
    fn cut_off(&self, points: &[usize], read: Read, came: u16) -> Vec<usize> {
        let within = |read: Read| {
            points.iter().copied().filter(move |point| {
                let mut place = items(self.profile, std::slice::from_ref(point));
                place.next().is_some_and(|(address, registers)| read.covers(address, registers))
            })
        };
        let whole = Read { count: came, ..read };
        let all: Vec<usize> = within(read).collect();
        let missing: Vec<usize> =
            all.iter().copied().filter(|point| within(whole).all(|p| p != *point)).collect();
        if missing.len() < all.len() { missing } else { Vec::new() }
    }

    /// The points of a read that can be read by themselves, where that makes it shorter.
    fn parts(&self, points: &[usize], read: Read) -> Vec<usize> {
        let mut parts = Vec::new();
        for point in points {
            for (address, registers) in items(self.profile, std::slice::from_ref(point)) {
                if read.covers(address, registers) && registers < read.count {
                    parts.push(*point);
                }
            }
        }
        parts
    }

    async fn write(&self, frame: Frame) -> Result<(), LinkError> {
        let Frame { function, address, value, .. } = frame;
        let write = match function {
            0x05 => Write::Coil { address, on: value != 0 },
            0x06 => Write::Register { address, value },
            _ => Write::Registers { address, values: vec![value] },
        };
        self.link.write(self.unit, write).await
    }

    /// What became of a write, as the rules want to know it.
    fn outcome(&self, result: &Result<(), LinkError>) -> WriteOutcome {
        match result {
            Ok(()) => WriteOutcome::Acknowledged,
            // A name of the maker's own is a refusal; and an acknowledgement is the rules' to judge.
            Err(LinkError::Exception { code, .. })
                if code.0 == ACKNOWLEDGE || self.profile.exception_name(code.0).is_some() =>
            {
                WriteOutcome::Exception(code.0)
            }
            Err(error) if error.may_have_taken_effect() => WriteOutcome::Lost,
            Err(LinkError::Exception { code, .. }) => WriteOutcome::Exception(code.0),
            Err(_) => WriteOutcome::NotSent,
        }
    }
}

fn failure(error: &LinkError) -> ReadFailure {
    match error {
        LinkError::Exception { code, .. } => ReadFailure::Exception(code.0),
        LinkError::Timeout { .. } => ReadFailure::Silent,
        _ => ReadFailure::Down,
    }
}
