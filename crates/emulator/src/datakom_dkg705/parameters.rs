//! What the unit is set to: the parameters at 1000h with the registers that show them, and what the table has none for.

use std::time::Duration;

use busbar_profile::{BitSet, Number, Point, Profile, Value, builtin};

use crate::settings::Settings;

/// The primary current of the site's transformers; their secondary is 5 A, and 1 A of it stands for a 200th.
const TRANSFORMERS: f64 = 200.0;
/// One unit of register 102Bh, in which the register holds tenths of what the profile says (see its `doubt`).
const EXERCISE_STEP: Duration = Duration::from_secs(10 * 60);

/// All of it, in volts, hertz, seconds and so on.
#[derive(Clone, Debug)]
pub(super) struct Parameters {
    pub(super) limits: Limits,
    pub(super) mains: MainsLimits,
    pub(super) timers: Timers,
    pub(super) start: Start,
    pub(super) transfer: Transfer,
    pub(super) peak: Option<Peak>,
    pub(super) parallel: ParallelLimits,
    pub(super) options: Options,
    pub(super) service: Service,
    pub(super) exercise: Exercise,
    /// The numbers at 1000h as their registers hold them.
    pub(super) numbers: Vec<(&'static Point, f64)>,
    /// The words and choices at 1000h.
    pub(super) words: Words,
}

/// What alarms are held against; a limit of 0 is not watched.
#[derive(Clone, Debug)]
pub(super) struct Limits {
    pub(super) low_oil_pressure_shutdown: f64,
    pub(super) low_oil_pressure_warning: f64,
    pub(super) high_temperature_shutdown: f64,
    pub(super) high_temperature_warning: f64,
    /// By how much oil may be hotter than coolant.
    pub(super) oil_margin: f64,
    pub(super) high_frequency_shutdown: f64,
    pub(super) high_frequency_warning: f64,
    pub(super) low_frequency_shutdown: f64,
    pub(super) low_frequency_warning: f64,
    pub(super) high_rpm_shutdown: f64,
    pub(super) high_rpm_warning: f64,
    pub(super) low_rpm_shutdown: f64,
    pub(super) low_rpm_warning: f64,
    pub(super) high_voltage_shutdown: f64,
    pub(super) low_voltage_shutdown: f64,
    pub(super) high_battery_shutdown: f64,
    pub(super) high_battery_warning: f64,
    pub(super) low_battery_warning: f64,
    pub(super) low_charge: f64,
    pub(super) low_external_dc: f64,
    pub(super) low_fuel_shutdown: f64,
    pub(super) low_fuel_warning: f64,
    pub(super) overcurrent: f64,
    pub(super) excess_power: f64,
    pub(super) reverse_power: f64,
    pub(super) load_shedding_high: f64,
    pub(super) load_shedding_low: f64,
    /// The switches on the engine, wired to inputs 0 and 1.
    pub(super) oil_pressure_switch: f64,
    pub(super) coolant_switch: f64,
}

/// When the mains are good, and since when they count as such.
#[derive(Clone, Debug)]
pub(super) struct MainsLimits {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) hysteresis: f64,
    pub(super) low_frequency: f64,
    pub(super) high_frequency: f64,
    pub(super) fail: Duration,
    pub(super) back: Duration,
    pub(super) waiting: Duration,
    /// A wrong phase order is as good as a right one.
    pub(super) any_order: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Timers {
    pub(super) overload: Duration,
    pub(super) stop: Duration,
    pub(super) cooldown: Duration,
    pub(super) genset_contactor: Duration,
    pub(super) mains_contactor: Duration,
    /// For the position of a contactor, after its timer.
    pub(super) contactor_wait: Duration,
    /// Zero: as long as there is an alarm.
    pub(super) horn: Duration,
    pub(super) alarm: Duration,
    pub(super) fuel_alarm: Duration,
    pub(super) battery_alarm: Duration,
    pub(super) reverse_power: Duration,
    pub(super) control_fail: Duration,
    pub(super) ecu_silence: Duration,
}

/// How the engine is started and made ready for its load.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub(super) attempts: u8,
    pub(super) wait_before_fuel: Duration,
    pub(super) preheat: Duration,
    pub(super) crank: Duration,
    pub(super) wait_between_starts: Duration,
    pub(super) idle: Duration,
    /// From idle speed to the first look at what an engine at speed has.
    pub(super) holdoff: Duration,
    pub(super) heating: Duration,
    /// degC that coolant and oil must have, where they count.
    pub(super) warm: f64,
    pub(super) by_coolant: bool,
    pub(super) by_oil: bool,
}

/// How the load moves between two live sources.
#[derive(Clone, Debug)]
pub(super) struct Transfer {
    pub(super) no_break: bool,
    /// Needs a governor that can be led, and to know what the mains carry.
    pub(super) soft: bool,
    pub(super) governor: Control,
    pub(super) exciter: Control,
    pub(super) timeout: Duration,
    /// Degrees, Hz and V within which a contactor may close.
    pub(super) angle: f64,
    pub(super) slip: f64,
    pub(super) volts: f64,
    /// kW a second.
    pub(super) ramp: f64,
}

/// An analog output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Control {
    pub(super) enabled: bool,
    /// More of it is meant to give less speed or voltage.
    pub(super) reversed: bool,
}

/// When the genset helps the mains, kW.
#[derive(Clone, Debug)]
pub(super) struct Peak {
    pub(super) start: f64,
    pub(super) mains: f64,
    pub(super) stop: f64,
    pub(super) delay: Duration,
}

/// What parts the genset from mains with which it runs in parallel.
#[derive(Clone, Debug)]
pub(super) struct ParallelLimits {
    pub(super) check: Duration,
    /// kW back into the mains.
    pub(super) reverse_power: f64,
    /// Hz a second.
    pub(super) rocof: f64,
    /// Degrees.
    pub(super) vector_shift: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Options {
    /// In TEST the genset takes the load when the mains fail.
    pub(super) emergency_backup: bool,
    pub(super) rpm_from_frequency: bool,
    /// What the unit takes a measured ampere for: 1 where the ratio is that of the transformers.
    pub(super) transformers: f64,
    pub(super) mains_transformers: bool,
    /// Another genset is expected on the busbar.
    pub(super) partner: bool,
    pub(super) without_partner: bool,
    pub(super) genset_on_load_warning: bool,
    pub(super) mains_on_load_warning: bool,
    /// A J1939 engine is connected.
    pub(super) ecu: bool,
}

/// Engine hours and days between two services; 0 does not count.
#[derive(Clone, Debug)]
pub(super) struct Service {
    pub(super) hours: f64,
    pub(super) days: f64,
    pub(super) warns: bool,
}

/// When the genset is exercised.
#[derive(Clone, Debug)]
pub(super) struct Exercise {
    /// Hours since Monday 00:00; none where it never is.
    pub(super) hour: Option<u16>,
    pub(super) every: Every,
    pub(super) duration: Duration,
    pub(super) on_load: bool,
    /// A test that somebody starts ends like an exercise.
    pub(super) by_buttons: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Every {
    Day,
    Week,
    /// On the first such day of a month.
    Month,
}

/// Registers 1002h, 1025h, 1026h and 102Ch.
#[derive(Clone, Debug)]
pub(super) struct Words {
    pub(super) multi_genset: BitSet,
    pub(super) mode_1: BitSet,
    pub(super) mode_2: BitSet,
    pub(super) mode_3: BitSet,
    pub(super) heating: u16,
    pub(super) exercise_period: u16,
}

impl Parameters {
    /// What the profile and those who overrode it have set.
    pub(super) fn of(settings: &Settings) -> Self {
        let set = Reader { settings, profile: builtin("datakom-dkg705") };
        Self {
            limits: set.limits(),
            mains: set.mains(),
            timers: set.timers(),
            start: set.start(),
            transfer: set.transfer(),
            peak: set.peak(),
            parallel: ParallelLimits {
                check: set.seconds("parallel_check_time"),
                reverse_power: set.number("mains_reverse_power"),
                rocof: set.number("rocof_limit"),
                vector_shift: set.number("vector_shift_limit"),
            },
            options: set.options(),
            service: Service {
                hours: set.number("service_interval_hours"),
                days: set.number("service_interval_days"),
                warns: set.is_on("warning_on_service_request"),
            },
            exercise: set.exercise(),
            numbers: set.numbers(),
            words: set.words(),
        }
    }
}

/// Settings as the registers hold them: what a register cannot hold, the unit does not know.
struct Reader<'a> {
    settings: &'a Settings,
    profile: Option<&'static Profile>,
}

impl Reader<'_> {
    fn number(&self, id: &str) -> f64 {
        let wanted = self.settings.number(id);
        self.profile.and_then(|profile| held(profile, profile.point(id)?, wanted)).unwrap_or(wanted)
    }

    fn seconds(&self, id: &str) -> Duration {
        Duration::try_from_secs_f64(self.number(id)).unwrap_or_default()
    }

    fn is_on(&self, id: &str) -> bool {
        self.settings.is_on(id)
    }

    fn numbers(&self) -> Vec<(&'static Point, f64)> {
        let Some(profile) = self.profile else { return Vec::new() };
        let shown = self.settings.iter().filter_map(|(setting, _)| profile.point(&setting.id));
        shown.map(|point| (point, self.number(&point.id))).collect()
    }

    fn limits(&self) -> Limits {
        Limits {
            low_oil_pressure_shutdown: self.number("low_oil_pressure_shutdown_limit"),
            low_oil_pressure_warning: self.number("low_oil_pressure_warning_limit"),
            high_temperature_shutdown: self.number("high_temperature_shutdown_limit"),
            high_temperature_warning: self.number("high_temperature_warning_limit"),
            oil_margin: self.number("oil_temperature_margin"),
            high_frequency_shutdown: self.number("high_frequency_shutdown_limit"),
            high_frequency_warning: self.number("high_frequency_warning_limit"),
            low_frequency_shutdown: self.number("low_frequency_shutdown_limit"),
            low_frequency_warning: self.number("low_frequency_warning_limit"),
            high_rpm_shutdown: self.number("high_rpm_shutdown"),
            high_rpm_warning: self.number("high_rpm_warning"),
            low_rpm_shutdown: self.number("low_rpm_shutdown"),
            low_rpm_warning: self.number("low_rpm_warning"),
            high_voltage_shutdown: self.number("high_voltage_shutdown_limit"),
            low_voltage_shutdown: self.number("low_voltage_shutdown_limit"),
            high_battery_shutdown: self.number("high_battery_voltage_shutdown_limit"),
            high_battery_warning: self.number("high_battery_voltage_warning_limit"),
            low_battery_warning: self.number("low_battery_voltage_warning_limit"),
            low_charge: self.number("low_charge_voltage"),
            low_external_dc: self.number("low_external_dc"),
            low_fuel_shutdown: self.number("low_fuel_shutdown"),
            low_fuel_warning: self.number("low_fuel_warning"),
            overcurrent: self.number("overcurrent_load_dump_limit"),
            excess_power: self.number("excess_power_load_dump_limit"),
            reverse_power: self.number("reverse_power_limit"),
            load_shedding_high: self.number("load_shedding_high"),
            load_shedding_low: self.number("load_shedding_low"),
            oil_pressure_switch: self.number("oil_pressure_switch"),
            coolant_switch: self.number("coolant_switch"),
        }
    }

    fn mains(&self) -> MainsLimits {
        MainsLimits {
            low: self.number("mains_voltage_low_limit"),
            high: self.number("mains_voltage_high_limit"),
            hysteresis: self.number("hysteresis_voltage"),
            low_frequency: self.number("mains_frequency_low"),
            high_frequency: self.number("mains_frequency_high"),
            fail: self.seconds("mains_fail_time"),
            back: self.seconds("mains_return_time"),
            waiting: self.seconds("mains_waiting_timer"),
            any_order: self.is_on("ignore_phase_order"),
        }
    }

    fn timers(&self) -> Timers {
        Timers {
            overload: self.seconds("overload_timer"),
            stop: self.seconds("stop_timer"),
            cooldown: self.seconds("cooldown_timer"),
            genset_contactor: self.seconds("genset_contactor_timer"),
            mains_contactor: self.seconds("mains_contactor_timer"),
            contactor_wait: self.seconds("contactor_wait"),
            horn: self.seconds("horn_timer"),
            alarm: self.seconds("alarm_time"),
            fuel_alarm: self.seconds("fuel_alarm_time"),
            battery_alarm: self.seconds("battery_alarm_time"),
            reverse_power: self.seconds("reverse_power_time"),
            control_fail: self.seconds("control_fail_time"),
            ecu_silence: self.seconds("ecu_silence_time"),
        }
    }

    fn start(&self) -> Start {
        Start {
            attempts: self.number("start_attempts") as u8,
            wait_before_fuel: self.seconds("wait_before_fuel_timer"),
            preheat: self.seconds("preheat_timer"),
            crank: self.seconds("crank_timer"),
            wait_between_starts: self.seconds("wait_between_starts_timer"),
            idle: self.seconds("idle_timer"),
            holdoff: self.seconds("holdoff_time"),
            heating: self.seconds("engine_heating_timer"),
            warm: self.number("engine_heating_temperature"),
            // The manual: with bit 1 it is the oil, whatever bit 0 says.
            by_coolant: self.is_on("heating_by_coolant") && !self.is_on("heating_by_oil"),
            by_oil: self.is_on("heating_by_oil"),
        }
    }

    fn transfer(&self) -> Transfer {
        let (no_break, soft) = match self.is_on("multi_genset") {
            true => ("multi_genset_no_break_transfer", "multi_genset_soft_transfer"),
            false => ("no_break_transfer", "soft_transfer"),
        };
        let governor = Control {
            enabled: self.is_on("governor_control"),
            reversed: self.is_on("governor_reverse_polarity"),
        };
        Transfer {
            no_break: self.is_on(no_break),
            soft: self.is_on(soft) && governor.enabled && self.is_on("mains_current_transformers"),
            governor,
            exciter: Control {
                enabled: self.is_on("avr_control"),
                reversed: self.is_on("avr_reverse_polarity"),
            },
            timeout: self.seconds("synchronization_time"),
            angle: self.number("synchronization_angle"),
            slip: self.number("synchronization_slip"),
            volts: self.number("synchronization_voltage"),
            ramp: self.number("soft_transfer_ramp"),
        }
    }

    /// The genset can only help mains that it can run beside, and whose load it knows.
    fn peak(&self) -> Option<Peak> {
        let transfer = self.transfer();
        let possible =
            transfer.no_break && transfer.governor.enabled && self.is_on("mains_current_transformers");
        (possible && self.is_on("peak_lopping")).then(|| Peak {
            start: self.number("peak_lopping_start"),
            mains: self.number("peak_lopping_mains"),
            stop: self.number("peak_lopping_stop"),
            delay: self.seconds("peak_lopping_time"),
        })
    }

    fn options(&self) -> Options {
        Options {
            emergency_backup: self.is_on("emergency_backup"),
            rpm_from_frequency: self.is_on("rpm_from_genset_frequency"),
            transformers: self.number("current_transformer_ratio") / TRANSFORMERS,
            mains_transformers: self.is_on("mains_current_transformers"),
            partner: self.is_on("multi_genset"),
            without_partner: self.is_on("single_genset_load"),
            genset_on_load_warning: self.is_on("genset_on_load_warning"),
            mains_on_load_warning: self.is_on("mains_on_load_warning"),
            ecu: self.is_on("ecu_engine_brand"),
        }
    }

    fn exercise(&self) -> Exercise {
        let hour = self.number("exercise_time") as u16;
        let steps = (10.0 * self.number("exercise_duration")).round() as u32;
        Exercise {
            hour: (hour < 7 * 24 && steps > 0).then_some(hour),
            every: match self.exercise_period() {
                0 => Every::Day,
                1 => Every::Week,
                _ => Every::Month,
            },
            duration: EXERCISE_STEP * steps,
            on_load: self.is_on("exercise_on_load"),
            by_buttons: self.is_on("exercise_by_buttons") && steps > 0,
        }
    }

    fn exercise_period(&self) -> u16 {
        self.number("exercise_every").round() as u16
    }

    fn words(&self) -> Words {
        let bits = |ids: &[(u16, &str)]| -> BitSet {
            ids.iter().filter(|(_, id)| self.is_on(id)).map(|(bit, _)| *bit).collect()
        };
        Words {
            multi_genset: bits(&[
                (0, "multi_genset"),
                (1, "single_genset_load"),
                (2, "multi_genset_no_break_transfer"),
                (3, "multi_genset_soft_transfer"),
            ]),
            mode_1: bits(&[
                (0, "no_break_transfer"),
                (1, "soft_transfer"),
                (2, "governor_control"),
                (3, "avr_control"),
                (4, "governor_reverse_polarity"),
                (5, "avr_reverse_polarity"),
                (6, "ignore_phase_order"),
                (7, "peak_lopping"),
            ]),
            mode_2: bits(&[
                (2, "rpm_from_genset_frequency"),
                (3, "genset_line_voltage_display"),
                (4, "mains_line_voltage_display"),
                (5, "emergency_backup"),
                (6, "mains_current_transformers"),
                (7, "modem"),
            ]),
            mode_3: bits(&[
                (2, "exercise_on_load"),
                (3, "sms"),
                (4, "exercise_by_buttons"),
                (5, "modem_call_on_load_transfer"),
                (6, "warning_on_service_request"),
                (7, "internal_modem"),
            ]),
            heating: u16::from(self.is_on("heating_by_coolant"))
                + 2 * u16::from(self.is_on("heating_by_oil")),
            exercise_period: self.exercise_period(),
        }
    }
}

/// What the register of a point makes of a number.
fn held(profile: &Profile, point: &Point, number: f64) -> Option<f64> {
    let order = profile.wire.word_order;
    let mut registers = vec![0; usize::from(point.registers)];
    let number = Number::from_f64(number, 6)?;
    point.encode(&Value::Number(number), order, &mut registers).ok()?;
    Some(point.decode(&registers, order).value?.as_number()?.as_f64())
}

/// As the profile has them.
#[cfg(test)]
pub(super) fn site() -> Parameters {
    site_with(&[])
}

/// As the profile has them but for some.
#[cfg(test)]
pub(super) fn site_with(changes: &[(&str, &str)]) -> Parameters {
    let mut settings = Settings::of(builtin("datakom-dkg705").unwrap());
    for (id, text) in changes {
        settings.set(id, text).unwrap();
    }
    Parameters::of(&settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_what_its_register_holds() {
        // Tens of amperes, two seconds, a fifth of a volt.
        let set = site_with(&[
            ("overcurrent_load_dump_limit", "144"),
            ("cooldown_timer", "31"),
            ("low_battery_voltage_warning_limit", "23.1"),
        ]);
        assert_eq!(set.limits.overcurrent, 140.0);
        assert_eq!(set.timers.cooldown, Duration::from_secs(32));
        assert_eq!(set.limits.low_battery_warning, 23.2);
        let shown = set.numbers.iter().find(|(point, _)| point.id == "cooldown_timer").unwrap();
        assert_eq!(shown.1, 32.0);
    }

    #[test]
    fn every_number_at_1000h_is_a_setting() {
        let profile = builtin("datakom-dkg705").unwrap();
        let set = site();
        for point in profile.points.iter().filter(|point| point.address >= 0x1000) {
            let is_number = point.data_type.is_numeric();
            let shown = set.numbers.iter().any(|(known, _)| known.id == point.id);
            assert_eq!(shown, is_number, "{}", point.id);
        }
    }

    #[test]
    fn what_an_option_needs_it_needs() {
        assert!(site().transfer.soft && site().peak.is_none());
        for missing in ["governor_control", "mains_current_transformers"] {
            let set = site_with(&[("peak_lopping", "1"), (missing, "0")]);
            assert!(!set.transfer.soft && set.peak.is_none(), "{missing}");
        }
        assert!(site_with(&[("peak_lopping", "1")]).peak.is_some());
        assert!(!site_with(&[("multi_genset", "1")]).transfer.no_break, "other bits count then");
    }
}
