//! What became of a scenario: events for people as they come, checks with their verdicts for programs.

use std::time::Duration;

use serde::{Serialize, Serializer};

use crate::facts::Fact;

/// What has become of a scenario so far, and in the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// The file, as the caller named it.
    pub file: String,
    /// What the scenario is called.
    pub title: String,
    /// Key of the controller's profile.
    pub controller: String,
    /// Its model.
    pub model: String,
    /// The seed of everything that is left to chance.
    pub seed: u64,
    /// Whether everything that was expected came; none while it is played.
    pub held: Option<bool>,
    /// How much simulated time has passed.
    #[serde(rename = "lasted_s", serialize_with = "seconds")]
    pub lasted: Duration,
    /// How many steps the scenario has, and how many were taken.
    pub steps: usize,
    /// How many of them were taken.
    pub taken: usize,
    /// What was expected, in the order in which it was decided.
    pub checks: Vec<Check>,
    /// What happened, in order.
    pub events: Vec<Event>,
}

/// One thing that was expected.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Check {
    /// Line of the file, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What was expected, as the file writes it.
    pub expected: String,
    /// Since when, in simulated time.
    #[serde(rename = "since_s", serialize_with = "seconds")]
    pub since: Duration,
    /// When it was decided.
    #[serde(rename = "decided_s", serialize_with = "seconds")]
    pub decided: Duration,
    /// How it was decided.
    pub verdict: CheckVerdict,
    /// What was seen then.
    pub seen: Vec<Seen>,
    /// Why, where what was seen does not say it.
    pub reason: Option<String>,
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CheckVerdict {
    /// It came as expected.
    Held,
    /// It did not.
    Failed,
}

/// A fact that a condition looks at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Seen {
    /// Its name.
    pub name: String,
    /// What it was.
    pub value: Fact,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Event {
    /// When, in simulated time.
    #[serde(rename = "at_s", serialize_with = "seconds")]
    pub at: Duration,
    /// What kind of event it is.
    pub kind: EventKind,
    /// Line of the file that it comes from, if it comes from one.
    pub line: Option<usize>,
    /// What happened, in words.
    pub text: String,
}

/// What kind of event it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum EventKind {
    /// The scenario made it happen.
    Action,
    /// The author has something to say.
    Note,
    /// The controller changed its state, a breaker moved, an alarm came or went.
    Change,
    /// Something that was expected came.
    Held,
    /// Something that was expected did not come.
    Failed,
}

impl Report {
    /// Whether the scenario is over.
    pub fn is_over(&self) -> bool {
        self.held.is_some()
    }

    /// The checks that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.verdict == CheckVerdict::Failed)
    }

    /// Everything is decided.
    pub(super) fn conclude(&mut self) {
        let held = self.failures().next().is_none();
        self.held = Some(held);
    }

    /// A check that failed, as a sentence: where, what was expected, what was seen.
    pub fn sentence(&self, check: &Check) -> String {
        let Check { line, column, expected, since, decided, seen, reason, .. } = check;
        let mut sentence = format!(
            "{}:{line}:{column}: expected {expected} from {} s on; at {} s",
            self.file,
            in_seconds(*since),
            in_seconds(*decided)
        );
        let facts: Vec<_> = seen.iter().map(|Seen { name, value }| format!("{name} was {value}")).collect();
        match (facts.is_empty(), reason) {
            (false, None) => sentence.push_str(&format!(" {}", facts.join(", "))),
            (false, Some(reason)) => sentence.push_str(&format!(" {reason}, {}", facts.join(", "))),
            (true, reason) => {
                sentence.push_str(&format!(" {}", reason.as_deref().unwrap_or("it was not so")));
            }
        }
        sentence
    }
}

impl Event {
    /// When it happened, in seconds with a tenth: the clock's steps are no finer.
    pub fn seconds(&self) -> String {
        in_seconds(self.at)
    }
}

fn in_seconds(time: Duration) -> String {
    format!("{:.1}", time.as_secs_f64())
}

fn seconds<S: Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.as_secs_f64())
}
