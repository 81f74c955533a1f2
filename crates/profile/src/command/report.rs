//! What became of a command: the verdict, why, and what was seen.

use std::borrow::Cow;
use std::fmt;
use std::time::Duration;

use serde::{Serialize, Serializer};

use crate::clock::DateTime;
use crate::number::Number;
use crate::profile::Profile;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// The state asked for shows, or was there already.
    Done,
    /// Nothing was changed: a precondition failed, or the device refused the first write.
    Refused,
    /// The state asked for did not come.
    NoEffect,
    /// Nobody can tell: nothing shows it, or the device fell silent.
    Unknown,
}

impl Verdict {
    /// As the command line and the API spell it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Refused => "refused",
            Self::NoEffect => "no_effect",
            Self::Unknown => "unknown",
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl Serialize for Verdict {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.as_str())
    }
}

/// The end of a command.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Report {
    /// How it ended.
    pub verdict: Verdict,
    /// Why, as sentences.
    pub reason: String,
    /// How many writes left.
    pub sent: u32,
    /// What was seen.
    pub evidence: Vec<Observed>,
    /// From the first call to the end.
    pub elapsed: Duration,
    /// The model of the device, where a label depends on it and a reading told it.
    pub model: Option<String>,
}

/// One thing that was looked at, before and after the write.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Observed {
    /// What was looked at.
    pub sign: Sign,
    /// What it was before the write; none where it was not read or had no value.
    pub before: Option<Seen>,
    /// What it was when it proved the effect, or at the end; none where it was not read or had no value.
    pub after: Option<Seen>,
    /// When the later of the two was read, by the caller's clock.
    pub at: Duration,
}

/// What was looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Sign {
    /// A point, or one bit of it.
    Point {
        /// Index of the point.
        point: usize,
        /// The bit.
        bit: Option<u16>,
    },
    /// A joined signal, by its index.
    Joined(usize),
    /// Whether the device answers.
    Device,
}

/// What was seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Seen {
    /// A number in the point's unit.
    Number(Number),
    /// A code.
    Code(u32),
    /// A bit.
    Bit(bool),
    /// A clock.
    Clock(DateTime),
    /// Whether the device answered.
    Answers(bool),
}

/// An observation as `busbar command --json` prints it, but for the time, which the caller's clock gives.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ObservedShow<'a> {
    /// Id of the point, `point.bit` for a bit, the signal for a joined one, or `device`.
    pub id: Cow<'a, str>,
    /// Before the write.
    pub before: Option<SeenShow<'a>>,
    /// After the write.
    pub after: Option<SeenShow<'a>>,
}

/// What was seen, as people read it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
#[non_exhaustive]
pub enum SeenShow<'a> {
    /// A bit.
    Flag(bool),
    /// A number.
    Number(Number),
    /// A label, a clock, or a word.
    Text(Cow<'a, str>),
}

impl Observed {
    /// With ids and labels; `model` picks the label where a meaning depends on it.
    pub fn shown<'a>(&self, profile: &'a Profile, model: Option<&str>) -> ObservedShow<'a> {
        let show = |seen: Option<Seen>| seen.map(|seen| self.sign.show(seen, profile, model));
        ObservedShow { id: self.sign.id(profile), before: show(self.before), after: show(self.after) }
    }
}

impl Sign {
    fn id(self, profile: &Profile) -> Cow<'_, str> {
        match self {
            Self::Point { point, bit } => {
                let point = &profile.points[point];
                match bit.and_then(|bit| point.bit(bit)) {
                    Some(bit) => Cow::Owned(format!("{}.{}", point.id, bit.id)),
                    None => Cow::Borrowed(point.id.as_str()),
                }
            }
            Self::Joined(index) => Cow::Borrowed(&profile.joined()[index].signal),
            Self::Device => Cow::Borrowed("device"),
        }
    }

    fn show<'a>(self, seen: Seen, profile: &'a Profile, model: Option<&str>) -> SeenShow<'a> {
        match (seen, self) {
            (Seen::Number(number), _) => SeenShow::Number(number),
            (Seen::Bit(bit), _) => SeenShow::Flag(bit),
            (Seen::Clock(clock), _) => SeenShow::Text(Cow::Owned(clock.to_string())),
            (Seen::Answers(true), _) => SeenShow::Text(Cow::Borrowed("answers")),
            (Seen::Answers(false), _) => SeenShow::Text(Cow::Borrowed("silent")),
            (Seen::Code(code), Self::Point { point, .. }) => {
                SeenShow::Text(profile.points[point].label(code, model))
            }
            (Seen::Code(code), _) => SeenShow::Text(Cow::Owned(code.to_string())),
        }
    }
}
