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
/// V that a step of rated load costs until the regulator has answered.
const DIP: f64 = 14.0;
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
    /// kVA that the regulator has answered.
    answered: f64,
}

impl Alternator {
    pub(super) fn new() -> Self {
        Self { voltage: 0.0, avr: Avr::Normal, answered: 0.0 }
    }

    /// Builds up and holds the voltage of a turning alternator.
    pub(super) fn step(&mut self, dt: f64, rpm: f64, excitation: &Regulation, carried: &Feed) {
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
        approach(&mut self.voltage, excited.max(0.0), 0.4, dt);
        // One that stands has no voltage at all, however slowly the field dies.
        if rpm <= 0.0 {
            self.voltage = 0.0;
        }
    }
}
