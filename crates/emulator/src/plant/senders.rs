//! What the senders of the engine tell a panel: the truth, or nothing where one is broken.

use super::{Engine, Tank};

/// Which of them are broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Senders {
    pub(super) oil_pressure: bool,
    pub(super) temperature: bool,
    pub(super) fuel_level: bool,
    pub(super) pickup: bool,
}

/// What is read at this moment; nothing from a broken sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Readings {
    /// bar.
    pub(crate) oil_pressure: Option<f64>,
    /// degC of the coolant.
    pub(crate) coolant: Option<f64>,
    /// Percent in the tank.
    pub(crate) fuel_level: Option<f64>,
    /// 1/min from the magnetic pickup. One that is broken looks like an engine that stands.
    pub(crate) speed: Option<f64>,
}

impl Senders {
    pub(super) fn read(self, engine: &Engine, tank: &Tank) -> Readings {
        let unless = |broken: bool, value: f64| (!broken).then_some(value);
        Readings {
            oil_pressure: unless(self.oil_pressure, engine.oil_pressure),
            coolant: unless(self.temperature, engine.coolant),
            fuel_level: unless(self.fuel_level, tank.percent()),
            speed: unless(self.pickup, engine.speed),
        }
    }
}
