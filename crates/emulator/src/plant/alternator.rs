//! The alternator and its voltage regulator.

use crate::random::approach;

use super::{Feed, RATED_KVA, RATED_KVAR, RATED_RPM, RATED_VOLTAGE, Regulation};

/// V below which an alternator feeds nobody.
pub(super) const DEAD: f64 = 100.0;
/// V that the iron remembers at rated speed.
const REMANENCE: f64 = 4.0;
/// rpm from which the regulator has enough to work with.
const EXCITED_FROM: f64 = 700.0;
/// Below this part of rated speed the voltage goes down with the speed, to spare the engine.
const ROLL_OFF: f64 = 0.95;
/// V that a step of rated load would cost at once: the regulator answers before all of it has come.
const DIP: f64 = 40.0;
/// Times the rated current that the exciter can give: with more the voltage sinks.
const CEILING: f64 = 2.0;
/// Part of the voltage that is left where a line without its grid hangs on it, and seconds until it has sunk.
pub(super) const CHOKED: f64 = 0.04;
const CHOKES: f64 = 0.1;
/// What a regulator that reads nothing makes of the rated voltage.
const OVEREXCITED: f64 = 1.22;

/// The state of the regulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Avr {
    Normal,
    /// No excitation.
    Failed,
    /// All that it has.
    High,
}

#[derive(Clone, Debug)]
pub(super) struct Alternator {
    /// V between phase and neutral, before the breaker.
    pub(super) voltage: f64,
    pub(super) avr: Avr,
    /// V that the field makes, and the part of it that the current leaves at the terminals.
    field: f64,
    left: f64,
    /// kVA that the regulator has answered.
    answered: f64,
}

impl Alternator {
    pub(super) fn new() -> Self {
        Self { voltage: 0.0, avr: Avr::Normal, field: 0.0, left: 1.0, answered: 0.0 }
    }

    /// Builds up and holds the voltage of a turning alternator. A line that its grid has left chokes one that feeds it.
    pub(super) fn step(&mut self, dt: f64, rpm: f64, excitation: &Regulation, carried: &Feed, chokes: bool) {
        let apparent = carried.total_apparent();
        let dip = DIP * (apparent - self.answered) / RATED_KVA;
        approach(&mut self.answered, apparent, 0.4, dt);
        let remembered = REMANENCE * rpm / RATED_RPM;
        let settled = match self.avr {
            Avr::Normal => excitation.settles_at(RATED_VOLTAGE, carried.total_reactive() / RATED_KVAR) - dip,
            Avr::Failed => remembered,
            Avr::High => OVEREXCITED * RATED_VOLTAGE,
        };
        let excited = match rpm {
            rpm if rpm > EXCITED_FROM => settled * (rpm / (ROLL_OFF * RATED_RPM)).min(1.0),
            _ => remembered,
        };
        approach(&mut self.field, excited.max(0.0), 0.4, dt);
        // One that stands has no voltage at all, however slowly the field dies.
        if rpm <= 0.0 {
            self.field = 0.0;
        }
        // The field is still there when what chokes it is gone.
        approach(&mut self.left, if chokes { CHOKED } else { ceiling(carried) }, CHOKES, dt);
        self.voltage = self.field * self.left;
    }

    /// A busbar that is held by others gives it its voltage.
    pub(super) fn hold(&mut self, volts: f64) {
        (self.field, self.left, self.voltage) = (volts, 1.0, volts);
    }
}

/// Part of its voltage that the exciter can hold with this current.
fn ceiling(carried: &Feed) -> f64 {
    let rated = RATED_KVA * 1000.0 / 3.0 / RATED_VOLTAGE;
    let current = carried.average_current() / rated;
    if current > CEILING { CEILING / current } else { 1.0 }
}
