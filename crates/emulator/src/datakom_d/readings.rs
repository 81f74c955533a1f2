//! What the unit's terminals tell of the plant: the values that alarms are judged by, and what a broken sender hides.

use crate::plant::{self, HERTZ_PER_RPM, Plant};

/// Above this a meter takes a source for one that is there, V.
const ALIVE: f64 = 100.0;
/// Part of the coolant at which its switch in the radiator falls.
const COOLANT_SWITCH: f64 = 0.6;

/// One look at the plant.
#[derive(Clone, Debug, Default)]
pub(super) struct Readings {
    /// bar; none where the sender's wire is broken.
    pub(super) oil_pressure: Option<f64>,
    /// degC of the coolant.
    pub(super) temperature: Option<f64>,
    /// %.
    pub(super) fuel_level: Option<f64>,
    /// degC.
    pub(super) oil_temperature: f64,
    pub(super) canopy: f64,
    pub(super) ambient: f64,

    /// The coolant stands below its switch.
    pub(super) coolant_low: bool,

    /// 1/min by the magnetic pickup; a broken one looks like an engine that stands.
    pub(super) pickup: f64,
    /// 1/min by the pickup, else by the genset's frequency.
    pub(super) speed: f64,
    /// The engine turns by itself, or not at all.
    pub(super) running: bool,
    pub(super) turning: bool,

    /// V of the lowest and the highest phase, and the greatest distance from their mean in %.
    pub(super) genset_voltage: (f64, f64),
    pub(super) voltage_unbalance: f64,
    pub(super) genset_frequency: f64,
    /// A of the highest phase, and the greatest distance from their mean in %.
    pub(super) genset_current: f64,
    pub(super) current_unbalance: f64,
    /// kW and kvar of the genset, kW of the mains.
    pub(super) genset_active: f64,
    pub(super) genset_reactive: f64,
    pub(super) mains_active: f64,
    pub(super) mains_alive: bool,
    pub(super) mains_frequency: f64,
    pub(super) mains_in_order: bool,
    /// Both breakers are closed.
    pub(super) side_by_side: bool,
    /// Hz a second of the mains, and degrees by which the voltage has jumped; see [`super::loss_of_mains`].
    pub(super) rocof: f64,
    pub(super) vector_shift: f64,

    pub(super) battery: [f64; 2],
    pub(super) charge: f64,

    /// Contacts of the site.
    pub(super) emergency_stop: bool,
    pub(super) remote_start: bool,
    /// The day tank's pump has been told to run, s.
    pub(super) pumping: f64,
}

impl Readings {
    /// `pumping` is how long the pump has been told to run.
    pub(super) fn of(plant: &Plant, pumping: f64) -> Self {
        let (mains, genset) = (&plant.mains, &plant.genset);
        let current = genset.current();
        let plant::Readings { oil_pressure, coolant, fuel_level, speed } = plant.readings();
        Self {
            oil_pressure,
            temperature: coolant,
            fuel_level,
            coolant_low: plant.engine.coolant_level < COOLANT_SWITCH,
            oil_temperature: plant.engine.oil,
            canopy: plant.canopy,
            ambient: plant.ambient,
            pickup: speed.unwrap_or(0.0),
            speed: speed.unwrap_or(genset.frequency / HERTZ_PER_RPM),
            running: plant.engine.is_running(),
            turning: plant.engine.speed > 0.0,
            genset_voltage: (least(genset.voltage), greatest(genset.voltage)),
            voltage_unbalance: unbalance(genset.voltage),
            genset_frequency: genset.frequency,
            genset_current: greatest(current),
            current_unbalance: unbalance(current),
            genset_active: genset.total_active(),
            genset_reactive: genset.total_reactive(),
            mains_active: mains.total_active(),
            mains_alive: mains.average_voltage() > ALIVE,
            mains_frequency: mains.frequency,
            mains_in_order: !mains.phase_order_wrong,
            side_by_side: plant.mains_breaker.closed && plant.genset_breaker.closed,
            battery: [plant.batteries[0].voltage, plant.batteries[1].voltage],
            charge: plant.batteries[0].charge_input,
            emergency_stop: plant.emergency_stop,
            remote_start: plant.remote_start,
            pumping,
            ..Self::default()
        }
    }

    /// Whether the genset's voltage and frequency lie within limits.
    pub(super) fn genset_within(&self, volts: (f64, f64), hertz: (f64, f64)) -> bool {
        let (lowest, highest) = self.genset_voltage;
        lowest >= volts.0 && highest <= volts.1 && (hertz.0..=hertz.1).contains(&self.genset_frequency)
    }
}

fn least(phases: [f64; 3]) -> f64 {
    phases.into_iter().fold(f64::INFINITY, f64::min)
}

fn greatest(phases: [f64; 3]) -> f64 {
    phases.into_iter().fold(0.0, f64::max)
}

/// % by which one of them lies away from their mean; nothing where there is nothing to speak of.
fn unbalance(phases: [f64; 3]) -> f64 {
    let mean = phases.iter().sum::<f64>() / 3.0;
    match mean {
        1.0.. => phases.into_iter().map(|phase| (phase - mean).abs() / mean * 100.0).fold(0.0, f64::max),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unbalance_is_the_greatest_distance_from_the_mean() {
        assert_eq!(unbalance([0.0; 3]), 0.0);
        assert!((unbalance([90.0, 100.0, 110.0]) - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_genset_is_within_its_limits_with_every_phase() {
        let mut readings =
            Readings { genset_voltage: (225.0, 235.0), genset_frequency: 50.0, ..Readings::default() };
        let within = |readings: &Readings| readings.genset_within((207.0, 253.0), (47.0, 53.0));
        assert!(within(&readings));
        readings.genset_voltage.0 = 200.0;
        assert!(!within(&readings));
        readings.genset_voltage = (225.0, 260.0);
        assert!(!within(&readings));
        readings = Readings { genset_frequency: 46.0, genset_voltage: (225.0, 235.0), ..readings };
        assert!(!within(&readings));
    }
}
