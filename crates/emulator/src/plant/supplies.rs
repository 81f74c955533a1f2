//! What the engine lives on: starter batteries with their charging, and the day tank.

use crate::random::{Drift, Random, approach};

/// A 24 V starter battery.
#[derive(Clone, Debug)]
pub(crate) struct Battery {
    /// V at the terminals.
    pub(crate) voltage: f64,
    /// V at the charge alternator's D+ terminal.
    pub(crate) charge_input: f64,
    /// A into the battery.
    pub(crate) charge_current: f64,
    /// Lowest V of the last cranking.
    pub(crate) cranking_minimum: f64,
    cranking: bool,
    sag: f64,
    ripple: Drift,
}

impl Battery {
    pub(crate) fn new(random: &mut Random) -> Self {
        Self {
            voltage: 27.1,
            charge_input: 0.3,
            charge_current: 0.4,
            cranking_minimum: random.between(20.2, 21.4),
            cranking: false,
            sag: random.between(6.0, 7.2),
            ripple: Drift::new(0.03, 5.0, random),
        }
    }

    pub(crate) fn step(
        &mut self,
        dt: f64,
        cranking: bool,
        running: bool,
        charger: bool,
        random: &mut Random,
    ) {
        let ripple = self.ripple.step(dt, random);
        let (target, tau) = match (cranking, running, charger) {
            (true, ..) => (26.9 - self.sag, 0.15),
            (_, true, _) => (28.2, 4.0),
            (_, _, true) => (27.1, 6.0),
            _ => (25.4, 60.0),
        };
        approach(&mut self.voltage, target + ripple, tau, dt);

        if cranking && !self.cranking {
            self.cranking_minimum = self.voltage;
        }
        if cranking {
            self.cranking_minimum = self.cranking_minimum.min(self.voltage);
        }
        self.cranking = cranking;

        let charge_input = match (running, cranking) {
            (true, _) => self.voltage - 0.15,
            // The excitation lamp lights through D+ until the alternator turns.
            (_, true) => 1.8,
            _ => 0.3,
        };
        approach(&mut self.charge_input, charge_input, 0.5, dt);

        let current = match (cranking, running, charger) {
            (false, true, _) => 9.0,
            (false, false, true) => 0.4,
            _ => 0.0,
        };
        approach(&mut self.charge_current, current, 20.0, dt);
    }
}

/// The day tank beside the genset.
#[derive(Clone, Debug)]
pub(crate) struct Tank {
    pub(crate) litres: f64,
    /// L/s that somebody else takes out of it.
    pub(crate) other_draw: f64,
}

impl Tank {
    const CAPACITY: f64 = 250.0;
    const PUMP_LITRES_PER_SECOND: f64 = 0.7;

    pub(crate) fn new(percent: f64) -> Self {
        Self { litres: Self::CAPACITY * percent / 100.0, other_draw: 0.0 }
    }

    pub(crate) fn percent(&self) -> f64 {
        self.litres / Self::CAPACITY * 100.0
    }

    /// `burn` in L/h.
    pub(crate) fn step(&mut self, dt: f64, burn: f64, pump: bool) {
        let pumped = if pump { Self::PUMP_LITRES_PER_SECOND } else { 0.0 };
        let change = pumped - self.other_draw - burn / 3600.0;
        self.litres = (self.litres + change * dt).clamp(0.0, Self::CAPACITY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_is_that_of_the_last_cranking() {
        let mut random = Random::new(1);
        let mut battery = Battery::new(&mut random);
        battery.cranking_minimum = 5.0;
        for _ in 0..30 {
            battery.step(0.1, true, false, true, &mut random);
        }
        let dip = battery.cranking_minimum;
        assert!((19.0..22.0).contains(&dip), "{dip}");
        for _ in 0..600 {
            battery.step(0.1, false, false, true, &mut random);
        }
        assert_eq!(battery.cranking_minimum, dip);
        assert!((battery.voltage - 27.1).abs() < 0.2);
    }

    #[test]
    fn a_tank_neither_overflows_nor_goes_below_empty() {
        let mut tank = Tank::new(99.9);
        for _ in 0..600 {
            tank.step(1.0, 0.0, true);
        }
        assert_eq!(tank.percent(), 100.0);
        tank.other_draw = 100.0;
        for _ in 0..600 {
            tank.step(1.0, 0.0, false);
        }
        assert_eq!(tank.percent(), 0.0);
    }
}
