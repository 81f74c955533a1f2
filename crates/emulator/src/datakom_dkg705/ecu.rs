//! The engine's own controller, seen over J1939: what it measures by itself, and its fault codes.

use std::time::Duration;

use crate::plant::{Plant, RATED_KW, RATED_RPM};
use crate::random::approach;

use super::sequence::Sequence;

/// How many fault codes the table has room for.
pub(super) const FAULTS: usize = 8;

/// A suspect parameter number with its failure mode (SAE J1939-73).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) spn: u16,
    pub(super) fmi: u8,
}

/// Failure modes: beyond what is safe, and beyond what is usual.
const FAR_ABOVE: u8 = 0;
const FAR_BELOW: u8 = 1;
const ABOVE: u8 = 16;
const BELOW: u8 = 18;
const BELOW_LEAST: u8 = 17;
/// The ECU is sick itself: this fault comes by injection alone.
const SICK: Fault = Fault { spn: 629, fmi: 12 };

const FUEL_PRESSURE: u16 = 94;
const FUEL_LEVEL: u16 = 96;
const OIL_PRESSURE: u16 = 100;
const COOLANT_TEMPERATURE: u16 = 110;
const CHARGE_VOLTAGE: u16 = 167;
const BATTERY_VOLTAGE: u16 = 168;
const OIL_TEMPERATURE: u16 = 175;
const ENGINE_SPEED: u16 = 190;

/// Seconds for which a voltage must be wrong: the starter is no fault of its own.
const VOLTAGE_SECONDS: f64 = 10.0;

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
    /// The site's lever: its cable is cut.
    pub(super) cut: bool,
    /// An injected warning: it is sick.
    pub(super) sick: bool,
    /// kW and L/h of the last seconds.
    power: f64,
    burn: f64,
    /// Seconds.
    battery_low_for: f64,
    uncharged_for: f64,
    /// While it should be heard and is not.
    silence: Duration,
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
            cut: false,
            sick: false,
            power: 0.0,
            burn: 0.0,
            battery_low_for: 0.0,
            uncharged_for: 0.0,
            silence: Duration::ZERO,
            faults: [Fault::default(); FAULTS],
        }
    }

    /// `expected` says that the unit has been told of a J1939 engine.
    pub(super) fn step(&mut self, dt: Duration, plant: &Plant, sequence: &Sequence, expected: bool) {
        self.measure(dt.as_secs_f64(), plant);
        // The fuel output feeds it: without fuel it may be silent.
        let missed = self.cut && expected && sequence.is_committed();
        self.silence = if missed { self.silence + dt } else { Duration::ZERO };
        self.judge(dt.as_secs_f64(), plant, sequence);
        if self.cut || !expected {
            self.faults = [Fault::default(); FAULTS];
        }
    }

    /// Whether it has been silent for so long where it should be heard.
    pub(super) fn is_missed(&self, patience: Duration) -> bool {
        !self.silence.is_zero() && self.silence >= patience
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

    fn measure(&mut self, dt: f64, plant: &Plant) {
        let running = plant.engine.is_running();
        let load = (plant.genset.total_active() / RATED_KW).max(0.0);
        let speed = plant.engine.speed / RATED_RPM;
        let boost = if running { 0.06 + 1.3 * load } else { 0.0 };
        approach(&mut self.boost, boost, 1.5, dt);
        // A pump that draws air gives next to nothing.
        let most = if plant.engine.firing { 3.6 } else { 1.2 };
        approach(&mut self.fuel_pressure, most * speed.min(1.0), 0.6, dt);
        approach(&mut self.air_filter, speed * speed * (1.1 + 1.4 * self.boost), 0.5, dt);

        let (fuel, manifold, exhaust) = match running {
            true => (plant.canopy + 8.0, plant.canopy + 12.0 + 22.0 * self.boost, 140.0 + 380.0 * load),
            false => (plant.canopy, plant.canopy, plant.canopy),
        };
        approach(&mut self.fuel, fuel, 200.0, dt);
        approach(&mut self.manifold, manifold, 30.0, dt);
        approach(&mut self.exhaust, exhaust, if running { 15.0 } else { 120.0 }, dt);
        approach(&mut self.power, plant.genset.total_active().max(0.0), 2.0, dt);
        approach(&mut self.burn, plant.engine.burn, 2.0, dt);
    }

    /// The ECU has limits of its own, with which its maker has delivered it.
    fn judge(&mut self, dt: f64, plant: &Plant, sequence: &Sequence) {
        let (engine, battery) = (&plant.engine, &plant.batteries[0]);
        let up = sequence.is_up_to_speed();
        let lasting = |seconds: &mut f64, wrong: bool| {
            *seconds = if wrong { *seconds + dt } else { 0.0 };
            *seconds >= VOLTAGE_SECONDS
        };
        let battery_low = lasting(&mut self.battery_low_for, battery.voltage < 23.0);
        let uncharged = lasting(&mut self.uncharged_for, up && battery.charge_input < 20.0);
        let fuel = plant.tank.percent();
        let found = [
            worst(COOLANT_TEMPERATURE, engine.coolant > 105.0, FAR_ABOVE, engine.coolant > 98.0, ABOVE),
            worst(
                OIL_PRESSURE,
                up && engine.oil_pressure < 1.0,
                FAR_BELOW,
                up && engine.oil_pressure < 1.5,
                BELOW,
            ),
            worst(OIL_TEMPERATURE, engine.oil > 125.0, FAR_ABOVE, engine.oil > 118.0, ABOVE),
            worst(ENGINE_SPEED, engine.speed > 1725.0, FAR_ABOVE, engine.speed > 1600.0, ABOVE),
            worst(
                FUEL_PRESSURE,
                up && self.fuel_pressure < 0.5,
                FAR_BELOW,
                up && self.fuel_pressure < 2.0,
                BELOW,
            ),
            worst(FUEL_LEVEL, fuel < 3.0, FAR_BELOW, fuel < 20.0, BELOW_LEAST),
            worst(BATTERY_VOLTAGE, false, FAR_BELOW, battery_low, BELOW),
            worst(CHARGE_VOLTAGE, false, FAR_BELOW, uncharged, BELOW),
            self.sick.then_some(SICK),
        ];
        let mut rows = found.into_iter().flatten();
        self.faults = std::array::from_fn(|_| rows.next().unwrap_or_default());
    }
}

/// The worse of two failure modes of one parameter.
fn worst(spn: u16, first: bool, mode: u8, second: bool, lesser: u8) -> Option<Fault> {
    match (first, second) {
        (true, _) => Some(Fault { spn, fmi: mode }),
        (_, true) => Some(Fault { spn, fmi: lesser }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Tank;

    fn bench() -> (Plant, Ecu) {
        let plant = Plant::new(1);
        let ecu = Ecu::new(&plant);
        (plant, ecu)
    }

    fn codes(ecu: &mut Ecu, plant: &Plant) -> Vec<(u16, u8)> {
        ecu.step(Duration::from_secs(5), plant, &Sequence::new(), true);
        ecu.faults().iter().filter(|fault| fault.spn > 0).map(|fault| (fault.spn, fault.fmi)).collect()
    }

    #[test]
    fn faults_fill_the_rows_from_the_first_on() {
        let (mut plant, mut ecu) = bench();
        assert_eq!(codes(&mut ecu, &plant), []);
        plant.tank = Tank::new(15.0);
        assert_eq!(codes(&mut ecu, &plant), [(96, 17)]);
        plant.batteries[0].voltage = 22.0;
        plant.engine.coolant = 100.0;
        assert_eq!(codes(&mut ecu, &plant), [(110, 16), (96, 17)]);
        assert_eq!(codes(&mut ecu, &plant), [(110, 16), (96, 17), (168, 18)]);
        plant.tank = Tank::new(80.0);
        plant.engine.coolant = 106.0;
        assert_eq!(codes(&mut ecu, &plant), [(110, 0), (168, 18)]);
    }

    #[test]
    fn a_sick_one_says_so_and_a_cut_one_says_nothing() {
        let (mut plant, mut ecu) = bench();
        ecu.sick = true;
        assert_eq!(codes(&mut ecu, &plant), [(629, 12)]);
        plant.tank = Tank::new(2.0);
        assert_eq!(codes(&mut ecu, &plant), [(96, 1), (629, 12)]);
        ecu.cut = true;
        assert_eq!(codes(&mut ecu, &plant), []);
        assert!(!ecu.is_missed(Duration::ZERO), "nobody misses it while the engine stands");
    }
}
