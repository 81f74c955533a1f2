//! What a caller may ask of a wire.

use std::time::Duration;

use busbar_modbus::{Registers, Request};

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

/// One request of one caller, checked, and what it may cost.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) unit: u8,
    pub(crate) ask: Ask,
    pub(crate) priority: Priority,
    /// How long each try waits for its answer.
    pub(crate) timeout: Duration,
    /// Whether fewer registers than asked for are an answer.
    pub(crate) short: bool,
    /// Where the registers of a read go: the caller's own buffer, so that nothing is allocated.
    pub(crate) registers: Vec<u16>,
}

/// The request itself.
#[derive(Debug)]
pub(crate) enum Ask {
    Holding { address: u16, count: u16 },
    Input { address: u16, count: u16 },
    Write(Write),
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
        matches!(self, Self::Write(_))
    }

    /// Bytes of the PDUs of the request and of its answer.
    pub(crate) fn pdus(&self) -> (usize, usize) {
        match self {
            Self::Holding { count, .. } | Self::Input { count, .. } => (5, 2 + 2 * usize::from(*count)),
            Self::Write(Write::Registers { values, .. }) => (6 + 2 * values.len(), 5),
            Self::Write(_) => (5, 5),
        }
    }

    pub(crate) fn request(&self) -> Request<'_> {
        match *self {
            Self::Holding { address, count } => Request::ReadHoldingRegisters { address, count },
            Self::Input { address, count } => Request::ReadInputRegisters { address, count },
            Self::Write(Write::Register { address, value }) => {
                Request::WriteSingleRegister { address, value }
            }
            Self::Write(Write::Registers { address, ref values }) => {
                Request::WriteMultipleRegisters { address, registers: Registers::from(values.as_slice()) }
            }
            Self::Write(Write::Coil { address, on }) => Request::WriteSingleCoil {
                address,
                value: match on {
                    true => 0xFF00,
                    false => 0x0000,
                },
            },
        }
    }
}

/// What became of a job: the caller's buffer comes back whatever happened.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) result: Result<(), LinkError>,
    pub(crate) registers: Vec<u16>,
}
