//! A command of a scenario: sent to the device as any client would, through its own wire rules, and watched to its end.

use std::fmt;
use std::time::Duration;

use busbar_modbus::{Request, Response};
use busbar_profile::command::{Arguments, Frame, Next, ReadFailure, Report, Run, Verdict, WriteOutcome};
use busbar_profile::plan::plan;
use busbar_profile::{Command, Profile};

use crate::device::Device;
use crate::notes::Place;
use crate::rules::{COIL_OFF, COIL_ON};

/// A command under way.
pub(super) struct Order {
    pub(super) command: &'static Command,
    pub(super) place: Place,
    pub(super) since: Duration,
    /// The verdict that the scenario asks for; without one the command must not fail.
    wanted: Option<Verdict>,
    run: Run<'static>,
}

impl fmt::Debug for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Order")
            .field("command", &self.command.id)
            .field("since", &self.since)
            .finish_non_exhaustive()
    }
}

impl Order {
    pub(super) fn new(
        profile: &'static Profile,
        command: &'static Command,
        arguments: Arguments,
        wanted: Option<Verdict>,
        (place, now): (Place, Duration),
    ) -> Self {
        let run = Run::new(profile, command, arguments, profile.wire.word_order);
        Self { command, place, since: now, wanted, run }
    }

    /// Does what there is to do now; the report when the command is over.
    pub(super) fn go_on(&mut self, now: Duration, device: &mut Device) -> Option<Report> {
        let time = now - self.since;
        loop {
            match self.run.next(time) {
                Next::Read(points) => {
                    let outcome = self.read(&points, device);
                    self.run.read(time, outcome);
                }
                Next::Write(frame) => self.run.written(time, write(frame, device)),
                Next::WaitUntil(_) | Next::Pending => return None,
                Next::Done(report) => return Some(report),
            }
        }
    }

    /// What the scenario asks for, in words.
    pub(super) fn wish(&self) -> String {
        match self.wanted {
            Some(verdict) => format!("the verdict {verdict}"),
            None => "that it is done".to_owned(),
        }
    }

    /// Whether it ended as the scenario asks.
    pub(super) fn is_met(&self, verdict: Verdict) -> bool {
        match self.wanted {
            Some(wanted) => verdict == wanted,
            None => {
                let documented = !self.command.proof.steps().is_empty();
                verdict == Verdict::Done || verdict == Verdict::Unknown && !documented
            }
        }
    }

    fn read(&mut self, points: &[usize], device: &mut Device) -> Result<(), ReadFailure> {
        for read in plan(device.profile(), points) {
            let request = match read.function {
                0x04 => Request::ReadInputRegisters { address: read.address, count: read.count },
                _ => Request::ReadHoldingRegisters { address: read.address, count: read.count },
            };
            match device.answer(device.unit(), &request) {
                Some(Response::ReadHoldingRegisters(registers) | Response::ReadInputRegisters(registers)) => {
                    let registers: Vec<u16> = registers.iter().collect();
                    self.run.store(read.address, &registers);
                }
                Some(Response::Exception { code, .. }) => return Err(ReadFailure::Exception(code.0)),
                _ => return Err(ReadFailure::Silent),
            }
        }
        Ok(())
    }
}

fn write(frame: Frame, device: &mut Device) -> WriteOutcome {
    let Frame { function, address, value, .. } = frame;
    let values = [value];
    let request = match function {
        0x05 => Request::WriteSingleCoil { address, value: if value == 0 { COIL_OFF } else { COIL_ON } },
        0x06 => Request::WriteSingleRegister { address, value },
        _ => Request::WriteMultipleRegisters { address, registers: (&values).into() },
    };
    match device.answer(device.unit(), &request) {
        Some(Response::Exception { code, .. }) => WriteOutcome::Exception(code.0),
        Some(_) => WriteOutcome::Acknowledged,
        None => WriteOutcome::Lost,
    }
}
