//! The weather at a site, and its hour of the day.

use std::f64::consts::TAU;

use crate::random::{Drift, Random, approach};

#[derive(Clone, Debug)]
pub(super) struct Climate {
    /// degC at which it is held; none where it follows the day.
    pub(super) held: Option<f64>,
    outside: f64,
    weather: Drift,
}

impl Climate {
    pub(super) fn new(random: &mut Random) -> Self {
        Self { held: None, outside: 20.0, weather: Drift::new(0.4, 600.0, random) }
    }

    /// Power-on is ten in the morning.
    pub(super) fn hour(time: f64) -> f64 {
        10.0 + time / 3600.0
    }

    /// degC outside.
    pub(super) fn outside(&self) -> f64 {
        self.outside + self.weather.value()
    }

    /// degC outside.
    pub(super) fn step(&mut self, dt: f64, time: f64, random: &mut Random) -> f64 {
        // The warmest hour is three in the afternoon.
        let day = 4.0 * ((Self::hour(time) - 9.0) / 24.0 * TAU).sin();
        approach(&mut self.outside, self.held.unwrap_or(19.0 + day), 120.0, dt);
        self.weather.step(dt, random);
        self.outside()
    }
}
