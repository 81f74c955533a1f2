//! Exception codes: the raw byte a device refused with, and the standard's name for it.

use std::fmt;

/// The code of an exception response (Modbus Application Protocol V1.1b3, 7), kept as it came.
///
/// Devices use codes of their own, and standard codes with another meaning (10 is "write protection" on Datakom
/// controllers): the name here is the standard's, the device's profile knows better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExceptionCode(pub u8);

impl ExceptionCode {
    /// The device does not have this function.
    pub const ILLEGAL_FUNCTION: Self = Self(0x01);
    /// The device does not have this address, or not that many from there.
    pub const ILLEGAL_DATA_ADDRESS: Self = Self(0x02);
    /// The structure of the request is wrong; not that a register refuses a value.
    pub const ILLEGAL_DATA_VALUE: Self = Self(0x03);
    /// The device failed while it did what was asked.
    pub const SERVER_DEVICE_FAILURE: Self = Self(0x04);
    /// Accepted, and will take long.
    pub const ACKNOWLEDGE: Self = Self(0x05);
    /// Engaged in something long; ask again later.
    pub const SERVER_DEVICE_BUSY: Self = Self(0x06);
    /// Its extended memory failed a parity check.
    pub const MEMORY_PARITY_ERROR: Self = Self(0x08);
    /// The gateway has no way to the target.
    pub const GATEWAY_PATH_UNAVAILABLE: Self = Self(0x0A);
    /// The gateway's target did not answer.
    pub const GATEWAY_TARGET_FAILED_TO_RESPOND: Self = Self(0x0B);

    /// The standard's name in lower case; `unknown exception` where V1.1b3 has none.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ILLEGAL_FUNCTION => "illegal function",
            Self::ILLEGAL_DATA_ADDRESS => "illegal data address",
            Self::ILLEGAL_DATA_VALUE => "illegal data value",
            Self::SERVER_DEVICE_FAILURE => "server device failure",
            Self::ACKNOWLEDGE => "acknowledge",
            Self::SERVER_DEVICE_BUSY => "server device busy",
            Self::MEMORY_PARITY_ERROR => "memory parity error",
            Self::GATEWAY_PATH_UNAVAILABLE => "gateway path unavailable",
            Self::GATEWAY_TARGET_FAILED_TO_RESPOND => "gateway target device failed to respond",
            _ => "unknown exception",
        }
    }
}

impl fmt::Display for ExceptionCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.0, self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_what_the_standard_names() {
        let named: Vec<u8> =
            (0..=u8::MAX).filter(|code| ExceptionCode(*code).name() != "unknown exception").collect();
        assert_eq!(named, [1, 2, 3, 4, 5, 6, 8, 10, 11]);
        assert_eq!(ExceptionCode(2).to_string(), "2 (illegal data address)");
        assert_eq!(ExceptionCode(0x63).to_string(), "99 (unknown exception)");
    }
}
