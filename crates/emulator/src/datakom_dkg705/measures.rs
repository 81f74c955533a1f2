//! What the unit reads of its plant: through transformers, senders and switches that have their own idea of it.

use crate::plant::{Feed, HERTZ_PER_RPM, Plant};

use super::parameters::Options;

/// What an open circuit looks like: the end of a sender's scale that belongs to an endless resistance.
const OPEN_OIL_PRESSURE: f64 = 10.0;
const OPEN_COOLANT: f64 = 0.0;
const OPEN_FUEL_LEVEL: f64 = 100.0;

/// One moment of the plant, as the unit sees it.
#[derive(Clone, Debug)]
pub(super) struct Measures {
    pub(super) mains: Feed,
    pub(super) genset: Feed,
    /// 1/min.
    pub(super) speed: f64,
    /// bar.
    pub(super) oil_pressure: f64,
    /// degC.
    pub(super) coolant: f64,
    /// degC.
    pub(super) oil: f64,
    /// Percent.
    pub(super) fuel_level: f64,
    /// V.
    pub(super) battery: f64,
    pub(super) charge_input: f64,
    pub(super) external_dc: f64,
    /// bar and degC at the switches, which need no sender.
    pub(super) oil_pressure_at_switch: f64,
    pub(super) coolant_at_switch: f64,
}

impl Measures {
    /// `swapped` are two wires of the genset's voltages.
    pub(super) fn of(plant: &Plant, options: &Options, swapped: bool) -> Self {
        let [battery, external] = &plant.batteries;
        let readings = plant.readings();
        let mains_transformers = if options.mains_transformers { options.transformers } else { 0.0 };
        let speed = match options.rpm_from_frequency {
            true => Some(plant.genset.frequency / HERTZ_PER_RPM),
            // A pickup that tells nothing looks like an engine that stands.
            false => readings.speed,
        };
        Self {
            mains: transformed(&plant.mains, mains_transformers),
            genset: Feed { phase_order_wrong: swapped, ..transformed(&plant.genset, options.transformers) },
            speed: speed.unwrap_or(0.0),
            oil_pressure: readings.oil_pressure.unwrap_or(OPEN_OIL_PRESSURE),
            coolant: readings.coolant.unwrap_or(OPEN_COOLANT),
            oil: plant.engine.oil,
            fuel_level: readings.fuel_level.unwrap_or(OPEN_FUEL_LEVEL),
            battery: battery.voltage,
            charge_input: battery.charge_input,
            external_dc: external.voltage,
            oil_pressure_at_switch: plant.engine.oil_pressure,
            coolant_at_switch: plant.engine.coolant,
        }
    }
}

/// Whoever has set another ratio than that of the transformers reads other currents, and powers with them.
fn transformed(feed: &Feed, part: f64) -> Feed {
    let times = |phases: [f64; 3]| phases.map(|phase| phase * part);
    Feed { active: times(feed.active), reactive: times(feed.reactive), ..feed.clone() }
}
