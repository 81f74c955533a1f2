//! What the unit watches: each value against its limit, when that is watched at all, and which alarm comes of it.
//!
//! The bits are the manual's, page 17; classes, delays and hysteresis are not in it.

use std::time::Duration;

use crate::settings::Settings;

use super::readings::Readings;

/// How serious an alarm is: which of the three arrays shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Class {
    Shutdown,
    LoadDump,
    Warning,
}

/// When a cause counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Armed {
    Always,
    /// While the engine turns by itself.
    Running,
    /// From the end of warming up until the engine has cooled down.
    Protected,
    /// While genset and mains feed one busbar.
    Parallel,
    /// The same, or with other gensets.
    Beside,
    /// While genset and mains feed one busbar, and nothing is to be exported.
    Importing,
}

/// What is so at this moment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Situation {
    pub(super) running: bool,
    pub(super) protected: bool,
    pub(super) parallel: bool,
    /// Other gensets feed the busbar too.
    pub(super) in_company: bool,
    pub(super) exporting: bool,
    /// What would trip the genset only warns.
    pub(super) lenient: bool,
}

impl Situation {
    fn arms(self, armed: Armed) -> bool {
        match armed {
            Armed::Always => true,
            Armed::Running => self.running,
            Armed::Protected => self.protected,
            Armed::Parallel => self.parallel,
            Armed::Beside => self.parallel || self.in_company,
            Armed::Importing => self.parallel && !self.exporting,
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Limit {
    /// Alarm below the setting, fine again above it by the hysteresis.
    Below(&'static str, f64),
    Above(&'static str, f64),
    /// Alarm while the value is 1.
    True,
}

#[derive(Clone, Copy, Debug)]
enum After {
    Seconds(f64),
    Setting(&'static str),
}

/// One thing that is watched.
#[derive(Debug)]
struct Rule {
    bit: u16,
    class: Class,
    armed: Armed,
    limit: Limit,
    after: After,
    /// None where there is nothing to judge.
    value: fn(&Readings) -> Option<f64>,
}

const fn rule(
    bit: u16,
    class: Class,
    armed: Armed,
    limit: Limit,
    after: After,
    value: fn(&Readings) -> Option<f64>,
) -> Rule {
    Rule { bit, class, armed, limit, after, value }
}

use After::{Seconds, Setting};
use Armed::{Always, Beside, Importing, Parallel, Protected, Running};
use Class::{LoadDump, Shutdown, Warning};
use Limit::{Above, Below, True};

/// The emergency stop button is wired to the fourth input on board.
pub(super) const EMERGENCY_STOP_INPUT: u16 = 3;
pub(super) const MAINS_PHASE_ORDER: u16 = 110;

#[rustfmt::skip]
const RULES: &[Rule] = &[
    rule(EMERGENCY_STOP_INPUT, Shutdown, Always, True, Seconds(0.0), |r| flag(r.emergency_stop)),
    rule(48, Warning, Protected, Below("genset_low_frequency_warning", 0.5), Seconds(2.0), |r| Some(r.genset_frequency)),
    rule(48, Shutdown, Protected, Below("genset_low_frequency_shutdown", 0.5), Seconds(3.0), |r| Some(r.genset_frequency)),
    rule(49, Warning, Running, Above("genset_high_frequency_warning", 0.5), Seconds(2.0), |r| Some(r.genset_frequency)),
    rule(49, Shutdown, Running, Above("genset_high_frequency_shutdown", 0.5), Seconds(1.0), |r| Some(r.genset_frequency)),
    rule(50, Warning, Protected, Below("low_speed_warning", 15.0), Seconds(2.0), |r| Some(r.speed)),
    rule(50, Shutdown, Protected, Below("low_speed_shutdown", 15.0), Seconds(3.0), |r| Some(r.speed)),
    rule(51, Warning, Running, Above("high_speed_warning", 15.0), Seconds(2.0), |r| Some(r.speed)),
    rule(51, Shutdown, Running, Above("high_speed_shutdown", 15.0), Seconds(0.5), |r| Some(r.speed)),
    rule(52, Warning, Protected, Below("genset_low_voltage_warning", 3.0), Seconds(3.0), |r| Some(r.genset_voltage.0)),
    rule(52, Shutdown, Protected, Below("genset_low_voltage_shutdown", 3.0), Seconds(4.0), |r| Some(r.genset_voltage.0)),
    rule(53, Warning, Running, Above("genset_high_voltage_warning", 3.0), Seconds(3.0), |r| Some(r.genset_voltage.1)),
    rule(53, Shutdown, Running, Above("genset_high_voltage_shutdown", 3.0), Seconds(1.0), |r| Some(r.genset_voltage.1)),
    rule(54, Warning, Protected, Below("low_oil_pressure_warning", 0.2), Seconds(2.0), |r| r.oil_pressure),
    rule(54, Shutdown, Protected, Below("low_oil_pressure_shutdown", 0.2), Seconds(2.0), |r| r.oil_pressure),
    rule(55, Warning, Running, Above("high_oil_pressure_warning", 0.5), Seconds(5.0), |r| r.oil_pressure),
    rule(56, Warning, Always, Below("low_temperature_warning", 2.0), Seconds(10.0), |r| r.temperature),
    rule(57, Warning, Always, Above("high_temperature_warning", 3.0), Seconds(3.0), |r| r.temperature),
    rule(57, Shutdown, Running, Above("high_temperature_shutdown", 3.0), Seconds(3.0), |r| r.temperature),
    rule(58, Warning, Always, Below("low_fuel_warning", 2.0), Seconds(2.0), |r| r.fuel_level),
    rule(58, Shutdown, Always, Below("low_fuel_shutdown", 2.0), Seconds(5.0), |r| r.fuel_level),
    rule(59, Warning, Always, Above("high_fuel_warning", 1.0), Seconds(2.0), |r| r.fuel_level),
    rule(61, Warning, Always, Above("high_oil_temperature_warning", 3.0), Seconds(5.0), |r| Some(r.oil_temperature)),
    rule(63, Warning, Always, Above("high_canopy_temperature_warning", 3.0), Seconds(10.0), |r| Some(r.canopy)),
    rule(64, Warning, Always, Below("low_ambient_temperature_warning", 2.0), Seconds(10.0), |r| Some(r.ambient)),
    rule(65, Warning, Always, Above("high_ambient_temperature_warning", 2.0), Seconds(10.0), |r| Some(r.ambient)),
    rule(82, Warning, Always, True, Seconds(2.0), |r| flag(r.oil_pressure.is_none())),
    rule(83, Warning, Always, True, Seconds(2.0), |r| flag(r.temperature.is_none())),
    rule(84, Warning, Always, True, Seconds(2.0), |r| flag(r.fuel_level.is_none())),
    rule(96, Warning, Always, Below("low_battery_warning", 0.5), Seconds(10.0), |r| Some(r.battery[0])),
    rule(97, Warning, Always, Above("high_battery_warning", 0.5), Seconds(10.0), |r| Some(r.battery[0])),
    rule(100, Warning, Running, Below("low_charge_warning", 2.0), Seconds(10.0), |r| Some(r.charge)),
    rule(103, Shutdown, Running, True, Seconds(3.0), |r| flag(r.coolant_low)),
    rule(104, Warning, Protected, Above("voltage_unbalance_warning", 2.0), Seconds(5.0), |r| Some(r.voltage_unbalance)),
    rule(105, Warning, Protected, Above("current_unbalance_warning", 5.0), Seconds(10.0), |r| Some(r.current_unbalance)),
    rule(106, Warning, Protected, Above("over_current_warning", 4.0), Seconds(3.0), |r| Some(r.genset_current)),
    rule(106, LoadDump, Protected, Above("over_current_load_dump", 4.0), Setting("overload_delay"), |r| Some(r.genset_current)),
    rule(107, Warning, Protected, Above("overload_warning", 2.0), Seconds(3.0), |r| Some(r.genset_active)),
    rule(107, LoadDump, Protected, Above("overload_load_dump", 2.0), Setting("overload_delay"), |r| Some(r.genset_active)),
    rule(108, LoadDump, Beside, Above("reverse_power_load_dump", 1.0), Seconds(2.0), |r| Some(-r.genset_active)),
    rule(MAINS_PHASE_ORDER, Warning, Always, True, Seconds(1.0), |r| flag(r.mains_alive && !r.mains_in_order)),
    rule(117, LoadDump, Beside, Above("excitation_lost_load_dump", 2.0), Seconds(2.0), |r| Some(-r.genset_reactive)),
    rule(121, Warning, Parallel, True, Seconds(0.0), |r| flag(!r.mains_alive)),
    rule(122, Warning, Parallel, Below("mains_low_frequency", 0.2), Seconds(0.2), |r| Some(r.mains_frequency).filter(|_| r.mains_alive)),
    rule(122, Warning, Parallel, Above("mains_high_frequency", 0.2), Seconds(0.2), |r| Some(r.mains_frequency).filter(|_| r.mains_alive)),
    rule(123, Warning, Importing, Above("g59_reverse_power", 2.0), Seconds(5.0), |r| Some(-r.mains_active)),
    rule(124, Warning, Parallel, Above("g59_rocof", 0.02), Seconds(0.2), |r| Some(r.rocof)),
    rule(125, Warning, Parallel, Above("g59_vector_shift", 0.0), Seconds(0.0), |r| Some(r.vector_shift)),
    rule(129, Shutdown, Running, True, Setting("pickup_loss_delay"), |r| flag(r.pickup <= 0.0)),
    rule(137, Warning, Always, Above("fuel_pump_time", 0.0), Seconds(0.0), |r| Some(r.pumping)),
    rule(140, Warning, Always, Below("low_battery_warning", 0.5), Seconds(10.0), |r| Some(r.battery[1])),
    rule(141, Warning, Always, Above("high_battery_warning", 0.5), Seconds(10.0), |r| Some(r.battery[1])),
];

fn flag(on: bool) -> Option<f64> {
    Some(f64::from(u8::from(on)))
}

/// One rule with what it is set to and how far its delay has run.
#[derive(Clone, Debug)]
struct Watch {
    rule: &'static Rule,
    limit: f64,
    delay: Duration,
    pending: Duration,
    active: bool,
}

/// All of them.
#[derive(Clone, Debug)]
pub(super) struct Watches(Vec<Watch>);

impl Watches {
    pub(super) fn new() -> Self {
        let watch =
            |rule| Watch { rule, limit: 0.0, delay: Duration::MAX, pending: Duration::ZERO, active: false };
        Self(RULES.iter().map(watch).collect())
    }

    pub(super) fn configure(&mut self, settings: &Settings) {
        for watch in &mut self.0 {
            watch.limit = match watch.rule.limit {
                Below(id, _) | Above(id, _) => settings.number(id),
                True => 0.5,
            };
            watch.delay = match watch.rule.after {
                Seconds(seconds) => Duration::from_secs_f64(seconds),
                Setting(id) => settings.seconds(id),
            };
        }
    }

    /// Judges everything anew.
    pub(super) fn step(&mut self, dt: Duration, readings: &Readings, situation: Situation) {
        for watch in &mut self.0 {
            watch.step(dt, readings, situation);
        }
    }

    /// The alarms whose cause is there now.
    pub(super) fn active(&self) -> impl Iterator<Item = (Class, u16)> {
        self.0.iter().filter(|watch| watch.active).map(|watch| (watch.rule.class, watch.rule.bit))
    }
}

impl Watch {
    /// An alarm needs its cause for the whole delay, and goes when the cause is clearly gone.
    fn step(&mut self, dt: Duration, readings: &Readings, situation: Situation) {
        let value = (self.rule.value)(readings).filter(|_| situation.arms(self.rule.armed));
        let Some(value) = value else {
            (self.active, self.pending) = (false, Duration::ZERO);
            return;
        };
        let (alarm, fine) = match self.rule.limit {
            Below(_, hysteresis) => (value < self.limit, value >= self.limit + hysteresis),
            Above(_, hysteresis) => (value > self.limit, value <= self.limit - hysteresis),
            True => (value > self.limit, value <= self.limit),
        };
        self.pending = if alarm { self.pending + dt } else { Duration::ZERO };
        self.active = !fine && (self.active || alarm && self.pending >= self.delay);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);
    const LOW_FUEL: (Class, u16) = (Warning, 58);

    fn watches() -> Watches {
        let mut watches = Watches::new();
        watches.configure(&Settings::of(busbar_profile::builtin("datakom-d").unwrap()));
        watches
    }

    /// A healthy plant that stands.
    fn fine() -> Readings {
        Readings {
            oil_pressure: Some(0.0),
            temperature: Some(40.0),
            fuel_level: Some(60.0),
            oil_temperature: 35.0,
            canopy: 22.0,
            ambient: 20.0,
            mains_alive: true,
            mains_frequency: 50.0,
            mains_in_order: true,
            battery: [27.1; 2],
            ..Readings::default()
        }
    }

    fn active(watches: &Watches) -> Vec<(Class, u16)> {
        watches.active().collect()
    }

    #[test]
    fn a_healthy_plant_at_rest_has_no_alarm_and_every_setting_exists() {
        let mut watches = watches();
        for _ in 0..600 {
            watches.step(SECOND, &fine(), Situation::default());
        }
        assert_eq!(active(&watches), []);
    }

    /// A rule as the page lists it.
    fn row(rule: &Rule) -> String {
        let profile = busbar_profile::builtin("datakom-d").unwrap();
        let label = &profile.point("warning_alarms").unwrap().bit(rule.bit).unwrap().label;
        let class = match rule.class {
            Shutdown => "shutdown",
            LoadDump => "load dump",
            Warning => "warning",
        };
        let armed = match rule.armed {
            Always => "always",
            Running => "engine running",
            Protected => "protections live",
            Parallel => "both breakers closed",
            Beside => "both breakers closed, or beside other gensets",
            Importing => "both breakers closed, not in 15 and 18",
        };
        let limit = match rule.limit {
            Below(id, _) => format!("below `{id}`"),
            Above(id, _) => format!("above `{id}`"),
            True => "while it is so".to_owned(),
        };
        let after = match rule.after {
            Seconds(seconds) => format!("{seconds} s"),
            Setting(id) => format!("`{id}`"),
        };
        format!("| {:03} | {label} | {class} | {armed} | {limit} | {after} |", rule.bit)
    }

    #[test]
    fn the_page_lists_what_is_watched() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/imitation/datakom-d.md");
        let page = std::fs::read_to_string(path).unwrap();
        let rows: Vec<_> = RULES.iter().map(row).collect();
        assert!(page.contains(&rows.join("\n")), "the page lacks this:\n{}", rows.join("\n"));
    }

    #[test]
    fn an_alarm_needs_its_delay_and_goes_with_its_hysteresis() {
        let mut watches = watches();
        let mut at = |percent| {
            watches.step(SECOND, &Readings { fuel_level: Some(percent), ..fine() }, Situation::default());
            active(&watches).contains(&LOW_FUEL)
        };
        assert!(!at(19.0));
        assert!(!at(21.0), "a dip shorter than the delay is none");
        assert!(!at(19.0));
        assert!(at(19.0));
        assert!(at(21.0));
        assert!(!at(23.0));
    }

    #[test]
    fn oil_pressure_is_watched_only_while_the_protections_are_live() {
        let mut watches = watches();
        let running = Situation { running: true, ..Situation::default() };
        let turning = Readings { speed: 1500.0, pickup: 1500.0, charge: 28.0, ..fine() };
        for _ in 0..10 {
            watches.step(SECOND, &turning, running);
        }
        assert_eq!(active(&watches), []);
        let healthy = Readings { genset_voltage: (231.0, 231.0), genset_frequency: 50.0, ..turning };
        watches.step(SECOND, &healthy, Situation { protected: true, ..running });
        watches.step(SECOND, &healthy, Situation { protected: true, ..running });
        assert_eq!(active(&watches), [(Warning, 54), (Shutdown, 54)]);
    }

    #[test]
    fn an_open_sender_is_an_alarm_of_its_own_and_judges_nothing() {
        let mut watches = watches();
        for _ in 0..10 {
            watches.step(SECOND, &Readings { fuel_level: None, ..fine() }, Situation::default());
        }
        assert_eq!(active(&watches), [(Warning, 84)]);
    }
}
