//! What the unit is set to: the profile's emulator section, looked up once.

use std::time::Duration;

use crate::settings;

/// Timers and choices of the logic; the thresholds of alarms are in [`super::watch`].
#[derive(Clone, Debug, Default)]
pub(super) struct Settings {
    pub(super) start_delay: Duration,
    pub(super) preheat: Duration,
    pub(super) oil_flash_off: Duration,
    pub(super) start_attempts: u8,
    pub(super) crank: Duration,
    pub(super) crank_rest: Duration,
    pub(super) idle: Duration,
    pub(super) heating: Duration,
    pub(super) cooldown: Duration,
    pub(super) stop_idle: Duration,
    pub(super) stop: Duration,

    pub(super) genset_breaker: Duration,
    pub(super) mains_breaker: Duration,
    pub(super) breaker_fail: Duration,
    pub(super) no_break_transfer: bool,
    pub(super) soft_transfer: bool,
    pub(super) synchronizing: Duration,
    /// kW a second.
    pub(super) load_ramp: f64,
    pub(super) load_transfer: Duration,

    pub(super) mains: MainsSettings,

    pub(super) emergency_backup: bool,
    pub(super) slave: bool,
    pub(super) peak_lopping: bool,
    /// kW that the mains are to give at most.
    pub(super) peak_lopping_power: f64,
    pub(super) peak_lopping_delay: Duration,
    pub(super) peak_lopping_return: Duration,
    pub(super) power_export: bool,
    /// kW.
    pub(super) export_power: f64,
    /// s between two starts of the exerciser; it never starts where this is 0.
    pub(super) exerciser_interval: f64,
    /// s.
    pub(super) exerciser_duration: f64,
    pub(super) exerciser_on_load: bool,

    /// Hours and days between two services, for each of the three.
    pub(super) services: [[f64; 2]; 3],
    /// Volts and hertz between which the genset takes load.
    pub(super) genset_voltage: (f64, f64),
    pub(super) genset_frequency: (f64, f64),
    /// Below and above this the day tank's pump is switched, %.
    pub(super) fuel_pump: (f64, f64),
    /// kW of the genset above which consumers are shed, and below which they are added.
    pub(super) load_shedding: (f64, f64),
}

/// How the unit judges the mains.
#[derive(Clone, Debug, Default)]
pub(super) struct MainsSettings {
    /// V of a phase.
    pub(super) voltage: (f64, f64),
    pub(super) hysteresis: f64,
    /// Hz.
    pub(super) frequency: (f64, f64),
    pub(super) fail_delay: Duration,
    pub(super) waiting: Duration,
}

impl Settings {
    pub(super) fn of(settings: &settings::Settings) -> Self {
        let seconds = |id| settings.seconds(id);
        let number = |id| settings.number(id);
        let between = |low, high| (settings.number(low), settings.number(high));
        Self {
            start_delay: seconds("start_delay"),
            preheat: seconds("preheat_time"),
            oil_flash_off: seconds("oil_flash_off_time"),
            start_attempts: number("start_attempts") as u8,
            crank: seconds("crank_time"),
            crank_rest: seconds("crank_rest_time"),
            idle: seconds("idle_time"),
            heating: seconds("heating_time"),
            cooldown: seconds("cooldown_time"),
            stop_idle: seconds("stop_idle_time"),
            stop: seconds("stop_time"),
            genset_breaker: seconds("genset_breaker_time"),
            mains_breaker: seconds("mains_breaker_time"),
            breaker_fail: seconds("breaker_fail_time"),
            no_break_transfer: settings.is_on("no_break_transfer"),
            soft_transfer: settings.is_on("soft_transfer"),
            synchronizing: seconds("synchronizing_time"),
            load_ramp: number("load_ramp"),
            load_transfer: seconds("load_transfer_time"),
            mains: MainsSettings::of(settings),
            emergency_backup: settings.is_on("emergency_backup"),
            slave: settings.is_on("slave_unit"),
            peak_lopping: settings.is_on("peak_lopping"),
            peak_lopping_power: number("peak_lopping_power"),
            peak_lopping_delay: seconds("peak_lopping_delay"),
            peak_lopping_return: seconds("peak_lopping_return_delay"),
            power_export: settings.is_on("power_export"),
            export_power: number("export_power"),
            exerciser_interval: 3600.0 * number("exerciser_interval"),
            exerciser_duration: number("exerciser_duration"),
            exerciser_on_load: settings.is_on("exerciser_on_load"),
            services: [1, 2, 3].map(|service| {
                ["hours", "days"].map(|unit| settings.number(&format!("service_{service}_{unit}")))
            }),
            genset_voltage: between("genset_low_voltage_warning", "genset_high_voltage_warning"),
            genset_frequency: between("genset_low_frequency_warning", "genset_high_frequency_warning"),
            fuel_pump: between("fuel_pump_on", "fuel_pump_off"),
            load_shedding: between("load_add_power", "load_shed_power"),
        }
    }
}

impl MainsSettings {
    fn of(settings: &settings::Settings) -> Self {
        Self {
            voltage: (settings.number("mains_low_voltage"), settings.number("mains_high_voltage")),
            hysteresis: settings.number("mains_voltage_hysteresis"),
            frequency: (settings.number("mains_low_frequency"), settings.number("mains_high_frequency")),
            fail_delay: settings.seconds("mains_fail_delay"),
            waiting: settings.seconds("mains_waiting_time"),
        }
    }
}

#[cfg(test)]
impl Settings {
    /// As the profile has them.
    pub(super) fn usual() -> Self {
        Self::of(&settings::Settings::of(busbar_profile::builtin("datakom-d").unwrap()))
    }
}
