//! The engine's own controller, seen over J1939: what it measures by itself, and its fault codes.

use crate::plant::{Plant, RATED_KW, RATED_RPM};
use crate::random::approach;

use super::sequence::Sequence;
use super::settings::SITE;

/// How many fault codes the table has room for.
pub(super) const FAULTS: usize = 8;
/// Below this the tank is reported, %.
const LOW_FUEL: f64 = 20.0;
/// Seconds for which a battery must be low: the starter is no fault of its own.
const BATTERY_SECONDS: f64 = 10.0;

/// A suspect parameter number with its failure mode (SAE J1939-73).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) spn: u16,
    pub(super) fmi: u8,
}

const HIGH_COOLANT_TEMPERATURE: Fault = Fault { spn: 110, fmi: 16 };
const LOW_OIL_PRESSURE: Fault = Fault { spn: 100, fmi: 18 };
const LOW_FUEL_LEVEL: Fault = Fault { spn: 96, fmi: 17 };
const LOW_BATTERY: Fault = Fault { spn: 168, fmi: 18 };

/// Quantities that the plant does not know, each with its memory.
#[derive(Clone, Debug)]
pub(super) struct Ecu {
    /// bar above the air.
    pub(super) boost: f64,
    /// bar.
    pub(super) fuel_pressure: f64,
    /// degC.
    pub(super) fuel: f64,
    /// degC.
    pub(super) manifold: f64,
    /// degC.
    pub(super) exhaust: f64,
    /// kPa that the air filter takes.
    pub(super) air_filter: f64,
    /// kW and L/h of the last seconds.
    power: f64,
    burn: f64,
    /// Seconds.
    battery_low_for: f64,
    faults: [Fault; FAULTS],
}

impl Ecu {
    pub(super) fn new(plant: &Plant) -> Self {
        Self {
            boost: 0.0,
            fuel_pressure: 0.0,
            fuel: plant.ambient,
            manifold: plant.canopy,
            exhaust: plant.canopy,
            air_filter: 0.0,
            power: 0.0,
            burn: 0.0,
            battery_low_for: 0.0,
            faults: [Fault::default(); FAULTS],
        }
    }

    pub(super) fn step(&mut self, dt: f64, plant: &Plant, sequence: &Sequence) {
        let load = (plant.genset.total_active() / RATED_KW).max(0.0);
        let speed = plant.engine.speed / RATED_RPM;
        let boost = if plant.engine.is_running() { 0.06 + 1.3 * load } else { 0.0 };
        approach(&mut self.boost, boost, 1.5, dt);
        approach(&mut self.fuel_pressure, 3.6 * speed.min(1.0), 0.6, dt);
        approach(&mut self.air_filter, speed * speed * (1.1 + 1.4 * self.boost), 0.5, dt);

        let (fuel, manifold, exhaust) = match plant.engine.is_running() {
            true => (plant.canopy + 8.0, plant.canopy + 12.0 + 22.0 * self.boost, 140.0 + 380.0 * load),
            false => (plant.canopy, plant.canopy, plant.canopy),
        };
        approach(&mut self.fuel, fuel, 200.0, dt);
        approach(&mut self.manifold, manifold, 30.0, dt);
        approach(&mut self.exhaust, exhaust, if plant.engine.is_running() { 15.0 } else { 120.0 }, dt);
        approach(&mut self.power, plant.genset.total_active().max(0.0), 2.0, dt);
        approach(&mut self.burn, plant.engine.burn, 2.0, dt);
        let low = plant.batteries[0].voltage < SITE.low_battery_warning;
        self.battery_low_for = if low { self.battery_low_for + dt } else { 0.0 };
        self.judge(plant, sequence);
    }

    /// kWh a litre, of a running engine.
    pub(super) fn economy(&self, plant: &Plant) -> f64 {
        if plant.engine.is_running() && self.burn > 0.0 { self.power / self.burn } else { 0.0 }
    }

    /// Rows without a fault are zero and come last.
    pub(super) fn faults(&self) -> [Fault; FAULTS] {
        self.faults
    }

    /// Whether any fault is active.
    pub(super) fn warns(&self) -> bool {
        self.faults[0] != Fault::default()
    }

    fn judge(&mut self, plant: &Plant, sequence: &Sequence) {
        let engine = &plant.engine;
        let active = [
            (HIGH_COOLANT_TEMPERATURE, engine.coolant > SITE.high_temperature_warning),
            (
                LOW_OIL_PRESSURE,
                sequence.is_up_to_speed() && engine.oil_pressure < SITE.low_oil_pressure_warning,
            ),
            (LOW_FUEL_LEVEL, plant.tank.percent() < LOW_FUEL),
            (LOW_BATTERY, self.battery_low_for >= BATTERY_SECONDS),
        ];
        let mut rows = active.into_iter().filter(|(_, on)| *on).map(|(fault, _)| fault);
        self.faults = std::array::from_fn(|_| rows.next().unwrap_or_default());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    #[test]
    fn faults_fill_the_rows_from_the_first_on() {
        let (mut plant, sequence) = (Plant::new(1), Sequence::new(SITE));
        let mut ecu = Ecu::new(&plant);
        let mut codes = |plant: &Plant| {
            ecu.step(5.0, plant, &sequence);
            ecu.faults().map(|fault| fault.spn)
        };
        assert_eq!(codes(&plant), [0; FAULTS]);
        plant.tank = Tank::new(15.0);
        assert_eq!(codes(&plant)[..2], [LOW_FUEL_LEVEL.spn, 0]);
        plant.batteries[0].voltage = 22.0;
        plant.engine.coolant = 100.0;
        assert_eq!(codes(&plant)[..3], [HIGH_COOLANT_TEMPERATURE.spn, LOW_FUEL_LEVEL.spn, 0]);
        assert_eq!(
            codes(&plant)[..4],
            [HIGH_COOLANT_TEMPERATURE.spn, LOW_FUEL_LEVEL.spn, LOW_BATTERY.spn, 0]
        );
        plant.tank = Tank::new(80.0);
        assert_eq!(codes(&plant)[..3], [HIGH_COOLANT_TEMPERATURE.spn, LOW_BATTERY.spn, 0]);
    }
}
