//! Conditions over what a client would know: comparisons of numbers and words, flags, `not`, `and`, `or`, parentheses.
//!
//! Whatever nobody can tell (an absent sensor, a restarting controller) makes a comparison neither hold nor fail: a
//! condition holds only where it certainly does.

use std::cmp::Ordering;

use busbar_profile::Number;

use crate::device::Device;
use crate::facts::{Fact, Subject};

/// A condition whose names and types have been checked against a controller.
#[derive(Clone, Debug)]
pub(super) enum Condition {
    Flag(Subject),
    Number(Subject, Comparison, Number),
    Word { subject: Subject, word: &'static str, equal: bool },
    Not(Box<Condition>),
    And(Box<Condition>, Box<Condition>),
    Or(Box<Condition>, Box<Condition>),
}

/// How a number is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comparison {
    Equal,
    NotEqual,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

impl Condition {
    /// Whether it certainly holds.
    pub(super) fn holds(&self, device: &Device) -> bool {
        self.judge(device) == Some(true)
    }

    /// Everything that it looks at and what that is now, each once.
    pub(super) fn seen(&self, device: &Device) -> Vec<(String, Fact)> {
        let mut seen: Vec<(String, Fact)> = Vec::new();
        self.visit(&mut |subject| {
            if seen.iter().all(|(name, _)| name != subject.name()) {
                seen.push((subject.name().to_owned(), subject.fact(device)));
            }
        });
        seen
    }

    /// Whether it holds; none where nobody can tell.
    fn judge(&self, device: &Device) -> Option<bool> {
        match self {
            Self::Flag(subject) => match subject.fact(device) {
                Fact::Flag(flag) => Some(flag),
                _ => None,
            },
            Self::Number(subject, comparison, number) => match subject.fact(device) {
                Fact::Number(fact) => Some(comparison.accepts(fact.cmp(number))),
                _ => None,
            },
            Self::Word { subject, word, equal } => match subject.fact(device) {
                Fact::Word(fact) => Some((fact == *word) == *equal),
                Fact::NoWord(_) => Some(!equal),
                _ => None,
            },
            Self::Not(condition) => condition.judge(device).map(|holds| !holds),
            Self::And(a, b) => match (a.judge(device), b.judge(device)) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            },
            Self::Or(a, b) => match (a.judge(device), b.judge(device)) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (Some(false), Some(false)) => Some(false),
                _ => None,
            },
        }
    }

    fn visit(&self, look: &mut impl FnMut(&Subject)) {
        match self {
            Self::Flag(subject) | Self::Number(subject, ..) | Self::Word { subject, .. } => look(subject),
            Self::Not(condition) => condition.visit(look),
            Self::And(a, b) | Self::Or(a, b) => {
                a.visit(look);
                b.visit(look);
            }
        }
    }
}

impl Comparison {
    pub(super) fn of(text: &str) -> Option<Self> {
        Some(match text {
            "==" => Self::Equal,
            "!=" => Self::NotEqual,
            "<" => Self::Less,
            "<=" => Self::LessOrEqual,
            ">" => Self::Greater,
            ">=" => Self::GreaterOrEqual,
            _ => return None,
        })
    }

    fn accepts(self, ordering: Ordering) -> bool {
        match self {
            Self::Equal => ordering.is_eq(),
            Self::NotEqual => ordering.is_ne(),
            Self::Less => ordering.is_lt(),
            Self::LessOrEqual => ordering.is_le(),
            Self::Greater => ordering.is_gt(),
            Self::GreaterOrEqual => ordering.is_ge(),
        }
    }
}
