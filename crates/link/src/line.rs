//! What a line is like: how frames are set apart on it, and how long its characters take.

use std::time::Duration;

use busbar_modbus::{Framing, rtu};

use crate::endpoint::Serial;

/// The properties of a line that decide about time. Where the speed is not known, as behind a converter, its times are
/// zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Line {
    /// How frames are set apart.
    pub(crate) framing: Framing,
    /// How long one character occupies the line.
    pub(crate) character: Duration,
    /// How long nothing may be heard before a request leaves.
    pub(crate) silence: Duration,
}

impl Line {
    /// Modbus TCP: the network keeps frames apart.
    pub(crate) fn tcp() -> Self {
        Self { framing: Framing::Tcp, character: Duration::ZERO, silence: Duration::ZERO }
    }

    /// RTU on a serial line of our own.
    pub(crate) fn rtu(serial: &Serial) -> Self {
        let bits = serial.bits_per_character();
        let nanoseconds = (u64::from(bits) * 1_000_000_000).div_ceil(u64::from(serial.baud.max(1)));
        Self {
            framing: Framing::Rtu,
            character: Duration::from_nanos(nanoseconds),
            silence: rtu::silence(serial.baud, bits),
        }
    }

    /// RTU frames through TCP: the converter keeps the silences of its line, of which nothing is known here.
    pub(crate) fn tunnelled() -> Self {
        Self { framing: Framing::Rtu, character: Duration::ZERO, silence: Duration::ZERO }
    }

    /// How long so many bytes occupy the line.
    pub(crate) fn time(&self, bytes: u64) -> Duration {
        self.character.saturating_mul(u32::try_from(bytes).unwrap_or(u32::MAX))
    }

    /// Bytes of a whole frame around a PDU.
    pub(crate) fn frame(&self, pdu: usize) -> u64 {
        let around = match self.framing {
            Framing::Tcp => 7,
            Framing::Rtu => 3,
        };
        (pdu + around) as u64
    }

    pub(crate) fn is_rtu(&self) -> bool {
        self.framing == Framing::Rtu
    }

    /// Whether it is a serial line of our own. There is no connection behind it that could be dead.
    pub(crate) fn is_serial(&self) -> bool {
        !self.character.is_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endpoint::Endpoint;

    #[test]
    fn characters_take_their_bits() {
        for (settings, character, silence) in [
            ("baud=9600&parity=none&stop=1", 1_041_667, 3_645_834),
            ("baud=9600&parity=even&stop=1", 1_145_834, 4_010_417),
            ("baud=2400&parity=none&stop=2", 4_583_334, 16_041_667),
            ("baud=38400&parity=none&stop=1", 260_417, 1_750_000),
        ] {
            let Ok(Endpoint::Rtu { serial, .. }) = format!("rtu:///dev/ttyS0?{settings}").parse() else {
                panic!("{settings}");
            };
            let line = Line::rtu(&serial);
            assert_eq!(line.character, Duration::from_nanos(character), "{settings}");
            assert_eq!(line.silence, Duration::from_nanos(silence), "{settings}");
            assert!(line.is_serial() && line.is_rtu());
        }
        // A read of 16 registers and its answer.
        let line = Line::rtu(&Serial::default());
        assert_eq!((line.frame(5), line.frame(34)), (8, 37));
        assert_eq!(line.time(45), Duration::from_nanos(45 * 1_041_667));
        assert!(!Line::tunnelled().is_serial() && Line::tunnelled().is_rtu());
        assert_eq!(Line::tcp().time(1_000_000), Duration::ZERO);
    }
}
