//! What was heard instead of an answer, for a first guess at what is wrong on the line.

use std::fmt;

use busbar_modbus::Counters;

/// What came on the wire while an answer was waited for in vain. Printed, it is the remedy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Heard {
    /// Nothing at all.
    Nothing {
        /// Whether there is a serial line, our own or behind a converter.
        serial: bool,
    },
    /// Bytes that make no frame.
    Noise {
        /// How many.
        bytes: u32,
    },
    /// A frame whose check sum was wrong.
    BadCrc,
    /// An answer of another unit.
    OtherUnit,
    /// An answer of the unit to something else.
    Misfit,
    /// Our own request and nothing behind it: the adapter or converter echoes.
    Echo,
}

/// Bytes of the requests whose echoes the client finds, those of functions 5 and 6.
const ECHO_OF_WRITE: u32 = 8;

/// Listens during one exchange. Small, for every wire has one: counters are kept cut, and compared only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ear {
    other_unit: u32,
    misfit: u32,
    bad_crc: u32,
    /// Bytes that came, echoes excepted.
    bytes: u32,
    echoes: u32,
    echo: bool,
}

impl Ear {
    /// An exchange begins.
    pub(crate) fn new(counters: &Counters) -> Self {
        let [other_unit, misfit, bad_crc, echoes] = cut(counters);
        Self { other_unit, misfit, bad_crc, echoes, bytes: 0, echo: false }
    }

    /// RTU: so many bytes came. If they end an echo, so many bytes in all were that.
    pub(crate) fn hears(&mut self, bytes: usize, echo: Option<usize>) {
        let cut = |bytes| u32::try_from(bytes).unwrap_or(u32::MAX);
        self.bytes = self.bytes.saturating_add(cut(bytes)).saturating_sub(echo.map_or(0, cut));
        self.echo |= echo.is_some();
    }

    /// What was heard until now, if it was no answer.
    pub(crate) fn judge(&self, serial: bool, counters: &Counters) -> Heard {
        let [other_unit, misfit, bad_crc, echoes] = cut(counters);
        // Some echoes only the client finds.
        let echo = self.echo || echoes != self.echoes;
        let bytes = match echoes == self.echoes {
            true => self.bytes,
            false => self.bytes.saturating_sub(ECHO_OF_WRITE),
        };
        if other_unit != self.other_unit {
            Heard::OtherUnit
        } else if misfit != self.misfit {
            Heard::Misfit
        } else if bad_crc != self.bad_crc {
            Heard::BadCrc
        } else if bytes > 0 {
            Heard::Noise { bytes }
        } else if echo {
            Heard::Echo
        } else {
            Heard::Nothing { serial }
        }
    }
}

fn cut(counters: &Counters) -> [u32; 4] {
    let misfit = counters.wrong_function + counters.wrong_length + counters.wrong_echo;
    // Only whether they have grown is asked.
    [counters.wrong_unit, misfit, counters.crc_errors, counters.echoes]
        .map(|counter| (counter & u64::from(u32::MAX)) as u32)
}

impl fmt::Display for Heard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nothing { serial: false } => f.write_str("check the unit id and that the device is on"),
            Self::Nothing { serial: true } => f.write_str(
                "nothing came back; check the unit id, that the device is on, that A and B are not swapped, and the baud rate",
            ),
            Self::Noise { bytes } => write!(
                f,
                "{bytes} bytes came that make no frame; check baud rate and parity, the terminators, and that no two devices have one unit id"
            ),
            Self::BadCrc => f.write_str(
                "a frame came with a wrong check sum; check baud rate and parity, the terminators, and that no two devices have one unit id",
            ),
            Self::OtherUnit => f.write_str(
                "another unit answered; check the unit id, and that no other client asks on this line",
            ),
            Self::Misfit => f.write_str(
                "it answered something else; check that no two devices have this unit id, and that no other client asks on this line",
            ),
            Self::Echo => f.write_str(
                "only our own request came back, so the adapter echoes and no device answers; check the unit id, that the device is on, and that A and B are not swapped",
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counters(change: impl Fn(&mut Counters)) -> Counters {
        let mut counters = Counters::default();
        change(&mut counters);
        counters
    }

    #[test]
    fn the_most_telling_comes_first() {
        let before = counters(|counters| (counters.crc_errors, counters.late) = (7, 1));
        let after = |change: fn(&mut Counters)| {
            let mut counters = before;
            change(&mut counters);
            counters
        };
        for (after, bytes, echo, heard) in [
            (before, 0, None, Heard::Nothing { serial: true }),
            (before, 8, Some(8), Heard::Echo),
            (before, 11, Some(8), Heard::Noise { bytes: 3 }),
            (after(|counters| counters.late = 2), 7, None, Heard::Noise { bytes: 7 }),
            (after(|counters| counters.echoes = 1), 8, None, Heard::Echo),
            (after(|counters| counters.echoes = 1), 9, None, Heard::Noise { bytes: 1 }),
            (after(|counters| counters.crc_errors = 8), 7, None, Heard::BadCrc),
            (after(|counters| counters.wrong_function = 1), 5, None, Heard::Misfit),
            (after(|counters| counters.wrong_length = 1), 7, None, Heard::Misfit),
            (
                after(|counters| (counters.wrong_unit, counters.crc_errors) = (1, 9)),
                9,
                None,
                Heard::OtherUnit,
            ),
        ] {
            let mut ear = Ear::new(&before);
            ear.hears(bytes, echo);
            assert_eq!(ear.judge(true, &after), heard);
        }
    }

    #[test]
    fn an_echo_in_pieces_is_no_noise() {
        let mut ear = Ear::new(&Counters::default());
        ear.hears(5, None);
        assert_eq!(ear.judge(true, &Counters::default()), Heard::Noise { bytes: 5 });
        ear.hears(3, Some(8));
        assert_eq!(ear.judge(true, &Counters::default()), Heard::Echo);
    }

    #[test]
    fn each_has_a_remedy() {
        for heard in [
            Heard::Nothing { serial: false },
            Heard::Nothing { serial: true },
            Heard::Noise { bytes: 3 },
            Heard::BadCrc,
            Heard::OtherUnit,
            Heard::Misfit,
            Heard::Echo,
        ] {
            let sentence = heard.to_string();
            assert!(sentence.contains("check ") && !sentence.contains("docs/"), "{sentence}");
        }
    }
}
