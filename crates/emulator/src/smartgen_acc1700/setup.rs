//! What an ACC1700 is set to: delays, thresholds, and what its inputs, sensors and countdowns lead to.

use std::time::Duration;

use crate::settings::Settings;

use super::sequence::Status;

/// Everything that can be set, read once so that no step looks for a name.
#[derive(Clone, Debug)]
pub(super) struct Setup {
    /// Of every status, by its code.
    delays: [Duration; 16],
    pub(super) attempts: u8,
    pub(super) disconnect_speed: f64,
    pub(super) disconnect_oil_pressure: f64,
    pub(super) load_pressure: f64,
    pub(super) unload_pressure: f64,
    pub(super) stop_pressure: f64,
    pub(super) stop_pressure_time: Duration,
    pub(super) overload_limit: f64,
    pub(super) overload_delay: Duration,
    pub(super) overload_rest: Duration,
    pub(super) heating: Duration,
    pub(super) overspeed: Limits,
    pub(super) underspeed: Limits,
    pub(super) speed_loss: Action,
    pub(super) speed_loss_delay: Duration,
    pub(super) engine_temperature: Limits,
    pub(super) low_engine_temperature: f64,
    pub(super) oil_pressure: Limits,
    pub(super) discharge_pressure: Limits,
    pub(super) battery_high: f64,
    pub(super) battery_low: f64,
    pub(super) battery_delay: Duration,
    pub(super) charging_low: f64,
    pub(super) charging_delay: Duration,
    pub(super) ecu_silence: Duration,
    pub(super) inputs: [InputSetup; 5],
    pub(super) sensors: [SensorSetup; 5],
    pub(super) sensor_delay: Duration,
    pub(super) services: [ServiceSetup; 10],
}

/// A warning and a shutdown of one quantity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) warning: f64,
    pub(super) shutdown: f64,
    pub(super) delay: Duration,
}

/// What something leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Nothing,
    Indication,
    Warning,
    Shutdown,
}

/// What an active input means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Whatever the site has wired to it.
    Own(Action),
    LowCoolant,
    HighTemperature,
    LowOilPressure,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct InputSetup {
    pub(super) meaning: Meaning,
    pub(super) delay: Duration,
    /// It counts as active while its contact is open.
    pub(super) active_open: bool,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct SensorSetup {
    pub(super) open: Action,
    pub(super) high: (f64, f64),
    pub(super) low: (f64, f64),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct ServiceSetup {
    /// Seconds of running between two services.
    pub(super) interval: u64,
    pub(super) due: Action,
}

impl Setup {
    pub(super) fn of(settings: &Settings) -> Self {
        let (number, seconds) = (|id: &str| settings.number(id), |id: &str| settings.seconds(id));
        let limits = |shutdown: &str, warning: &str, delay: &str| Limits {
            warning: number(warning),
            shutdown: number(shutdown),
            delay: seconds(delay),
        };
        Self {
            delays: delays(settings),
            attempts: number("start_attempts") as u8,
            disconnect_speed: number("crank_disconnect_speed"),
            disconnect_oil_pressure: number("crank_disconnect_oil_pressure"),
            load_pressure: number("load_pressure"),
            unload_pressure: number("unload_pressure"),
            stop_pressure: number("stop_pressure"),
            stop_pressure_time: seconds("stop_pressure_time"),
            overload_limit: number("overload_limit"),
            overload_delay: seconds("overload_delay"),
            overload_rest: seconds("overload_rest_time"),
            heating: seconds("heating_time"),
            overspeed: limits("overspeed_shutdown", "overspeed_warning", "overspeed_delay"),
            underspeed: limits("underspeed_shutdown", "underspeed_warning", "underspeed_delay"),
            speed_loss: Action::of(number("speed_loss_action")),
            speed_loss_delay: seconds("speed_loss_delay"),
            engine_temperature: limits(
                "high_engine_temperature_shutdown",
                "high_engine_temperature_warning",
                "engine_temperature_delay",
            ),
            low_engine_temperature: number("low_engine_temperature_warning"),
            oil_pressure: limits(
                "low_oil_pressure_shutdown",
                "low_oil_pressure_warning",
                "oil_pressure_delay",
            ),
            discharge_pressure: limits(
                "high_discharge_pressure_shutdown",
                "high_discharge_pressure_warning",
                "discharge_pressure_delay",
            ),
            battery_high: number("battery_overvoltage_warning"),
            battery_low: number("battery_undervoltage_warning"),
            battery_delay: seconds("battery_delay"),
            charging_low: number("charging_failure_warning_voltage"),
            charging_delay: seconds("charging_failure_delay"),
            ecu_silence: seconds("ecu_silence_time"),
            inputs: std::array::from_fn(|input| InputSetup::of(settings, input + 1)),
            sensors: std::array::from_fn(|sensor| SensorSetup::of(settings, sensor + 1)),
            sensor_delay: seconds("sensor_delay"),
            services: std::array::from_fn(|service| ServiceSetup::of(settings, service + 1)),
        }
    }

    /// How long a status lasts; nothing where it waits for something else.
    pub(super) fn delay(&self, status: Status) -> Duration {
        self.delays.get(status as usize).copied().unwrap_or_default()
    }
}

fn delays(settings: &Settings) -> [Duration; 16] {
    let mut delays = [Duration::ZERO; 16];
    for (status, id) in [
        (Status::Preheat, "preheat_time"),
        (Status::FuelOutput, "fuel_output_time"),
        (Status::Crank, "crank_time"),
        (Status::CrankRest, "crank_rest_time"),
        (Status::SafetyOn, "safety_on_time"),
        (Status::StartIdle, "start_idle_time"),
        (Status::WarmingUp, "warming_up_time"),
        (Status::Cooling, "cooling_time"),
        (Status::StopIdle, "stop_idle_time"),
        (Status::EnergiseToStop, "energise_to_stop_time"),
        (Status::WaitForStop, "wait_for_stop_time"),
        (Status::AfterStop, "after_stop_time"),
    ] {
        delays[status as usize] = settings.seconds(id);
    }
    delays
}

impl Action {
    fn of(code: f64) -> Self {
        match code as u8 {
            1 => Self::Indication,
            2 => Self::Warning,
            3 => Self::Shutdown,
            _ => Self::Nothing,
        }
    }
}

impl InputSetup {
    fn of(settings: &Settings, number: usize) -> Self {
        let code = settings.number(&format!("input_{number}_action"));
        Self {
            meaning: match code as u8 {
                4 => Meaning::LowCoolant,
                5 => Meaning::HighTemperature,
                6 => Meaning::LowOilPressure,
                _ => Meaning::Own(Action::of(code)),
            },
            delay: settings.seconds(&format!("input_{number}_delay")),
            active_open: settings.is_on(&format!("input_{number}_active_open")),
        }
    }
}

impl SensorSetup {
    fn of(settings: &Settings, number: usize) -> Self {
        let of = |what: &str| settings.number(&format!("sensor_{number}_{what}"));
        Self {
            open: Action::of(of("open_action")),
            high: (of("high_warning"), of("high_shutdown")),
            low: (of("low_warning"), of("low_shutdown")),
        }
    }
}

impl ServiceSetup {
    fn of(settings: &Settings, number: usize) -> Self {
        let of = |what: &str| settings.number(&format!("maintenance_{number}_{what}"));
        Self { interval: (of("interval") * 3600.0) as u64, due: Action::of(of("action")) }
    }
}

#[cfg(test)]
impl Setup {
    /// As the profile has it, but for some.
    pub(super) fn with(changes: &[(&str, &str)]) -> Self {
        let mut settings = Settings::of(busbar_profile::builtin(super::PROFILE).unwrap());
        for (id, text) in changes {
            settings.set(id, text).unwrap();
        }
        Self::of(&settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_of_the_profile_changes_something() {
        let profile = busbar_profile::builtin(super::super::PROFILE).unwrap();
        let usual = format!("{:?}", Setup::with(&[]));
        for setting in &profile.settings {
            // One of its ends is not what it is set to.
            let ends = [setting.min, setting.max]
                .map(|end| format!("{:?}", Setup::with(&[(&setting.id, &end.to_string())])));
            assert!(ends.iter().any(|changed| *changed != usual), "{} does nothing", setting.id);
        }
        assert!(profile.settings.len() > 100);
    }

    #[test]
    fn codes_of_inputs_and_actions_are_those_that_the_profile_names() {
        for (code, meaning) in [
            ("0", Meaning::Own(Action::Nothing)),
            ("1", Meaning::Own(Action::Indication)),
            ("2", Meaning::Own(Action::Warning)),
            ("3", Meaning::Own(Action::Shutdown)),
            ("4", Meaning::LowCoolant),
            ("5", Meaning::HighTemperature),
            ("6", Meaning::LowOilPressure),
        ] {
            assert_eq!(Setup::with(&[("input_4_action", code)]).inputs[3].meaning, meaning);
        }
    }
}
