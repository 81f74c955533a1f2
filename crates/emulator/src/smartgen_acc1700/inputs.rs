//! The emergency stop and the five digital inputs of an ACC1700: contacts on site, and what the unit makes of them.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::Compressor;

use super::setup::Setup;

/// Percent in the tank at which its float switch closes, and at which it opens again.
const FLOAT_CLOSES: f64 = 20.0;
const FLOAT_OPENS: f64 = 21.0;
/// Percent in the expansion tank below which its float switch closes.
const COOLANT_LOW: f64 = 40.0;
/// degC at which the thermal switch on the cylinder head closes.
const TOO_HOT: f64 = 108.0;

/// Contacts that people on site have their hands on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Hands {
    /// The button is pressed.
    pub(super) emergency_stop: bool,
    /// Input 4 is wired to a switch for any use, which is closed.
    pub(super) switch_closed: bool,
    /// Somebody has opened the canopy.
    pub(super) door_open: bool,
}

/// What the inputs are wired to, and how long each has been active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Inputs {
    emergency_stop: bool,
    closed: [bool; 5],
    active: [bool; 5],
    active_for: [Duration; 5],
    confirmed: [bool; 5],
}

impl Inputs {
    pub(super) fn step(&mut self, dt: Duration, plant: &Compressor, hands: Hands, setup: &Setup) {
        let fuel = plant.tank.percent();
        self.emergency_stop = hands.emergency_stop;
        self.closed = [
            plant.coolant_level() < COOLANT_LOW,
            plant.engine.coolant > TOO_HOT,
            fuel < FLOAT_CLOSES || self.closed[2] && fuel < FLOAT_OPENS,
            hands.switch_closed,
            // The contact of the canopy door is closed while the door is.
            !hands.door_open,
        ];
        for (index, input) in setup.inputs.iter().enumerate() {
            let active = self.closed[index] != input.active_open;
            let since = if active { self.active_for[index] + dt } else { Duration::ZERO };
            self.active[index] = active;
            self.active_for[index] = since;
            self.confirmed[index] = active && since >= input.delay;
        }
    }

    pub(super) fn emergency_stop(&self) -> bool {
        self.emergency_stop
    }

    /// Inputs that have been active for their delay.
    pub(super) fn confirmed(&self) -> [bool; 5] {
        self.confirmed
    }

    /// Register 35: contacts that are closed. Bit 0 is the emergency stop, which gives a signal when it is pressed.
    pub(super) fn signals(&self) -> BitSet {
        bits(std::iter::once(self.emergency_stop).chain(self.closed))
    }

    /// Register 45: inputs in the position that matters.
    pub(super) fn active(&self) -> BitSet {
        bits(self.active)
    }
}

/// The positions that are true.
pub(super) fn bits(values: impl IntoIterator<Item = bool>) -> BitSet {
    (0..).zip(values).filter(|(_, value)| *value).map(|(bit, _)| bit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn the_fuel_float_has_a_hysteresis_and_its_input_a_delay() {
        let setup = Setup::with(&[]);
        let (mut plant, mut inputs) = (Compressor::new(1), Inputs::default());
        let mut at = |percent, seconds| {
            plant.tank = Tank::new(percent);
            for _ in 0..seconds {
                inputs.step(SECOND, &plant, Hands::default(), &setup);
            }
            (inputs.active().contains(2), inputs.confirmed()[2])
        };
        assert_eq!(at(20.5, 5), (false, false));
        assert_eq!(at(19.9, 1), (true, false), "shorter than the delay");
        assert_eq!(at(19.9, 1), (true, true));
        assert_eq!(at(20.5, 5), (true, true));
        assert_eq!(at(21.1, 1), (false, false));
    }

    #[test]
    fn the_door_contact_is_closed_and_inactive_while_the_door_is_shut() {
        let plant = Compressor::new(1);
        let at = |door_open, changes: &[(&str, &str)]| {
            let mut inputs = Inputs::default();
            inputs.step(SECOND, &plant, Hands { door_open, ..Hands::default() }, &Setup::with(changes));
            (inputs.signals().register(0), inputs.active().register(0), inputs.confirmed()[4])
        };
        assert_eq!(at(false, &[]), (1 << 5, 0, false));
        assert_eq!(at(true, &[]), (0, 1 << 4, true));
        let turned = [("input_5_active_open", "0")];
        assert_eq!(at(false, &turned), (1 << 5, 1 << 4, true));
        assert_eq!(at(true, &turned), (0, 0, false));
    }

    #[test]
    fn hands_close_the_contacts_that_they_are_on() {
        let mut inputs = Inputs::default();
        let hands = Hands { emergency_stop: true, switch_closed: true, door_open: true };
        inputs.step(SECOND, &Compressor::new(1), hands, &Setup::with(&[]));
        assert!(inputs.emergency_stop());
        assert_eq!(
            (inputs.signals().register(0), inputs.active().register(0)),
            (1 | 1 << 4, 1 << 3 | 1 << 4)
        );
    }
}
