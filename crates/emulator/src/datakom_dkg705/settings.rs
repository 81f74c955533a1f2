//! The parameters at 1000h: what the imitated site has set, in units of the table.

/// Seconds, volts, hertz, degC and the rest as they stand in the registers.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    pub(super) no_break_transfer: bool,
    pub(super) soft_transfer: bool,
    /// In TEST the genset takes the load when the mains fail.
    pub(super) emergency_backup: bool,
    pub(super) current_transformer: u16,

    pub(super) low_oil_pressure_shutdown: f64,
    pub(super) low_oil_pressure_warning: f64,
    pub(super) high_temperature_shutdown: f64,
    pub(super) high_temperature_warning: f64,
    pub(super) high_frequency_shutdown: f64,
    pub(super) high_frequency_warning: f64,
    pub(super) low_frequency_shutdown: f64,
    pub(super) low_frequency_warning: f64,
    pub(super) high_voltage_shutdown: f64,
    pub(super) low_voltage_shutdown: f64,
    pub(super) mains_voltage_high: f64,
    pub(super) mains_voltage_low: f64,
    pub(super) hysteresis_voltage: f64,
    pub(super) high_battery_shutdown: f64,
    pub(super) high_battery_warning: f64,
    pub(super) low_battery_warning: f64,
    pub(super) overcurrent: f64,
    pub(super) excess_power: f64,
    pub(super) heating_temperature: f64,
    pub(super) start_attempts: u8,

    pub(super) idle: u64,
    pub(super) overload: u64,
    pub(super) stop: u64,
    pub(super) crank: u64,
    pub(super) preheat: u64,
    pub(super) wait_between_starts: u64,
    pub(super) wait_before_fuel: u64,
    pub(super) cooldown: u64,
    pub(super) mains_waiting: u64,
    pub(super) genset_contactor: u64,
    pub(super) mains_contactor: u64,
    pub(super) heating: u64,
    pub(super) horn: u64,

    /// Engine hours and days between two services.
    pub(super) service_hours: f64,
    pub(super) service_days: f64,
}

/// A 100 kVA set at a small site. The cool-down and the wait for the mains are shorter than a real site's, so that
/// they can be watched.
pub(super) const SITE: Settings = Settings {
    no_break_transfer: true,
    soft_transfer: true,
    emergency_backup: true,
    current_transformer: 200,

    low_oil_pressure_shutdown: 1.0,
    low_oil_pressure_warning: 1.5,
    high_temperature_shutdown: 105.0,
    high_temperature_warning: 98.0,
    high_frequency_shutdown: 55.0,
    high_frequency_warning: 53.0,
    low_frequency_shutdown: 45.0,
    low_frequency_warning: 47.0,
    high_voltage_shutdown: 260.0,
    low_voltage_shutdown: 190.0,
    mains_voltage_high: 260.0,
    mains_voltage_low: 184.0,
    hysteresis_voltage: 8.0,
    high_battery_shutdown: 31.0,
    high_battery_warning: 30.0,
    low_battery_warning: 23.0,
    overcurrent: 150.0,
    excess_power: 90.0,
    heating_temperature: 40.0,
    start_attempts: 3,

    idle: 4,
    overload: 5,
    stop: 12,
    crank: 6,
    preheat: 3,
    wait_between_starts: 8,
    wait_before_fuel: 3,
    cooldown: 30,
    mains_waiting: 20,
    genset_contactor: 2,
    mains_contactor: 2,
    heating: 8,
    horn: 30,

    service_hours: 250.0,
    service_days: 180.0,
};
