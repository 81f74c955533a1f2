//! Remote commands as data: what must hold, the writes, each sent once, and what proves their effect.

mod arguments;
mod report;
mod run;
mod sight;
mod words;

use std::ops::RangeInclusive;

use crate::terms::{Confirm, DeviceProof, Risk, Role, TimePart};

pub use arguments::{ArgError, ArgValue, Arguments};
pub use report::{Observed, ObservedShow, Report, Seen, SeenShow, Sign, Verdict};
pub use run::{Frame, Next, ReadFailure, Run, WriteOutcome};

/// A remote command: one write, or a procedure of several.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Command {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// What it may do.
    pub risk: Risk,
    /// Who may give it.
    pub role: Role,
    /// How it is to be confirmed, beyond the ordinary question.
    pub confirm: Option<Confirm>,
    /// Page of the manual.
    pub page: Option<u16>,
    /// Its arguments.
    pub args: Vec<Arg>,
    /// What must hold before it is sent; all of it, or it is refused.
    pub require: Vec<Condition>,
    /// If it is not empty and all of it holds, the state is there already and nothing is sent.
    pub already: Vec<Condition>,
    /// What is waited for before the first write.
    pub hold: Option<Hold>,
    /// The writes in their order, each sent once; never empty.
    pub steps: Vec<Step>,
    /// How its effect shows, after the last write.
    pub proof: Proof,
}

impl Command {
    /// The argument of that name.
    pub fn arg(&self, name: &str) -> Option<&Arg> {
        self.args.iter().find(|arg| arg.name == name)
    }

    /// Whether it is several writes with what lies between them.
    pub fn is_procedure(&self) -> bool {
        self.steps.len() > 1
    }
}

/// One write of a command, and what belongs to it alone.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Step {
    /// What must hold, also while it is waited for `hold`; otherwise the command ends here.
    pub require: Vec<Condition>,
    /// If it is not empty and all of it holds, the step is left out.
    pub already: Vec<Condition>,
    /// What is waited for before the write.
    pub hold: Option<Hold>,
    /// The write, sent once.
    pub write: Write,
    /// What must show before the next step.
    pub proof: Vec<ProofStep>,
}

/// What is waited for before a write.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Hold {
    /// All of these at once, or one of them.
    pub conditions: Vec<Condition>,
    /// Whether one of them is enough.
    pub any: bool,
    /// How long it may take, in seconds; the write is not sent if it takes longer.
    pub within_s: u16,
}

/// An argument of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Arg {
    /// Its name.
    pub name: String,
    /// What it can be.
    pub values: ArgValues,
    /// Its number when it is not given; it must be given where this is none. For a time see [`ArgValues::Time`].
    pub default: Option<u16>,
}

impl Arg {
    /// The number behind a text: an id of the choices, or a decimal number in the range; none for a time.
    pub fn parse(&self, text: &str) -> Option<u16> {
        match &self.values {
            ArgValues::Choices(choices) => {
                let choice = choices.iter().find(|choice| choice.id == text)?;
                Some(choice.value)
            }
            ArgValues::Range(range) => text.parse().ok().filter(|value| range.contains(value)),
            ArgValues::Time { .. } => None,
        }
    }
}

/// What an argument can be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ArgValues {
    /// One of these.
    Choices(Vec<ArgChoice>),
    /// A number in this range.
    Range(RangeInclusive<u16>),
    /// A local date and time, or `now`; it runs on while the command does.
    Time {
        /// Whether it is now when it is not given.
        now: bool,
    },
}

/// One choice of an argument.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ArgChoice {
    /// What a person writes.
    pub id: String,
    /// What goes into the register.
    pub value: u16,
}

/// A number that an argument gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ArgRef {
    /// Index of the argument.
    pub arg: usize,
    /// The part of a time; none for choices and numbers.
    pub part: Option<TimePart>,
}

/// The write of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Write {
    /// Function 5, 6 or 16.
    pub function: u8,
    /// Coil or register address.
    pub address: u16,
    /// The value, before the argument is put to it.
    pub value: WriteValue,
    /// The argument whose number is OR-ed onto the value.
    pub arg: Option<ArgRef>,
}

/// The value of a write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WriteValue {
    /// Always this.
    Fixed(u16),
    /// Depends on what a point reads just before; other codes are refused.
    By {
        /// Index of the point.
        point: usize,
        /// Its raw code and the value to write.
        values: Vec<(u32, u16)>,
    },
}

impl WriteValue {
    /// The value; `code` is asked for the raw code of a point where that is needed. None means: refuse.
    pub fn resolve(&self, code: impl FnOnce(usize) -> Option<u32>) -> Option<u16> {
        match self {
            Self::Fixed(value) => Some(*value),
            Self::By { point, values } => {
                let code = code(*point)?;
                let (_, value) = values.iter().find(|(when, _)| *when == code)?;
                Some(*value)
            }
        }
    }
}

/// A comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Condition {
    /// What is compared.
    pub subject: Subject,
    /// With what.
    pub test: Test,
}

/// What a condition compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A point, or one bit of it.
    Point {
        /// Index of the point.
        point: usize,
        /// The bit, where the point is a set of them; then 0 and 1 are compared.
        bit: Option<u16>,
    },
    /// An argument, so that a moment can be waited for; only in a hold.
    Arg(ArgRef),
}

/// A comparison with a raw code: the number before scale, the code of a choice, or a bit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Test {
    /// Is this.
    Equals(u32),
    /// Is anything else.
    NotEquals(u32),
    /// Lies in this range.
    Between(RangeInclusive<u32>),
    /// Is the number of an argument.
    EqualsArg(ArgRef),
    /// Differs from what it was before the write; only in proofs.
    Changes,
}

/// How the effect of a command shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Proof {
    /// These steps, one after the other.
    Steps(Vec<ProofStep>),
    /// The manual documents nothing; the reason says so.
    None {
        /// Why nothing shows it, as a sentence.
        reason: String,
    },
}

impl Proof {
    /// The steps; empty where nothing is documented.
    pub fn steps(&self) -> &[ProofStep] {
        match self {
            Self::Steps(steps) => steps,
            Self::None { .. } => &[],
        }
    }
}

/// One step of a proof.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ProofStep {
    /// What is to be seen.
    pub what: Evidence,
    /// How long it may take, in seconds.
    pub within_s: u16,
}

/// What a proof step looks at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Evidence {
    /// A point.
    Point(Condition),
    /// A joined clock, against the time of an argument as it runs.
    Clock {
        /// Index among the joined signals.
        joined: usize,
        /// Index of the argument.
        arg: usize,
        /// How far apart they may be, in seconds.
        tolerance_s: u16,
    },
    /// The device as a whole.
    Device(DeviceProof),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_what_a_person_writes() {
        let choice = |id: &str, value| ArgChoice { id: id.to_owned(), value };
        let press = Arg {
            name: "press".to_owned(),
            values: ArgValues::Choices(vec![choice("short", 0), choice("long", 0x4000)]),
            default: Some(0),
        };
        assert_eq!(press.parse("long"), Some(0x4000));
        assert_eq!(press.parse("16384"), None);
        let channel = Arg { name: "channel".to_owned(), values: ArgValues::Range(0..=19), default: None };
        assert_eq!(channel.parse("19"), Some(19));
        assert_eq!((channel.parse("20"), channel.parse("-1"), channel.parse("x")), (None, None, None));
    }

    #[test]
    fn a_value_by_point_refuses_other_codes() {
        let by = WriteValue::By { point: 7, values: vec![(0xD500, 2), (0xD700, 16)] };
        assert_eq!(by.resolve(|point| (point == 7).then_some(0xD700)), Some(16));
        assert_eq!(by.resolve(|_| Some(0xD300)), None);
        assert_eq!(by.resolve(|_| None), None);
        assert_eq!(WriteValue::Fixed(4).resolve(|_| None), Some(4));
    }
}
