//! Values held against a limit: which alarm each makes, when it looks, and how long it waits.

use std::time::Duration;

use super::alarms::Word::{self, *};
use super::measures::Measures;
use super::parameters::{Limits, Timers};

/// When a watch looks.
#[derive(Clone, Copy, Debug)]
pub(super) enum Live {
    Always,
    /// The starter dips the battery.
    NotCranking,
    /// From the first crank on.
    Fuelled,
    UpToSpeed,
}

/// A value held against a limit.
pub(super) struct Watch {
    pub(super) word: Word,
    pub(super) bit: u16,
    pub(super) live: Live,
    pub(super) delay: fn(&Timers) -> Duration,
    /// What must be between the value and the limit for a warning to go.
    pub(super) hysteresis: f64,
    /// By how much the value is beyond its limit.
    pub(super) excess: fn(&Measures, &Limits) -> f64,
}

const fn watch(
    (word, bit): (Word, u16),
    live: Live,
    delay: fn(&Timers) -> Duration,
    hysteresis: f64,
    excess: fn(&Measures, &Limits) -> f64,
) -> Watch {
    Watch { word, bit, live, delay, hysteresis, excess }
}

/// A limit of 0 is not watched.
fn above(value: f64, limit: f64) -> f64 {
    if limit > 0.0 { value - limit } else { f64::NEG_INFINITY }
}

fn below(value: f64, limit: f64) -> f64 {
    if limit > 0.0 { limit - value } else { f64::NEG_INFINITY }
}

/// By how much more than its limit a speed must be to count at once, and before the engine is up to it.
const FAR: f64 = 1.12;

const AT_ONCE: fn(&Timers) -> Duration = |_| Duration::ZERO;
const USUAL: fn(&Timers) -> Duration = |timers| timers.alarm;
const FUEL: fn(&Timers) -> Duration = |timers| timers.fuel_alarm;
const BATTERY: fn(&Timers) -> Duration = |timers| timers.battery_alarm;
const OVERLOAD: fn(&Timers) -> Duration = |timers| timers.overload;
const REVERSE: fn(&Timers) -> Duration = |timers| timers.reverse_power;

use Live::{Always, Fuelled, NotCranking, UpToSpeed};

pub(super) const WATCHES: [Watch; 29] = [
    watch((Shutdown1, 0), UpToSpeed, USUAL, 0.0, |m, s| {
        below(m.oil_pressure_at_switch, s.oil_pressure_switch)
    }),
    watch((Shutdown1, 1), Always, USUAL, 0.0, |m, s| above(m.coolant_at_switch, s.coolant_switch)),
    watch((Shutdown1, 9), UpToSpeed, USUAL, 0.0, |m, s| below(m.genset.frequency, s.low_frequency_shutdown)),
    watch((Shutdown1, 10), UpToSpeed, USUAL, 0.0, |m, s| {
        above(m.genset.frequency, s.high_frequency_shutdown)
    }),
    watch((Shutdown1, 10), Fuelled, AT_ONCE, 0.0, |m, s| {
        above(m.genset.frequency, FAR * s.high_frequency_shutdown)
    }),
    watch((Shutdown1, 11), Always, USUAL, 0.0, |m, s| above(m.battery, s.high_battery_shutdown)),
    watch((Shutdown1, 12), Always, FUEL, 0.0, |m, s| below(m.fuel_level, s.low_fuel_shutdown)),
    watch((Shutdown1, 13), Always, USUAL, 0.0, |m, s| {
        above(m.oil - s.oil_margin, s.high_temperature_shutdown)
    }),
    watch((Shutdown1, 14), Always, USUAL, 0.0, |m, s| above(m.coolant, s.high_temperature_shutdown)),
    watch((Shutdown1, 15), UpToSpeed, USUAL, 0.0, |m, s| below(m.oil_pressure, s.low_oil_pressure_shutdown)),
    watch((Shutdown2, 2), UpToSpeed, USUAL, 0.0, |m, s| {
        below(lowest(m.genset.voltage), s.low_voltage_shutdown)
    }),
    watch((Shutdown2, 3), UpToSpeed, USUAL, 0.0, |m, s| {
        above(highest(m.genset.voltage), s.high_voltage_shutdown)
    }),
    watch((Shutdown2, 6), UpToSpeed, USUAL, 0.0, |m, s| below(m.speed, s.low_rpm_shutdown)),
    watch((Shutdown2, 7), UpToSpeed, USUAL, 0.0, |m, s| above(m.speed, s.high_rpm_shutdown)),
    watch((Shutdown2, 7), Fuelled, AT_ONCE, 0.0, |m, s| above(m.speed, FAR * s.high_rpm_shutdown)),
    watch((LoadDump, 13), UpToSpeed, REVERSE, 0.0, |m, s| above(-m.genset.total_active(), s.reverse_power)),
    watch((LoadDump, 14), UpToSpeed, OVERLOAD, 0.0, |m, s| above(m.genset.total_active(), s.excess_power)),
    watch((LoadDump, 15), UpToSpeed, OVERLOAD, 0.0, |m, s| above(highest(m.genset.current()), s.overcurrent)),
    watch((Warning2, 9), UpToSpeed, USUAL, 0.3, |m, s| below(m.genset.frequency, s.low_frequency_warning)),
    watch((Warning2, 10), UpToSpeed, USUAL, 0.3, |m, s| above(m.genset.frequency, s.high_frequency_warning)),
    watch((Warning2, 11), Always, USUAL, 0.5, |m, s| above(m.battery, s.high_battery_warning)),
    watch((Warning2, 12), Always, FUEL, 2.0, |m, s| below(m.fuel_level, s.low_fuel_warning)),
    watch((Warning2, 13), Always, USUAL, 3.0, |m, s| above(m.oil - s.oil_margin, s.high_temperature_warning)),
    watch((Warning2, 14), Always, USUAL, 3.0, |m, s| above(m.coolant, s.high_temperature_warning)),
    watch((Warning2, 15), UpToSpeed, USUAL, 0.3, |m, s| below(m.oil_pressure, s.low_oil_pressure_warning)),
    watch((Warning3, 2), UpToSpeed, BATTERY, 2.0, |m, s| below(m.charge_input, s.low_charge)),
    watch((Warning3, 3), NotCranking, BATTERY, 0.5, |m, s| below(m.battery, s.low_battery_warning)),
    watch((Warning3, 6), UpToSpeed, USUAL, 10.0, |m, s| below(m.speed, s.low_rpm_warning)),
    watch((Warning3, 7), UpToSpeed, USUAL, 10.0, |m, s| above(m.speed, s.high_rpm_warning)),
];

fn lowest(phases: [f64; 3]) -> f64 {
    phases.into_iter().fold(f64::INFINITY, f64::min)
}

fn highest(phases: [f64; 3]) -> f64 {
    phases.into_iter().fold(0.0, f64::max)
}
