//! Remote commands as data: what must hold, the one write, and what proves its effect.

use std::ops::RangeInclusive;

use crate::terms::{Confirm, DeviceProof, Risk, Role};

/// A remote command.
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
    /// The write, sent once.
    pub write: Write,
    /// How its effect shows.
    pub proof: Proof,
}

impl Command {
    /// The argument of that name.
    pub fn arg(&self, name: &str) -> Option<&Arg> {
        self.args.iter().find(|arg| arg.name == name)
    }
}

/// An argument of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Arg {
    /// Its name.
    pub name: String,
    /// What it can be.
    pub values: ArgValues,
    /// Its number when it is not given; it must be given where this is none.
    pub default: Option<u16>,
}

impl Arg {
    /// The number behind a text: an id of the choices, or a decimal number in the range.
    pub fn parse(&self, text: &str) -> Option<u16> {
        match &self.values {
            ArgValues::Choices(choices) => {
                let choice = choices.iter().find(|choice| choice.id == text)?;
                Some(choice.value)
            }
            ArgValues::Range(range) => text.parse().ok().filter(|value| range.contains(value)),
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

/// The write of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Write {
    /// Function 5, 6 or 16.
    pub function: u8,
    /// Coil or register address.
    pub address: u16,
    /// The value, before the argument is put to it.
    pub value: WriteValue,
    /// Index of the argument whose number is OR-ed onto the value.
    pub arg: Option<usize>,
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

/// A comparison of one point, or one bit of it.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Condition {
    /// Index of the point.
    pub point: usize,
    /// The bit, where the point is a set of them; then 0 and 1 are compared.
    pub bit: Option<u16>,
    /// The comparison.
    pub test: Test,
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
    /// Is the number of the argument of this index.
    EqualsArg(usize),
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
