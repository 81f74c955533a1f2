//! What a device's manual lets through: functions, lengths and addresses, before anything is read or done.

use busbar_modbus::{ExceptionCode, Registers, Request};
use busbar_profile::{OverRead, Wire};

/// More registers than fit one answer of the protocol; what a device does from there on is the maker's rule.
const MOST_REGISTERS: u16 = 125;

/// The only two values of function 5 (V1.1b3, 6.5).
pub(crate) const COIL_ON: u16 = 0xFF00;
pub(crate) const COIL_OFF: u16 = 0x0000;

/// Which registers and coils a device has.
pub(crate) trait Map {
    /// Whether all of `count` registers from `address` on may be read.
    fn is_readable(&self, address: u16, count: u16) -> bool;
    /// Whether a register may be written.
    fn is_writable(&self, address: u16) -> bool;
    /// Whether there is a coil that may be written.
    fn is_coil(&self, address: u16) -> bool;
}

/// The maker's own exception codes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusals {
    /// A count of 0 or of more than the protocol allows.
    pub(crate) quantity: ExceptionCode,
    /// A write to a register that can only be read.
    pub(crate) protected: ExceptionCode,
}

/// A request that the device serves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Permitted<'a> {
    /// `count` registers, already cut to what the device answers.
    Read { address: u16, count: u16 },
    /// One register.
    Write { address: u16, value: u16 },
    /// One coil.
    WriteCoil { address: u16, on: bool },
    /// Several registers, every one of them writable.
    WriteSeveral { address: u16, registers: Registers<'a> },
}

/// Judges one request.
///
/// # Errors
/// The exception that the device answers.
pub(crate) fn permit<'a>(
    request: &Request<'a>,
    wire: &Wire,
    refusals: Refusals,
    map: &impl Map,
) -> Result<Permitted<'a>, ExceptionCode> {
    if !wire.functions.contains(&request.function()) {
        return Err(ExceptionCode::ILLEGAL_FUNCTION);
    }
    match *request {
        Request::ReadHoldingRegisters { address, count } | Request::ReadInputRegisters { address, count } => {
            if count == 0 || count > MOST_REGISTERS {
                return Err(refusals.quantity);
            }
            let count = match wire.over_read {
                OverRead::Truncate => count.min(wire.max_read),
                _ if count > wire.max_read => return Err(refusals.quantity),
                _ => count,
            };
            // Judged after the cut: what is not sent cannot be missing.
            match map.is_readable(address, count) {
                true => Ok(Permitted::Read { address, count }),
                false => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
            }
        }
        Request::WriteSingleRegister { address, value } => {
            writable(map, refusals, address, 1)?;
            Ok(Permitted::Write { address, value })
        }
        Request::WriteSingleCoil { address, value } => {
            // The value before the address (V1.1b3, figure 15).
            let on = match value {
                COIL_ON => true,
                COIL_OFF => false,
                _ => return Err(ExceptionCode::ILLEGAL_DATA_VALUE),
            };
            match map.is_coil(address) {
                true => Ok(Permitted::WriteCoil { address, on }),
                false => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
            }
        }
        Request::WriteMultipleRegisters { address, registers } => {
            let count = registers.len();
            if count == 0 || count > usize::from(wire.max_write) {
                return Err(refusals.quantity);
            }
            writable(map, refusals, address, count)?;
            Ok(Permitted::WriteSeveral { address, registers })
        }
        // A profile that lists another function needs a panel that has it.
        _ => Err(ExceptionCode::ILLEGAL_FUNCTION),
    }
}

fn writable(map: &impl Map, refusals: Refusals, address: u16, count: usize) -> Result<(), ExceptionCode> {
    let mut unknown = false;
    for register in usize::from(address)..usize::from(address) + count {
        let register = u16::try_from(register).map_err(|_| ExceptionCode::ILLEGAL_DATA_ADDRESS)?;
        if map.is_writable(register) {
            continue;
        }
        // One protected register speaks for the whole write, wherever it stands.
        if map.is_readable(register, 1) {
            return Err(refusals.protected);
        }
        unknown = true;
    }
    match unknown {
        true => Err(ExceptionCode::ILLEGAL_DATA_ADDRESS),
        false => Ok(()),
    }
}
