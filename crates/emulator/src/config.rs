//! What to imitate, and where.

use std::time::Duration;

use busbar_link::Endpoint;
use busbar_profile::DateTime;

use crate::faults::Faults;
use crate::scenario::Scenario;

/// 5 January 2026 at ten, after the first instant of 2000.
const MONDAY_MORNING: Duration = Duration::from_secs(9501 * 86_400 + 10 * 3600);

/// How one imitated controller is to be started.
#[derive(Clone, Debug)]
pub struct Config {
    /// Profile of the controller, such as `datakom-d`.
    pub profile: String,
    /// The unit id that it answers to.
    pub unit: u8,
    /// Model of the family; the demonstration model when none is given.
    pub model: Option<String>,
    /// Where to listen; port 0 lets the system choose, and so does `rtu://pty` a pseudo-terminal. Several endpoints
    /// share one plant.
    pub listen: Vec<Endpoint>,
    /// The same seed, inputs and simulated time give the same registers.
    pub seed: u64,
    /// Simulated seconds a second, above 0 and up to [`MAX_SPEED`](crate::MAX_SPEED).
    pub speed: f64,
    /// Values that stay as they are, as point id and text.
    pub pins: Vec<(String, String)>,
    /// Something happens at the site by itself: the demonstration wants it.
    pub story: bool,
    /// What happens to it, and what is expected of it.
    pub scenario: Option<Scenario>,
    /// What goes wrong on the wires that it answers on.
    pub faults: Option<Faults>,
    /// What the calendar of a controller that has one says at power-on. Nothing depends on it but what that controller
    /// does by its calendar: the weather, the story and the rest follow the seed and the time that has passed.
    pub epoch: DateTime,
    /// Connections served at the same time; further ones are closed at once.
    pub connections: usize,
    /// A connection without a byte for this long is closed, at the latest after twice as long.
    pub idle: Duration,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            profile: "datakom-d".to_owned(),
            unit: 1,
            model: None,
            listen: Vec::new(),
            seed: 1,
            speed: 1.0,
            pins: Vec::new(),
            story: false,
            scenario: None,
            faults: None,
            epoch: DateTime::FIRST.plus(MONDAY_MORNING),
            connections: 128,
            idle: Duration::from_secs(300),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calendars_start_on_a_monday_morning_unless_told_otherwise() {
        assert_eq!(Config::default().epoch.to_string(), "2026-01-05T10:00:00");
    }
}
