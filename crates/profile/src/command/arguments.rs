//! What a person gives to a command, checked against what it takes.

use crate::clock::DateTime;
use crate::command::{Arg, ArgRef, ArgValues, Command};

/// A checked argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArgValue {
    /// A choice or a number, as it goes into the register.
    Number(u16),
    /// The time at the moment the command begins.
    Time(DateTime),
}

/// All arguments of one command, in its order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Arguments {
    values: Vec<ArgValue>,
}

/// What is wrong with the arguments of a command. The caller is at fault.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArgError {
    /// There is no argument of that name.
    #[error("there is no argument `{name}`; {known}")]
    Unknown {
        /// What was given.
        name: String,
        /// The arguments that exist, as a sentence.
        known: String,
    },
    /// An argument was given more than once.
    #[error("`{name}` is given twice")]
    Twice {
        /// Its name.
        name: String,
    },
    /// An argument without default was not given.
    #[error("`{name}` is not given; write {expected}")]
    Missing {
        /// Its name.
        name: String,
        /// What it can be.
        expected: String,
    },
    /// It cannot be that.
    #[error("`{name}` cannot be `{found}`; write {expected}")]
    Value {
        /// Its name.
        name: String,
        /// What was given.
        found: String,
        /// What it can be.
        expected: String,
    },
}

impl Command {
    /// Checks arguments given as name and text; `local` is the local time, which a time of `now` means.
    ///
    /// # Errors
    ///
    /// A name that does not exist, is there twice or is missing, or a text that the argument cannot be.
    pub fn arguments<'a>(
        &self,
        given: impl IntoIterator<Item = (&'a str, &'a str)>,
        local: DateTime,
    ) -> Result<Arguments, ArgError> {
        let mut values = vec![None; self.args.len()];
        for (name, text) in given {
            let Some(index) = self.args.iter().position(|arg| arg.name == name) else {
                let known = match self.args.as_slice() {
                    [] => "the command takes none".to_owned(),
                    args => {
                        let names: Vec<_> = args.iter().map(|arg| arg.name.as_str()).collect();
                        format!("write one of: {}", names.join(", "))
                    }
                };
                return Err(ArgError::Unknown { name: name.to_owned(), known });
            };
            let arg = &self.args[index];
            let value = arg.value(text, local).ok_or_else(|| ArgError::Value {
                name: arg.name.clone(),
                found: text.to_owned(),
                expected: arg.expected(),
            })?;
            if values[index].replace(value).is_some() {
                return Err(ArgError::Twice { name: arg.name.clone() });
            }
        }
        let values = self.args.iter().zip(values).map(|(arg, value)| {
            value
                .or_else(|| arg.default_value(local))
                .ok_or_else(|| ArgError::Missing { name: arg.name.clone(), expected: arg.expected() })
        });
        Ok(Arguments { values: values.collect::<Result<_, _>>()? })
    }
}

impl Arg {
    fn value(&self, text: &str, local: DateTime) -> Option<ArgValue> {
        match self.values {
            ArgValues::Time { .. } if text == "now" => Some(ArgValue::Time(local)),
            ArgValues::Time { .. } => text.parse().ok().map(ArgValue::Time),
            _ => self.parse(text).map(ArgValue::Number),
        }
    }

    fn default_value(&self, local: DateTime) -> Option<ArgValue> {
        match self.values {
            ArgValues::Time { now } => now.then_some(ArgValue::Time(local)),
            _ => self.default.map(ArgValue::Number),
        }
    }

    /// What a person can write.
    fn expected(&self) -> String {
        match &self.values {
            ArgValues::Choices(choices) => {
                let ids: Vec<_> = choices.iter().map(|choice| choice.id.as_str()).collect();
                format!("one of: {}", ids.join(", "))
            }
            ArgValues::Range(range) => format!("a number from {} to {}", range.start(), range.end()),
            ArgValues::Time { .. } => "now, or a local time as 2026-11-23T05:19:51".to_owned(),
        }
    }
}

impl Arguments {
    /// Each in the order of the command.
    pub fn iter(&self) -> impl Iterator<Item = ArgValue> {
        self.values.iter().copied()
    }

    /// The time of an argument, when it is one.
    pub(super) fn time(&self, arg: usize) -> Option<DateTime> {
        match self.values.get(arg)? {
            ArgValue::Time(time) => Some(*time),
            ArgValue::Number(_) => None,
        }
    }

    /// The number that an argument gives when its time has run on by `later`.
    pub(super) fn number(&self, arg: ArgRef, later: std::time::Duration) -> Option<u16> {
        match (self.values.get(arg.arg)?, arg.part) {
            (ArgValue::Number(number), None) => Some(*number),
            (ArgValue::Time(time), Some(part)) => Some(time.plus(later).part(part)),
            _ => None,
        }
    }
}
