//! What an ACC1700 measures: sensors at its terminals, and what the ECU of an ACC1700CAN sends.

use crate::plant::Compressor;

use super::Model;

/// V from which a charge alternator is at work.
const CHARGES: f64 = 10.0;

/// One measured value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reading {
    Value(f64),
    /// Nothing is connected there, or nobody sends it.
    Absent,
    /// The sensor's wire is broken.
    Broken,
    /// The sensor's wires touch.
    Shorted,
}

impl Reading {
    pub(super) fn value(self) -> Option<f64> {
        match self {
            Self::Value(value) => Some(value),
            Self::Absent | Self::Broken | Self::Shorted => None,
        }
    }
}

/// Everything measured, in the units of the registers.
#[derive(Clone, Debug)]
pub(super) struct Readings {
    /// rpm.
    pub(super) speed: Reading,
    /// degC.
    pub(super) coolant: Reading,
    /// kPa.
    pub(super) oil_pressure: Reading,
    /// Percent.
    pub(super) fuel_level: Reading,
    /// kPa.
    pub(super) discharge_pressure: Reading,
    /// degC.
    pub(super) discharge_temperature: Reading,
    /// Percent of what the engine can give at its speed.
    pub(super) engine_load: Reading,
    /// V.
    pub(super) battery: f64,
    /// V.
    pub(super) charger: f64,
    /// Auxiliary sensors 1 to 5.
    pub(super) sensors: [Reading; 5],
    /// The first so many of them are the engine's own.
    of_the_engine: usize,
}

impl Readings {
    pub(super) fn of(plant: &Compressor, model: Model, ecu_talks: bool) -> Self {
        let (engine, discharge) = (plant.readings(), plant.discharge());
        let oil_pressure = engine.oil_pressure.map(|bar| bar * 100.0);
        // A pickup without pulses looks like an engine that stands.
        let speed = Some(engine.speed.unwrap_or_default());
        let sent = |value: Option<f64>| match value {
            Some(value) if ecu_talks => Reading::Value(value),
            _ => Reading::Absent,
        };
        let fuel_level = wired(engine.fuel_level);
        let pressure = wired(discharge.pressure);
        let temperature = match discharge.temperature_shorted {
            true => Reading::Shorted,
            false => wired(discharge.temperature),
        };
        let (speed, coolant, oil_pressure, first, second) = match model {
            Model::Acc1700 => {
                let (coolant, oil) = (wired(engine.coolant), wired(oil_pressure));
                (wired(speed), coolant, oil, coolant, oil)
            }
            Model::Acc1700Can => {
                let separator = wired(discharge.separator_loss);
                (sent(speed), sent(engine.coolant), sent(oil_pressure), Reading::Absent, separator)
            }
        };
        let [battery, charger] = plant.voltages();
        Self {
            speed,
            coolant,
            oil_pressure,
            fuel_level,
            discharge_pressure: pressure,
            discharge_temperature: temperature,
            engine_load: if model == Model::Acc1700 { Reading::Absent } else { sent(Some(plant.load())) },
            battery,
            charger,
            sensors: [first, second, fuel_level, temperature, pressure],
            of_the_engine: if model == Model::Acc1700 { 2 } else { 0 },
        }
    }

    /// Whether a sensor, counted from 0, is that of the engine's temperature or oil pressure.
    pub(super) fn is_of_the_engine(&self, sensor: usize) -> bool {
        sensor < self.of_the_engine
    }

    /// Whether the engine is seen to turn, by anything that tells of it, faster than these.
    pub(super) fn turns(&self, speed: f64, oil_pressure: f64) -> bool {
        let oiled = self.oil_pressure.value().is_some_and(|found| found > oil_pressure);
        oiled
            || match self.speed.value().filter(|rpm| *rpm > 0.0) {
                Some(rpm) => rpm > speed,
                // No pulses: a charge alternator at work gives more than its lamp.
                None => self.charger > CHARGES,
            }
    }
}

/// What comes over a wire of its own.
fn wired(value: Option<f64>) -> Reading {
    value.map_or(Reading::Broken, Reading::Value)
}
