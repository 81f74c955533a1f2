//! What an ACC1700 finds wrong and what comes of it: every alarm injected, the others brought about on site.

use busbar_emulator::{Alarm, Config, InjectError};
use busbar_profile::Class;

use super::{
    LOAD_UNLOAD, START, STOP, common, config, indicator, loaded, pinned, press, quiet, status, walk_to,
};
use crate::site::{Site, TENTH};

/// Follows from the two alarms of the ECU.
const DERIVED: &str = "engine_fault_status";

pub(super) fn shown(site: &Site, alarm: &Alarm) -> bool {
    site.bits(alarm.point).contains(alarm.bit)
}

pub(super) fn alarm(site: &Site, id: &str) -> bool {
    let alarm = site.device.alarms().find(|alarm| alarm.id == id).unwrap_or_else(|| panic!("no alarm {id}"));
    shown(site, &alarm)
}

pub(super) fn inject(site: &mut Site, id: &str, active: bool) {
    site.device.inject(id, active).unwrap_or_else(|error| panic!("{error}"));
    site.pass(TENTH);
}

pub(super) fn pull(site: &mut Site, lever: &str, to: &str) {
    site.device.pull(lever, to).unwrap_or_else(|error| panic!("{error}"));
}

/// A unit that is set to something.
pub(super) fn set(settings: &[(&str, &str)]) -> Site {
    pinned(settings)
}

/// A loaded unit that starts and stops in seconds.
fn quick() -> Site {
    let delays =
        ["preheat", "fuel_output", "safety_on", "start_idle", "warming_up", "energise_to_stop", "after_stop"];
    let ids: Vec<_> = delays.iter().map(|delay| format!("{delay}_time")).collect();
    let mut site = set(&ids.iter().map(|id| (id.as_str(), "0")).collect::<Vec<_>>());
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    site
}

#[test]
fn every_alarm_can_be_injected_and_has_the_consequence_of_its_class() {
    let mut injected = 0;
    for alarm in quiet().device.alarms().filter(|alarm| alarm.id != DERIVED) {
        let mut site = quick();
        let events = site.number("event_logs");
        inject(&mut site, alarm.id, true);
        assert!(shown(&site, &alarm), "{}", alarm.id);
        assert_eq!(site.device.injected(), [alarm]);
        assert_eq!(site.number("event_logs"), events + 1.0, "{}", alarm.id);
        let stops = alarm.class == Class::Shutdown;
        // A fault of the filter is a warning in a word of states.
        let warns = alarm.class == Class::Warning && alarm.point != "engine_indicators";
        assert_eq!([0, 1, 2].map(|bit| common(&site, bit)), [stops || warns, stops, warns], "{}", alarm.id);
        assert_eq!(status(&site), if stops { 12 } else { 9 }, "{}", alarm.id);
        assert_eq!(site.bits("outputs").contains(0), !stops, "{}: the fuel relay", alarm.id);
        assert_eq!(indicator(&site, 5), !stops, "{}: the load valve", alarm.id);

        if stops {
            walk_to(&mut site, 0);
            press(&mut site, STOP);
            press(&mut site, START);
            assert_eq!((status(&site), shown(&site, &alarm)), (0, true), "{}: it is still there", alarm.id);
        }
        inject(&mut site, alarm.id, false);
        assert!(site.device.injected().is_empty());
        assert_eq!(shown(&site, &alarm), stops, "{}: a shutdown stays", alarm.id);
        if stops {
            press(&mut site, START);
            assert_eq!(status(&site), 0, "{}: nobody has acknowledged it", alarm.id);
            press(&mut site, STOP);
            assert!(!shown(&site, &alarm), "{}", alarm.id);
            press(&mut site, START);
            assert_eq!(status(&site), 1, "{}", alarm.id);
        }
        assert_eq!(site.device.misfits(), 0);
        injected += 1;
    }
    assert_eq!(injected, 104);
}

#[test]
fn the_engines_fault_follows_from_the_ecus_alarms_and_is_not_injected() {
    let mut site = quiet();
    let refused = site.device.inject(DERIVED, true).unwrap_err();
    assert_eq!(refused, InjectError::Derived { name: DERIVED.into() });
    assert!(site.device.injected().is_empty());
    for cause in ["ecu_warning", "ecu_shutdown"] {
        assert!(!alarm(&site, DERIVED));
        inject(&mut site, cause, true);
        assert!(alarm(&site, DERIVED), "{cause}");
        inject(&mut site, cause, false);
        press(&mut site, STOP);
    }
}

#[test]
fn a_shutdown_ends_a_start_wherever_it_is() {
    for (wanted, next) in [(1, 0), (2, 0), (3, 12), (5, 12), (6, 12), (7, 12), (8, 12)] {
        let mut site = quiet();
        press(&mut site, START);
        walk_to(&mut site, wanted);
        inject(&mut site, "input_1_shutdown", true);
        assert_eq!(status(&site), next, "from {wanted}");
        assert!(!site.bits("outputs").contains(0) && !site.bits("outputs").contains(1));
    }
    let mut site = loaded();
    press(&mut site, STOP);
    inject(&mut site, "input_1_shutdown", true);
    assert_eq!(walk_to(&mut site, 0), [12, 13, 15, 0], "nor is there any more cooling");
}

#[test]
fn events_count_starts_stops_and_each_new_alarm_once() {
    let mut site = quiet();
    let before = site.number("event_logs");
    let since = |site: &Site| site.number("event_logs") - before;
    press(&mut site, START);
    assert_eq!(since(&site), 1.0);
    walk_to(&mut site, 8);
    assert_eq!(since(&site), 1.0);
    // One that comes as another goes is seen.
    inject(&mut site, "ncd_error", true);
    site.device.inject("ncd_error", false).unwrap();
    inject(&mut site, "input_4_warning", true);
    assert_eq!(since(&site), 3.0);
    site.pass_seconds(20);
    assert_eq!(since(&site), 3.0);
    press(&mut site, STOP);
    walk_to(&mut site, 0);
    assert_eq!(since(&site), 4.0);
    for _ in 0..100 {
        inject(&mut site, "ncd_error", true);
        inject(&mut site, "ncd_error", false);
    }
    assert_eq!(site.number("event_logs"), 99.0, "its range ends there");
}

#[test]
fn each_input_means_what_it_is_set_to() {
    for (action, expected, starts) in [
        ("0", None, true),
        ("1", Some("input_4_indication"), true),
        ("2", Some("input_4_warning"), true),
        ("3", Some("input_4_shutdown"), false),
        ("4", Some("low_coolant_level_input_shutdown"), true),
        ("5", Some("high_temperature_input_shutdown"), true),
        ("6", Some("low_oil_pressure_input_shutdown"), true),
    ] {
        let mut site = set(&[("input_4_action", action), ("input_4_delay", "3")]);
        pull(&mut site, "input.4", "closed");
        site.pass_seconds(1);
        assert!(site.bits("input_signals").contains(4) && site.bits("active_inputs").contains(3));
        let alarms = |site: &Site| {
            let found = site.device.alarms().filter(|alarm| shown(site, alarm)).map(|alarm| alarm.id);
            found.collect::<Vec<_>>()
        };
        assert!(alarms(&site).is_empty(), "shorter than its delay");
        site.pass_seconds(3);
        // Those of the engine only count once it is watched.
        let of_the_engine = ["4", "5", "6"].contains(&action);
        let at_rest = if of_the_engine { None } else { expected };
        assert_eq!(alarms(&site), Vec::from_iter(at_rest), "action {action}");
        press(&mut site, START);
        assert_eq!(status(&site), u32::from(starts), "action {action}");
        if of_the_engine {
            walk_to(&mut site, 5);
            assert!(alarms(&site).is_empty());
            assert_eq!(walk_to(&mut site, 12), [5, 12]);
            assert_eq!(alarms(&site), Vec::from_iter(expected), "action {action}");
        }
    }
}

#[test]
fn a_door_is_an_indication_and_no_alarm() {
    let mut site = quiet();
    pull(&mut site, "door", "open");
    site.pass(TENTH);
    assert!(alarm(&site, "input_5_indication") && !common(&site, 0));
    assert!(!site.bits("input_signals").contains(5) && site.bits("active_inputs").contains(4));
    pull(&mut site, "door", "shut");
    site.pass(TENTH);
    assert!(!alarm(&site, "input_5_indication"));
}

#[test]
fn a_service_that_is_due_warns_indicates_or_stops_as_it_is_set() {
    for (action, expected) in [
        ("0", None),
        ("1", Some("air_filter_time_over_indication")),
        ("2", Some("air_filter_time_over_warning")),
        ("3", Some("air_filter_time_over_shutdown")),
    ] {
        let mut site = set(&[("maintenance_3_action", action)]);
        press(&mut site, START);
        walk_to(&mut site, 8);
        pull(&mut site, "maintenance.3", "0.01");
        site.pass_seconds(30);
        assert_eq!(status(&site), 8);
        assert!((1.0..=6.0).contains(&site.number("maintenance_3_seconds")));
        site.pass_seconds(10);
        let left = ["hours", "minutes", "seconds"].map(|part| site.number(&format!("maintenance_3_{part}")));
        assert_eq!(left, [0.0; 3]);
        for id in ["indication", "warning", "shutdown"].map(|class| format!("air_filter_time_over_{class}")) {
            assert_eq!(alarm(&site, &id), expected == Some(&id), "action {action}: {id}");
        }
        assert_eq!(status(&site) >= 12, action == "3", "action {action}");

        pull(&mut site, "maintenance.3", "done");
        site.pass(TENTH);
        assert!((999.0..=1000.0).contains(&site.number("maintenance_3_hours")));
        for id in ["indication", "warning"].map(|class| format!("air_filter_time_over_{class}")) {
            assert!(!alarm(&site, &id));
        }
        assert_eq!(
            alarm(&site, "air_filter_time_over_shutdown"),
            action == "3",
            "until somebody acknowledges it"
        );
        press(&mut site, STOP);
        assert!(!alarm(&site, "air_filter_time_over_shutdown"));
    }
}

#[test]
fn an_ecu_that_falls_silent_takes_its_values_along_and_stops_the_unit() {
    let mut site = loaded();
    site.pass_seconds(10);
    pull(&mut site, "ecu", "silent");
    site.pass(TENTH);
    let of_the_ecu = [50, 78, 79, 80, 81, 82, 83, 84, 85, 90, 91, 92, 93, 190, 191];
    for register in of_the_ecu {
        assert_eq!(site.device.registers(register, 1), Some(&[32766][..]), "register {register}");
    }
    for id in ["discharge_pressure", "discharge_temperature", "engine_fuel_level", "sensor_2_value"] {
        assert!(site.decode(id).value.is_some(), "{id} has a sensor of its own");
    }
    assert_eq!(status(&site), 9);
    site.pass_seconds(4);
    assert!(!common(&site, 1), "shorter than its delay");
    site.pass_seconds(1);
    assert!(alarm(&site, "ecu_communication_failure_shutdown"));
    assert_eq!(walk_to(&mut site, 0), [12, 13, 15, 0]);
    press(&mut site, STOP);
    press(&mut site, START);
    assert_eq!(status(&site), 0);

    pull(&mut site, "ecu", "normal");
    site.pass(TENTH);
    press(&mut site, STOP);
    assert!(!common(&site, 0));
    press(&mut site, START);
    assert_eq!(walk_to(&mut site, 8), [1, 2, 3, 5, 6, 7, 8]);
}

#[test]
fn an_acc1700_without_an_ecu_misses_none() {
    let mut site = Site::new(&Config { model: Some("ACC1700".into()), ..config() });
    pull(&mut site, "ecu", "silent");
    press(&mut site, START);
    assert_eq!(walk_to(&mut site, 8), [1, 2, 3, 5, 6, 7, 8]);
    press(&mut site, LOAD_UNLOAD);
    site.pass_seconds(60);
    assert_eq!(status(&site), 9);
    assert!(!common(&site, 0));
    // Its engine's temperature and oil pressure are sensors 1 and 2.
    assert_eq!(site.number("sensor_1_value"), site.number("engine_temperature"));
    assert_eq!(site.number("sensor_2_value"), site.number("engine_oil_pressure"));
}
