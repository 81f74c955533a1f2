//! Why an imitation does not start. Every message is one sentence that says what to do.

use std::io;

use busbar_link::{Endpoint, SerialError};
use busbar_profile::text::shown;
use busbar_profile::{Number, SerialSettings};

use crate::levers::LeverError;
use crate::server::SpeedError;
use crate::settings::SettingError;

/// An imitation was not started; nothing is left running.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StartError {
    /// The caller named a profile that does not exist.
    #[error("there is no profile `{key}`; `busbar profile list` shows them")]
    UnknownProfile {
        /// What was asked for.
        key: String,
    },
    /// The profile exists, its behaviour is not built in.
    #[error("`{key}` cannot be imitated; these can: {}", .imitated.join(", "))]
    NotImitated {
        /// What was asked for.
        key: String,
        /// What can be imitated.
        imitated: Vec<&'static str>,
    },
    /// The caller named a model that the profile does not have.
    #[error("`{model}` is not a model of this controller; its models are {}", .allowed.join(", "))]
    UnknownModel {
        /// What was asked for.
        model: String,
        /// Models of the profile.
        allowed: Vec<String>,
    },
    /// The unit id is outside what the controller can be set to.
    #[error("unit {unit} is not possible, this controller can be set to {min} to {max}")]
    Unit {
        /// What was asked for.
        unit: u8,
        /// Lowest unit id.
        min: u8,
        /// Highest unit id.
        max: u8,
    },
    /// The simulated clock cannot run that fast.
    #[error(transparent)]
    Speed(#[from] SpeedError),
    /// A value was pinned that its point cannot have.
    #[error(transparent)]
    Pin(#[from] PinError),
    /// The controller was to be set to something that it cannot be set to.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A lever was to stand where it cannot.
    #[error(transparent)]
    Lever(#[from] LeverError),
    /// The scenario happens to another controller.
    #[error(
        "{place}: this scenario is for {controller}, not for {key}; imitate {controller}, or choose another one"
    )]
    OtherController {
        /// Where the scenario names its controller: file, line and column.
        place: String,
        /// The profile that it is for.
        controller: &'static str,
        /// What was to be imitated.
        key: String,
    },
    /// Nothing was given to imitate.
    #[error("there is no controller to imitate; name at least one")]
    NoController,
    /// No endpoint was given to listen on.
    #[error("an imitated controller needs at least one endpoint to listen on, such as tcp://127.0.0.1:1502")]
    NoEndpoint,
    /// The endpoint is of a kind that imitations do not listen on.
    #[error("cannot listen on {endpoint}: imitated controllers speak tcp://, rtu:// and rtu+tcp://")]
    Transport {
        /// The endpoint.
        endpoint: Endpoint,
    },
    /// Two controllers would answer to one unit id.
    #[error("unit {unit} is there twice on {endpoint}; give each controller of a wire a unit id of its own")]
    SameUnit {
        /// The unit id.
        unit: u8,
        /// The endpoint.
        endpoint: Endpoint,
    },
    /// The controller cannot be set to such a line.
    #[error("cannot listen on {endpoint}: {key} has no such line; choose {}", offered(.has))]
    LineSettings {
        /// The endpoint.
        endpoint: Endpoint,
        /// The controller's profile.
        key: String,
        /// What it can be set to.
        has: Box<SerialSettings>,
    },
    /// The serial device cannot be used.
    #[error("cannot listen on {endpoint}: {problem}")]
    SerialDevice {
        /// The endpoint.
        endpoint: Endpoint,
        /// Why, and what to do.
        problem: SerialError,
    },
    /// The system has no pseudo-terminals that we know how to make.
    #[error("cannot listen on {endpoint}: pseudo-terminals are made on Linux only; use rtu+tcp:// instead")]
    NoPseudoTerminal {
        /// The endpoint.
        endpoint: Endpoint,
    },
    /// Nobody knows the host's address.
    #[error(
        "cannot listen on {endpoint}: the host has no address; use 127.0.0.1, or 0.0.0.0 for every network"
    )]
    UnknownHost {
        /// The endpoint.
        endpoint: Endpoint,
    },
    /// The system refused the port.
    #[error("cannot listen on {endpoint}: {}", listen_reason(*.kind))]
    Listen {
        /// The endpoint.
        endpoint: Endpoint,
        /// What the system said.
        kind: io::ErrorKind,
    },
}

/// A pinned value (`--set POINT=VALUE`) that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.sentence())]
#[non_exhaustive]
pub struct PinError {
    /// The point as named.
    pub point: String,
    /// The value as given.
    pub value: String,
    /// What is wrong.
    pub problem: PinProblem,
}

/// What is wrong with a pinned value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PinProblem {
    /// The profile has no such point.
    #[error("there is no such point; {}", meant(.nearest.as_ref()))]
    UnknownPoint {
        /// What was perhaps meant: a point, or a setting.
        nearest: Option<String>,
    },
    /// The point can only be written.
    #[error("the point can only be written by a client, never read")]
    WriteOnly,
    /// Not a number in range.
    #[error("choose a number from {min} to {max}{}", spaced(.unit.as_deref()))]
    Range {
        /// Least.
        min: Number,
        /// Greatest.
        max: Number,
        /// Unit of both.
        unit: Option<String>,
    },
    /// Not one of the point's labels, nor a code that fits.
    #[error("choose one of {}, or a code that fits its register", .allowed.join(", "))]
    Choice {
        /// Labels.
        allowed: Vec<String>,
    },
    /// Not a bit of the point.
    #[error("`{}` is not one of its bits; give ids separated by commas, or `none`: {}", shown(.word), .allowed.join(", "))]
    Bit {
        /// The word that is not.
        word: String,
        /// Ids of the bits.
        allowed: Vec<String>,
    },
    /// Not the point's two-bit codes.
    #[error("give {count} codes from 0 to 3, separated by commas")]
    Codes {
        /// How many.
        count: u16,
    },
    /// Not the point's samples.
    #[error("give {count} samples from -32768 to 32767, separated by commas")]
    Samples {
        /// How many.
        count: u16,
    },
    /// Not the point's bytes.
    #[error("give {bytes} bytes in hexadecimal, without spaces")]
    Hex {
        /// How many.
        bytes: u16,
    },
    /// The point cannot say that its sensor is absent.
    #[error("the controller has no way to say that this value is absent")]
    NeverAbsent,
    /// Anything else the profile refuses.
    #[error("{reason}")]
    NotEncodable {
        /// Why.
        reason: String,
    },
}

impl PinError {
    fn sentence(&self) -> String {
        let Self { point, value, problem } = self;
        match problem {
            PinProblem::UnknownPoint { nearest } => {
                format!("the controller has no point `{}`; {}", shown(point), meant(nearest.as_ref()))
            }
            _ => format!("cannot set {} to `{}`: {problem}", shown(point), shown(value)),
        }
    }
}

fn meant(nearest: Option<&String>) -> String {
    match nearest {
        Some(nearest) => format!("did you mean `{nearest}`?"),
        None => "`busbar profile show` lists them".to_owned(),
    }
}

pub(crate) fn listen_reason(kind: io::ErrorKind) -> String {
    match kind {
        io::ErrorKind::AddrInUse => "the port is taken; stop the other program or choose another port".into(),
        io::ErrorKind::PermissionDenied => "this user may not use that port; choose one above 1023".into(),
        io::ErrorKind::AddrNotAvailable => "this machine does not have that address".into(),
        other => other.to_string(),
    }
}

fn offered(has: &SerialSettings) -> String {
    format!("baud {}, parity {}, stop {}", either(&has.baud), either(&has.parity), either(&has.stop))
}

/// `a, b or c`.
fn either(choices: &[impl ToString]) -> String {
    let mut words: Vec<_> = choices.iter().map(ToString::to_string).collect();
    match words.pop() {
        Some(last) if !words.is_empty() => format!("{} or {last}", words.join(", ")),
        last => last.unwrap_or_default(),
    }
}

fn spaced(unit: Option<&str>) -> String {
    unit.map(|unit| format!(" {unit}")).unwrap_or_default()
}
