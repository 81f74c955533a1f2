//! Protocol data units: what is asked and answered, without addressing and check sums.
//!
//! Functions 1 to 6, 15 and 16 are taken apart; every other function is carried as bytes. Decoding judges structure
//! only (lengths and byte counts that must agree), so that a server sees a quantity of 0 or 2000 and can refuse it
//! the way its device does; encoding refuses what the standard forbids.

mod exception;
mod expected;
mod request;
mod response;
mod values;

pub use exception::ExceptionCode;
pub(crate) use expected::Expected;
pub use request::Request;
pub use response::Response;
pub use values::{Bits, BitsIter, Registers, RegistersIter};

/// Most bytes of a PDU, function code included (Modbus Application Protocol V1.1b3, 4.1).
pub const MAX_PDU: usize = 253;

/// Most coils or discrete inputs one read asks for (V1.1b3, 6.1 and 6.2).
pub const MAX_READ_BITS: usize = 2000;
/// Most registers one read asks for (V1.1b3, 6.3 and 6.4).
pub const MAX_READ_REGISTERS: usize = 125;
/// Most coils one write carries (V1.1b3, 6.11).
pub const MAX_WRITE_BITS: usize = 1968;
/// Most registers one write carries (V1.1b3, 6.12).
pub const MAX_WRITE_REGISTERS: usize = 123;

/// Set in the function code of an exception response (V1.1b3, 7).
pub const EXCEPTION_BIT: u8 = 0x80;

/// The function codes that this crate takes apart (V1.1b3, 5.1).
pub mod function {
    /// Read Coils (V1.1b3, 6.1).
    pub const READ_COILS: u8 = 0x01;
    /// Read Discrete Inputs (V1.1b3, 6.2).
    pub const READ_DISCRETE_INPUTS: u8 = 0x02;
    /// Read Holding Registers (V1.1b3, 6.3).
    pub const READ_HOLDING_REGISTERS: u8 = 0x03;
    /// Read Input Registers (V1.1b3, 6.4).
    pub const READ_INPUT_REGISTERS: u8 = 0x04;
    /// Write Single Coil (V1.1b3, 6.5).
    pub const WRITE_SINGLE_COIL: u8 = 0x05;
    /// Write Single Register (V1.1b3, 6.6).
    pub const WRITE_SINGLE_REGISTER: u8 = 0x06;
    /// Write Multiple Coils (V1.1b3, 6.11).
    pub const WRITE_MULTIPLE_COILS: u8 = 0x0F;
    /// Write Multiple Registers (V1.1b3, 6.12).
    pub const WRITE_MULTIPLE_REGISTERS: u8 = 0x10;
}

/// The big-endian word at `at`; 0 where the bytes end, which callers exclude by checking lengths first.
fn word(bytes: &[u8], at: usize) -> u16 {
    match bytes.get(at..at + 2) {
        Some(&[high, low]) => u16::from_be_bytes([high, low]),
        _ => 0,
    }
}
