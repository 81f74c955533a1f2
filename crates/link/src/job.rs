//! What a caller may ask of a wire.

use std::time::Duration;

use busbar_modbus::{Registers, Request, Stray};
use thiserror::Error;

use crate::error::LinkError;

/// A change to a device. It is sent at most once, whatever happens.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Write {
    /// One holding register (function 6).
    Register {
        /// Its address.
        address: u16,
        /// What to write.
        value: u16,
    },
    /// Holding registers side by side (function 16), 1 to 123.
    Registers {
        /// Address of the first.
        address: u16,
        /// What to write.
        values: Vec<u16>,
    },
    /// One coil (function 5).
    Coil {
        /// Its address.
        address: u16,
        /// On sends FF00h, off 0000h.
        on: bool,
    },
}

/// Who goes first when several wait for one wire. Writes always go as commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Priority {
    /// A command, and the reads that prove it.
    Command,
    /// A person waits for the answer.
    Person,
    /// Nobody waits: the next round asks again.
    Poll,
}

impl Priority {
    pub(crate) const COUNT: usize = 3;

    pub(crate) fn index(self) -> usize {
        match self {
            Self::Command => 0,
            Self::Person => 1,
            Self::Poll => 2,
        }
    }
}

/// Writes that belong together, cut short: the first failure ends them.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{error} (the device had acknowledged {acknowledged} of {of} writes that belong together)")]
pub struct Interrupted {
    /// How many the device acknowledged; the one behind them failed, and what is behind that did not leave.
    pub acknowledged: usize,
    /// How many were asked for.
    pub of: usize,
    /// What happened to the one that failed.
    #[source]
    pub error: LinkError,
}

/// One request of one caller, checked, and what it may cost.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) unit: u8,
    pub(crate) ask: Ask,
    pub(crate) priority: Priority,
    /// How long each try waits for its answer at most.
    pub(crate) timeout: Duration,
    /// How long the unit is left alone before and after.
    pub(crate) spacing: Duration,
    /// Whether fewer registers than asked for are an answer.
    pub(crate) short: bool,
    /// Where the registers of a read go: the caller's own buffer, so that nothing is allocated.
    pub(crate) registers: Vec<u16>,
}

impl Job {
    pub(crate) fn question(&self) -> Question {
        let (function, address, count) = match self.ask {
            Ask::Holding { address, count } => (0x03, address, count),
            Ask::Input { address, count } => (0x04, address, count),
            Ask::Write(ref write) => write.addressed(),
            Ask::Together { ref writes, done } => writes.get(done).map_or((0, 0, 0), Write::addressed),
        };
        Question { unit: self.unit, function, address, count, short: self.short, write: self.ask.is_write() }
    }
}

/// What of a request tells its answer from others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Question {
    pub(crate) unit: u8,
    pub(crate) function: u8,
    pub(crate) address: u16,
    pub(crate) count: u16,
    pub(crate) short: bool,
    pub(crate) write: bool,
}

impl Question {
    /// Bytes of the request's PDU.
    pub(crate) fn request_pdu(&self) -> usize {
        match self.function {
            0x10 => 6 + 2 * usize::from(self.count),
            _ => 5,
        }
    }

    /// Bytes of the PDU of a full answer.
    pub(crate) fn answer_pdu(&self) -> usize {
        match self.write {
            true => 5,
            false => 2 + 2 * usize::from(self.count),
        }
    }

    /// Whether only the asking tells the answers to the two apart.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let alike = self.short || other.short || self.answer_pdu() == other.answer_pdu();
        self.unit == other.unit && self.function == other.function && alike
    }

    /// Whether this frame may be the answer.
    pub(crate) fn may_be_answered_by(&self, frame: &Stray) -> bool {
        let fits = frame.exception || self.short || self.answer_pdu() == frame.pdu_len;
        self.unit == frame.unit && self.function == frame.function && fits
    }
}

/// The request itself.
#[derive(Clone, Debug)]
pub(crate) enum Ask {
    Holding {
        address: u16,
        count: u16,
    },
    Input {
        address: u16,
        count: u16,
    },
    Write(Write),
    /// Writes with nothing between them, and how many of them are done; at least one is not.
    Together {
        writes: Vec<Write>,
        done: usize,
    },
}

impl Ask {
    pub(crate) fn read(function: u8, address: u16, count: u16) -> Result<Self, LinkError> {
        match function {
            0x03 => Ok(Self::Holding { address, count }),
            0x04 => Ok(Self::Input { address, count }),
            _ => Err(LinkError::NotARead { function }),
        }
    }

    pub(crate) fn is_write(&self) -> bool {
        matches!(self, Self::Write(_) | Self::Together { .. })
    }

    /// What to send next; nothing when all of it is done.
    pub(crate) fn request(&self) -> Option<Request<'_>> {
        match *self {
            Self::Holding { address, count } => Some(Request::ReadHoldingRegisters { address, count }),
            Self::Input { address, count } => Some(Request::ReadInputRegisters { address, count }),
            Self::Write(ref write) => Some(write.request()),
            Self::Together { ref writes, done } => writes.get(done).map(Write::request),
        }
    }

    /// What was sent is done. Says whether there is more to send.
    pub(crate) fn advance(&mut self) -> bool {
        let Self::Together { writes, done } = self else {
            return false;
        };
        *done += 1;
        *done < writes.len()
    }

    /// How many of the writes that belong together are done.
    pub(crate) fn done(&self) -> usize {
        match self {
            Self::Together { done, .. } => *done,
            _ => 0,
        }
    }
}

impl Write {
    fn request(&self) -> Request<'_> {
        match *self {
            Self::Register { address, value } => Request::WriteSingleRegister { address, value },
            Self::Registers { address, ref values } => {
                Request::WriteMultipleRegisters { address, registers: Registers::from(values.as_slice()) }
            }
            Self::Coil { address, on } => Request::WriteSingleCoil {
                address,
                value: match on {
                    true => 0xFF00,
                    false => 0x0000,
                },
            },
        }
    }

    /// Function, address and how many.
    fn addressed(&self) -> (u8, u16, u16) {
        match *self {
            Self::Register { address, .. } => (0x06, address, 1),
            Self::Registers { address, ref values } => {
                (0x10, address, u16::try_from(values.len()).unwrap_or(u16::MAX))
            }
            Self::Coil { address, .. } => (0x05, address, 1),
        }
    }
}

/// What became of a job: the caller's buffer comes back whatever happened.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) result: Result<(), LinkError>,
    pub(crate) registers: Vec<u16>,
    /// How many of the writes that belong together are done.
    pub(crate) done: usize,
}
