//! Scenarios: what happens at a plant, one thing after the other, and what is expected of its controller.
//!
//! A scenario is a TOML file that is checked as a whole before anything starts. Given to a [`Device`](crate::Device)
//! through its [`Config`], it is played by the device's own clock: the same file gives the same report every time,
//! whoever watches and however fast.

mod condition;
mod expectation;
mod load;
mod narrator;
mod order;
mod parse;
mod player;
mod report;
mod step;

#[cfg(test)]
mod tests;

use std::time::Duration;

use busbar_profile::command::Verdict;
use busbar_profile::{Command, DateTime, Findings, Profile};

use crate::config::Config;
use crate::notes::Place;
use condition::Condition;

pub(crate) use narrator::Narrator;
pub(crate) use player::Player;
pub use report::{Check, CheckVerdict, Event, EventKind, Report, Seen};

/// A scenario in which everything has been checked against its controller.
#[derive(Clone, Debug)]
pub struct Scenario {
    file: String,
    /// Where it names its controller.
    place: Place,
    title: String,
    about: Option<String>,
    profile: &'static Profile,
    model: Option<String>,
    seed: u64,
    clock: DateTime,
    settings: Vec<(String, String)>,
    /// After so long it is over, done or not.
    lasts: Duration,
    steps: Vec<Step>,
}

/// One step: when it is taken, what happens then, what is expected from then on.
#[derive(Clone, Debug)]
struct Step {
    place: Place,
    trigger: Trigger,
    /// In the order of the file.
    actions: Vec<Action>,
    expectations: Vec<Expectation>,
}

/// When a step is taken, once its turn has come.
#[derive(Clone, Debug)]
enum Trigger {
    /// At this time since the start.
    At(Duration),
    /// So long after the step before, or after the start.
    After(Duration),
    /// As soon as this holds; a failure if that takes longer.
    When { condition: Condition, text: String, within: Option<Duration> },
}

/// Something that happens.
#[derive(Clone, Debug)]
enum Action {
    Pull { lever: String, to: String },
    Inject { alarm: String, active: bool },
    Pin { point: String, value: String },
    Unpin { point: String },
    Set { setting: String, value: String },
    Order { command: &'static Command, args: Vec<(String, String)>, verdict: Option<Verdict>, place: Place },
    Note(String),
}

/// What is expected of the controller.
#[derive(Clone, Debug)]
struct Expectation {
    place: Place,
    /// As the file writes it.
    text: String,
    wish: parse::Wish,
}

impl Scenario {
    /// Reads and checks a scenario file; `file` only serves the findings and the report.
    ///
    /// # Errors
    /// Everything that is wrong with the text, with line, column and remedy.
    pub fn parse(file: &str, text: &str) -> Result<Self, Findings> {
        load::scenario(file, text)
    }

    /// What it is called.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What it is about, where it says so.
    pub fn about(&self) -> Option<&str> {
        self.about.as_deref()
    }

    /// Where it names its controller, as `file:line:column`.
    pub fn place(&self) -> String {
        let Self { file, place: Place { line, column }, .. } = self;
        format!("{file}:{line}:{column}")
    }

    /// Key of the profile that its controller has.
    pub fn controller(&self) -> &'static str {
        &self.profile.key
    }

    /// The device that it happens to, playing it from power-on. It listens nowhere yet.
    pub fn config(&self) -> Config {
        Config { scenario: Some(self.clone()), ..self.stage() }
    }

    /// The same device without the scenario.
    fn stage(&self) -> Config {
        Config {
            profile: self.profile.key.clone(),
            unit: self.profile.wire.unit.default.unwrap_or(1),
            model: self.model.clone(),
            seed: self.seed,
            epoch: self.clock,
            pins: self.settings.clone(),
            ..Config::default()
        }
    }

    /// Plays it to its end on a device of its own, as fast as this machine can.
    ///
    /// # Errors
    /// The device cannot be made, which the check of the file has ruled out.
    pub fn play(&self) -> Result<Report, crate::StartError> {
        let mut device = crate::Device::new(&self.config())?;
        // The player ends every scenario at the latest when its time is up.
        while device.report().is_none_or(|report| !report.is_over()) {
            device.advance(device.time() + crate::STEP);
        }
        Ok(device.report().cloned().unwrap_or_default())
    }
}
