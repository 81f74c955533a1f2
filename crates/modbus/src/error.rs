//! What can be wrong with a PDU, a frame, a connection or a call, and whose fault it is.

use std::time::Duration;

use thiserror::Error;

/// The bytes are no Modbus PDU. The fault is the peer's, or the wire's where no check sum guards it.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeError {
    /// There is no function code.
    #[error("the PDU is empty")]
    Empty,
    /// A PDU has at most 253 bytes (Modbus Application Protocol V1.1b3, 4.1).
    #[error("the PDU has {found} bytes; Modbus allows 253")]
    TooLong {
        /// Bytes that came.
        found: usize,
    },
    /// Function 0 is not valid, and a request has no function above 127 (V1.1b3, 4.1).
    #[error("function code {found:02X}h is not valid here")]
    Function {
        /// The first byte of the PDU.
        found: u8,
    },
    /// The PDU is shorter or longer than its function, or its own byte count, says.
    #[error("function {function:02X}h: the PDU has {found} bytes and should have {expected}")]
    Length {
        /// The function code as it came.
        function: u8,
        /// Bytes the PDU should have had.
        expected: usize,
        /// Bytes that came.
        found: usize,
    },
    /// The byte count does not fit the quantity beside it, or halves a register.
    #[error("function {function:02X}h: the byte count is {found} and should be {expected}")]
    ByteCount {
        /// The function code as it came.
        function: u8,
        /// The byte count that fits the quantity; for an odd number of register bytes, the next even one.
        expected: usize,
        /// The byte count that came.
        found: usize,
    },
}

/// The request or response cannot be put into a legal PDU. The fault is the caller's.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// The number of coils or registers is outside what the function allows (V1.1b3, 6.1 to 6.12).
    #[error("function {function:02X}h takes {min} to {max} items at a time, not {found}")]
    Count {
        /// The function code.
        function: u8,
        /// Items asked for or given.
        found: usize,
        /// Fewest the function allows.
        min: usize,
        /// Most the function allows.
        max: usize,
    },
    /// Function codes are 1 to 127.
    #[error("{found} is no function code; 1 to 127 are")]
    Function {
        /// The function code given.
        found: u8,
    },
    /// The data of a function carried as bytes exceeds a PDU.
    #[error("the PDU would have {found} bytes; Modbus allows 253")]
    TooLong {
        /// Bytes the PDU would have had.
        found: usize,
    },
}

/// A well-formed response that does not answer the request. The fault is the device's, or it is a late answer.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Mismatch {
    /// Another function was answered.
    #[error("function {found:02X}h was answered, {expected:02X}h was asked")]
    Function {
        /// The function asked.
        expected: u8,
        /// The function answered, without the exception bit.
        found: u8,
    },
    /// More or less data than asked.
    #[error("{found} bytes of data came, {expected} were asked for")]
    Length {
        /// Data bytes of a full answer.
        expected: usize,
        /// Data bytes that came.
        found: usize,
    },
    /// A write was confirmed with another address, value or quantity.
    #[error("the confirmation carries {found:02X?}, the request {expected:02X?}")]
    Echo {
        /// The four bytes after the function code that the answer had to repeat.
        expected: [u8; 4],
        /// The four bytes that came.
        found: [u8; 4],
    },
}

/// One whole buffer that is no frame. The fault is the wire's or the peer's.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// Fewer bytes than the smallest frame: 4 in RTU, 8 over TCP.
    #[error("{found} bytes are no frame; the smallest has {min}")]
    TooShort {
        /// Bytes that came.
        found: usize,
        /// Bytes of the smallest frame.
        min: usize,
    },
    /// More bytes than the largest frame: 256 in RTU.
    #[error("{found} bytes are no frame; the largest has {max}")]
    TooLong {
        /// Bytes that came.
        found: usize,
        /// Bytes of the largest frame.
        max: usize,
    },
    /// The check sum is wrong (Modbus over Serial Line V1.02, 2.5.1.2).
    #[error("the frame carries CRC {found:04X}h, its bytes give {computed:04X}h")]
    Crc {
        /// The check sum in the frame; its low byte is the one that stands first on the wire.
        found: u16,
        /// The check sum of the bytes before it.
        computed: u16,
    },
    /// The protocol identifier of the MBAP header is not 0 (Modbus Messaging on TCP/IP V1.0b, 3.1.3).
    #[error("the protocol identifier is {found:04X}h, Modbus has 0000h")]
    Protocol {
        /// The identifier that came.
        found: u16,
    },
    /// The length field of the MBAP header is outside 2 to 254, or is not the number of bytes that follow it.
    #[error("the MBAP header announces {declared} bytes, {found} follow")]
    Length {
        /// The length field: bytes that follow it, unit id included.
        declared: u16,
        /// Bytes that do follow it.
        found: usize,
    },
}

/// The byte stream can no longer be cut into frames: close the connection. The fault is the peer's.
///
/// TCP loses and reorders nothing, so a stream that is out of step stays out of step: there is no mark in it at
/// which to begin anew. RTU has one, the check sum, and is never broken.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// An MBAP header announces a length outside 2 to 254, so nobody knows where the next frame begins.
    #[error("an MBAP header announces {found} bytes, 2 to 254 are possible; the connection is out of step")]
    Length {
        /// The length field that came.
        found: u16,
    },
}

/// A transaction that was not started; nothing may be sent. The fault is the caller's unless said otherwise.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum StartError {
    /// The request is not legal.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The transaction before is still waiting for its answer; a client has one at a time.
    #[error("the transaction before has not ended")]
    Busy,
    /// A serial request to unit 0 reaches every device on the line and nobody answers: this client does not broadcast.
    #[error("unit 0 addresses every device on a serial line")]
    Broadcast,
    /// RTU after a time-out: a late answer may still come, and nothing in it would tell it from the next one.
    #[error("the line is being drained after a time-out until {until:?}")]
    Draining {
        /// The earliest instant at which to start; bytes that come meanwhile move it.
        until: Duration,
    },
    /// The connection is out of step by the peer's fault; open a new one and call `reset`.
    #[error(transparent)]
    Broken(#[from] Fault),
}
