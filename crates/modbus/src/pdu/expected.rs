//! What may answer a request, in a few bytes that outlive it.

use super::{EXCEPTION_BIT, Request, Response};
use crate::error::Mismatch;

/// What of a request decides whether a response answers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Expected {
    function: u8,
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    /// So many coils or inputs, in just as many bytes as they need.
    Bits { count: u16 },
    /// So many registers; fewer only where that is allowed.
    Registers { count: u16, short: bool },
    /// The four bytes after the function code come back.
    Echo([u8; 4]),
    /// Anything.
    Any,
}

impl Expected {
    pub(crate) fn of(request: &Request<'_>) -> Self {
        let shape = match *request {
            Request::ReadCoils { count, .. } | Request::ReadDiscreteInputs { count, .. } => {
                Shape::Bits { count }
            }
            Request::ReadHoldingRegisters { count, .. } | Request::ReadInputRegisters { count, .. } => {
                Shape::Registers { count, short: false }
            }
            Request::WriteSingleCoil { address, value } | Request::WriteSingleRegister { address, value } => {
                echo(address, value)
            }
            Request::WriteMultipleCoils { address, coils } => echo(address, quantity(coils.len())),
            Request::WriteMultipleRegisters { address, registers } => {
                echo(address, quantity(registers.len()))
            }
            Request::Other { .. } => Shape::Any,
        };
        Self { function: request.function(), shape }
    }

    /// The same, but a read of registers may be answered by fewer than were asked for, if not by none: Datakom
    /// controllers cut longer reads to 16 and send those.
    pub(crate) fn or_short(mut self) -> Self {
        if let Shape::Registers { short, .. } = &mut self.shape {
            *short = true;
        }
        self
    }

    /// How many coils or inputs were asked for, where that was the question.
    pub(crate) fn bits(self) -> Option<usize> {
        match self.shape {
            Shape::Bits { count } => Some(count.into()),
            _ => None,
        }
    }

    /// Data bytes of a full answer to a read.
    pub(crate) fn data_bytes(self) -> Option<usize> {
        match self.shape {
            Shape::Bits { count } => Some(usize::from(count).div_ceil(8)),
            Shape::Registers { count, .. } => Some(2 * usize::from(count)),
            Shape::Echo(_) | Shape::Any => None,
        }
    }

    /// Whether the response answers the request.
    pub(crate) fn check(self, response: &Response<'_>) -> Result<(), Mismatch> {
        let found = response.function();
        if found != self.function {
            return Err(Mismatch::Function { expected: self.function, found });
        }
        match *response {
            Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => {
                self.check_data(bits.byte_len())
            }
            Response::ReadHoldingRegisters(registers) | Response::ReadInputRegisters(registers) => {
                self.check_data(2 * registers.len())
            }
            Response::WriteSingleCoil { address, value }
            | Response::WriteSingleRegister { address, value } => self.check_echo(address, value),
            Response::WriteMultipleCoils { address, count }
            | Response::WriteMultipleRegisters { address, count } => self.check_echo(address, count),
            Response::Exception { .. } | Response::Other { .. } => Ok(()),
        }
    }

    /// Whether a read may be answered by so many data bytes.
    pub(crate) fn check_data(self, found: usize) -> Result<(), Mismatch> {
        let Some(expected) = self.data_bytes() else {
            return Ok(());
        };
        let short = matches!(self.shape, Shape::Registers { short: true, .. }) && found.is_multiple_of(2);
        if found == expected || (short && found > 0 && found < expected) {
            return Ok(());
        }
        Err(Mismatch::Length { expected, found })
    }

    fn check_echo(self, first: u16, second: u16) -> Result<(), Mismatch> {
        let Shape::Echo(expected) = self.shape else {
            return Ok(());
        };
        let found = pair(first, second);
        if found == expected {
            return Ok(());
        }
        Err(Mismatch::Echo { expected, found })
    }

    /// Whether a function code answers ours, plainly or with an exception.
    pub(crate) fn is_function(self, function: u8) -> bool {
        function & !EXCEPTION_BIT == self.function
    }
}

fn echo(first: u16, second: u16) -> Shape {
    Shape::Echo(pair(first, second))
}

fn pair(first: u16, second: u16) -> [u8; 4] {
    let [a, b] = first.to_be_bytes();
    let [c, d] = second.to_be_bytes();
    [a, b, c, d]
}

/// A quantity as the wire carries it; encoding refuses what does not fit.
fn quantity(len: usize) -> u16 {
    u16::try_from(len).unwrap_or(u16::MAX)
}
