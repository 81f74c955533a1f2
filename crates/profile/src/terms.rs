//! The closed word lists of the profile format, spelled alike in files, in JSON and in code.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A word that is not in its list.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is not one of: {expected}")]
pub struct UnknownWord {
    /// What was found.
    pub found: String,
    /// The words that exist, joined by commas.
    pub expected: String,
}

/// Declares an enum whose variants have one spelling each.
macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $word:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum $name {
            $($(#[$variant_doc])* #[serde(rename = $word)] $variant,)+
        }

        impl $name {
            /// Every variant, in the order of declaration.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The word as files and JSON spell it.
            pub const fn as_str(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(self.as_str())
            }
        }

        impl FromStr for $name {
            type Err = UnknownWord;

            fn from_str(text: &str) -> Result<Self, UnknownWord> {
                match text {
                    $($word => Ok(Self::$variant),)+
                    _ => Err(UnknownWord {
                        found: text.to_owned(),
                        expected: [$($word),+].join(", "),
                    }),
                }
            }
        }
    };
}

words! {
    /// What a controller controls.
    Kind {
        /// A genset, with or without a mains switch.
        Genset = "genset",
        /// A transfer switch between sources.
        TransferSwitch = "transfer_switch",
        /// An engine-driven compressor.
        Compressor = "compressor",
    }
}

words! {
    /// A transport that the manual gives.
    Transport {
        /// Serial line, RTU framing.
        Rtu = "rtu",
        /// Modbus TCP.
        Tcp = "tcp",
    }
}

words! {
    /// What the device does with a read that is longer than it allows.
    OverRead {
        /// Answers the first `max_read` registers.
        Truncate = "truncate",
        /// Answers an exception, or not at all.
        Refuse = "refuse",
    }
}

words! {
    /// Which register of a 32-bit number comes first.
    WordOrder {
        /// The least significant register first.
        LowFirst = "low-first",
        /// The most significant register first.
        HighFirst = "high-first",
    }
}

words! {
    /// Parity of a serial line.
    Parity {
        /// No parity bit.
        None = "none",
        /// Even parity.
        Even = "even",
        /// Odd parity.
        Odd = "odd",
    }
}

words! {
    /// What may be done with a point's registers.
    Access {
        /// Read only.
        Read = "r",
        /// Write only: a read answers an exception.
        Write = "w",
        /// Read and write.
        ReadWrite = "rw",
    }
}

impl Access {
    /// Whether reading it makes sense.
    pub const fn is_readable(self) -> bool {
        matches!(self, Self::Read | Self::ReadWrite)
    }

    /// Whether writing it makes sense.
    pub const fn is_writable(self) -> bool {
        matches!(self, Self::Write | Self::ReadWrite)
    }
}

words! {
    /// How the registers of a point are to be read.
    DataType {
        /// Unsigned low byte of one register, or the field that `mask` names.
        U8 = "u8",
        /// Two's complement low byte of one register.
        I8 = "i8",
        /// Unsigned register, or the field that `mask` names.
        U16 = "u16",
        /// Two's complement register.
        I16 = "i16",
        /// Unsigned, two registers.
        U32 = "u32",
        /// Two's complement, two registers.
        I32 = "i32",
        /// One register: bit 15 is the sign, the others are the magnitude.
        Sm16 = "sm16",
        /// Two registers: the highest byte is the sign (any non-zero is negative), the lower 24 bits are the magnitude.
        Sm24 = "sm24",
        /// Single bits, the lowest of the first register first.
        Bits = "bits",
        /// Fields of two bits, the lowest of the first register first.
        Bits2 = "bits2",
        /// A code with a meaning.
        Choice = "choice",
        /// Low byte as a share: 0 is 0 %, 255 is 100 %.
        Fraction8 = "fraction8",
        /// Register as a share: 0 is 0 %, 65535 is 100 %.
        Fraction16 = "fraction16",
        /// Signed 16-bit samples of a waveform.
        Trace = "trace",
        /// A one-bit picture.
        Image = "image",
        /// Opaque bytes, the high byte of a register first.
        Bytes = "bytes",
    }
}

impl DataType {
    /// Whether the value is one number.
    pub const fn is_numeric(self) -> bool {
        !matches!(self, Self::Bits | Self::Bits2 | Self::Choice | Self::Trace | Self::Image | Self::Bytes)
    }

    /// Whether the type carries its own scale.
    pub const fn is_fraction(self) -> bool {
        matches!(self, Self::Fraction8 | Self::Fraction16)
    }

    /// Whether the device delivers it in parts and only the whole means something.
    pub const fn is_bulk(self) -> bool {
        matches!(self, Self::Trace | Self::Image)
    }
}

words! {
    /// How serious a bit is.
    Class {
        /// The engine is stopped at once.
        Shutdown = "shutdown",
        /// The load is taken off, then the engine is cooled and stopped.
        LoadDump = "load_dump",
        /// A breaker or transfer fault that latches.
        Trip = "trip",
        /// Somebody should look; nothing is stopped.
        Warning = "warning",
        /// Worth showing, no fault.
        Indication = "indication",
        /// Plain state.
        Status = "status",
    }
}

impl Class {
    /// Whether a set bit of this class is an alarm.
    pub const fn is_alarm(self) -> bool {
        !matches!(self, Self::Status)
    }
}

words! {
    /// How often a point deserves to be read.
    Rate {
        /// Electrical values and states.
        Fast = "fast",
        /// Counters, temperatures, service hours.
        Slow = "slow",
        /// Identity and versions.
        Once = "once",
        /// Only while somebody looks.
        OnDemand = "on_demand",
    }
}

words! {
    /// What a command may do to people and plant.
    Risk {
        /// Nothing moves.
        None = "none",
        /// The engine may start, now or later, by itself.
        MayStartEngine = "may_start_engine",
        /// The load may lose its supply.
        StopsSupply = "stops_supply",
        /// The controller restarts.
        ResetsController = "resets_controller",
    }
}

words! {
    /// Who may give a command.
    Role {
        /// Anybody who operates the site.
        Operator = "operator",
        /// Only who administers it.
        Admin = "admin",
    }
}

words! {
    /// How a person confirms a command.
    Confirm {
        /// The device's name is typed.
        Typed = "typed",
    }
}

words! {
    /// What a device without registers to show for it does.
    DeviceProof {
        /// It stops answering, then answers again.
        SilentThenBack = "silent_then_back",
    }
}

words! {
    /// One number of a date and time.
    TimePart {
        /// Year, two digits.
        Year = "year",
        /// Month, 1 to 12.
        Month = "month",
        /// Day of the month.
        Day = "day",
        /// Hour of the day.
        Hour = "hour",
        /// Minute of the hour.
        Minute = "minute",
        /// Second of the minute.
        Second = "second",
    }
}

impl TimePart {
    /// The least and the greatest that it can be.
    pub const fn range(self) -> (u16, u16) {
        match self {
            Self::Year => (0, 99),
            Self::Month => (1, 12),
            Self::Day => (1, 31),
            Self::Hour => (0, 23),
            Self::Minute | Self::Second => (0, 59),
        }
    }
}

words! {
    /// An argument that is neither a choice nor a number.
    ArgKind {
        /// A local date and time; it runs on while the command does.
        Time = "time",
    }
}

words! {
    /// What a signal of the vocabulary carries.
    SignalKind {
        /// A number in the signal's unit.
        Number = "number",
        /// Yes or no.
        Flag = "flag",
        /// One word of a list.
        Words = "words",
        /// Date and time, joined from several points.
        Clock = "clock",
    }
}

words! {
    /// How far a value can be trusted.
    Quality {
        /// As the device gave it.
        Good = "good",
        /// Older than its poll allows.
        Stale = "stale",
        /// The device says that it has no value.
        Invalid = "invalid",
        /// The device answered with an exception, too little, or not at all.
        Bad = "bad",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_round_trip() {
        for class in Class::ALL {
            assert_eq!(class.as_str().parse::<Class>().as_ref(), Ok(class));
            assert_eq!(serde_json::to_value(class).unwrap(), class.as_str());
        }
        let error = "sometimes".parse::<Rate>().unwrap_err();
        assert_eq!(error.to_string(), "`sometimes` is not one of: fast, slow, once, on_demand");
    }
}
