//! What an ACC1700 is set to steers it: delays, attempts, pressures and overload protection.

use super::alarms::{alarm, pull, set};
use super::{LOAD_UNLOAD, START, STOP, common, indicator, press, quiet, status, walk_to};
use crate::site::{Site, TENTH};

/// Tenths of a second that the unit stays in its status.
fn stays(site: &mut Site) -> u32 {
    let first = status(site);
    let mut tenths = 0;
    while status(site) == first {
        site.pass(TENTH);
        tenths += 1;
        assert!(tenths < 10_000, "status {first} never ended");
    }
    tenths
}

#[test]
fn each_delay_lasts_as_long_as_it_is_set_and_is_shown() {
    let mut site = set(&[
        ("preheat_time", "7"),
        ("fuel_output_time", "2"),
        ("safety_on_time", "3"),
        ("start_idle_time", "4"),
        ("warming_up_time", "11"),
        ("cooling_time", "6"),
        ("stop_idle_time", "2.5"),
        ("energise_to_stop_time", "1"),
        ("after_stop_time", "9"),
    ]);
    press(&mut site, START);
    for (wanted, tenths) in [(1, 70), (2, 20), (5, 30), (6, 40), (7, 110)] {
        walk_to(&mut site, wanted);
        let shown = if wanted == 2 { 0.0 } else { f64::from(tenths) / 10.0 };
        assert_eq!(site.number("engine_delay"), shown, "status {wanted}");
        assert_eq!(stays(&mut site), tenths, "status {wanted}");
    }
    press(&mut site, STOP);
    for (wanted, tenths) in [(10, 60), (11, 25), (12, 10), (15, 90)] {
        walk_to(&mut site, wanted);
        assert_eq!(site.number("engine_delay"), (f64::from(tenths) / 10.0).ceil(), "status {wanted}");
        assert_eq!(stays(&mut site), tenths, "status {wanted}");
    }
    assert_eq!(status(&site), 0);
}

#[test]
fn a_delay_of_0_leaves_its_status_out() {
    let mut site = set(&[("preheat_time", "0"), ("start_idle_time", "0"), ("after_stop_time", "0")]);
    press(&mut site, START);
    assert_eq!(status(&site), 1, "whoever reads back at once sees the start");
    assert_eq!(walk_to(&mut site, 8), [1, 2, 3, 5, 7, 8]);
    press(&mut site, STOP);
    assert_eq!(walk_to(&mut site, 0), [10, 11, 12, 13, 0]);
}

#[test]
fn an_engine_that_does_not_stand_in_time_is_a_stop_failure_until_it_does() {
    let mut site =
        set(&[("energise_to_stop_time", "0"), ("wait_for_stop_time", "1"), ("stop_idle_time", "0")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, STOP);
    assert_eq!(walk_to(&mut site, 14), [10, 13, 14]);
    site.pass(TENTH);
    assert!(alarm(&site, "stop_failure_warning") && common(&site, 2) && !common(&site, 1));
    assert_eq!(site.number("engine_delay"), 0.0);
    press(&mut site, START);
    assert_eq!(status(&site), 14);
    assert_eq!(walk_to(&mut site, 0), [14, 15, 0]);
    assert!(!alarm(&site, "stop_failure_warning"));
}

#[test]
fn the_load_valve_follows_the_pressures_that_are_set() {
    let mut site = set(&[("load_pressure", "400"), ("unload_pressure", "500"), ("stop_pressure", "50")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    let mut highest = 0.0_f64;
    for _ in 0..1200 {
        site.pass(TENTH);
        highest = highest.max(site.number("discharge_pressure"));
        assert_eq!((status(&site), indicator(&site, 6)), (9, true));
    }
    assert!((500.0..515.0).contains(&highest), "{highest}");
    press(&mut site, STOP);
    site.pass(TENTH);
    assert!(indicator(&site, 7));
    while indicator(&site, 7) {
        assert_eq!((status(&site), site.number("engine_delay")), (10, 20.0));
        site.pass(TENTH);
    }
    assert!((40.0..=50.0).contains(&site.number("discharge_pressure")));
}

#[test]
fn overload_protection_unloads_for_a_while_and_loads_again() {
    let protected = |site: &Site| site.bits("engine_indicators").contains(14);
    let mut site = set(&[("overload_limit", "50"), ("overload_delay", "3"), ("overload_rest_time", "12")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    let mut seen = vec![false];
    for _ in 0..1200 {
        site.pass(TENTH);
        assert_eq!((status(&site), indicator(&site, 6)), (9, true), "its status stays");
        assert!(!(protected(&site) && indicator(&site, 5)), "the valve is shut meanwhile");
        if seen.last() != Some(&protected(&site)) {
            seen.push(protected(&site));
        }
    }
    assert!(seen.len() >= 5, "{} turns", seen.len());
    assert!(!common(&site, 0), "it is no alarm");
    press(&mut site, STOP);
    site.pass_seconds(15);
    assert!(!protected(&site));

    let mut site = set(&[("overload_limit", "10"), ("overload_rest_time", "3600")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    site.pass_seconds(20);
    assert!(!protected(&site), "there is nothing to take from it");
    press(&mut site, LOAD_UNLOAD);
    site.pass_seconds(20);
    assert!(protected(&site));
    press(&mut site, STOP);
    walk_to(&mut site, 0);
    assert!(!protected(&site), "nor from one that stands");
}

#[test]
fn thresholds_are_those_that_are_set() {
    for (setting, value, expected) in [
        ("low_engine_temperature_warning", "60", "low_engine_temperature_warning"),
        ("high_engine_temperature_warning", "20", "high_engine_temperature_warning"),
        ("battery_undervoltage_warning", "29", "battery_undervoltage_warning"),
        ("battery_overvoltage_warning", "20", "battery_overvoltage_warning"),
        ("sensor_3_low_warning", "99", "aux_sensor_3_low_warning"),
        ("sensor_4_low_warning", "90", "aux_sensor_4_low_warning"),
    ] {
        let mut site = set(&[(setting, value)]);
        site.pass_seconds(11);
        let found: Vec<_> = site
            .device
            .alarms()
            .filter(|alarm| super::alarms::shown(&site, alarm))
            .map(|alarm| alarm.id)
            .collect();
        assert_eq!(found, [expected], "{setting}={value}");
    }
    for (setting, value, expected) in [
        ("overspeed_warning", "1400", "overspeed_warning"),
        ("overspeed_shutdown", "1400", "overspeed_shutdown"),
        ("underspeed_shutdown", "1600", "underspeed_shutdown"),
        ("low_oil_pressure_warning", "450", "low_engine_oil_pressure_warning"),
        ("low_oil_pressure_shutdown", "450", "low_engine_oil_pressure_shutdown"),
        ("charging_failure_warning_voltage", "29", "charging_failure_warning"),
        ("high_discharge_pressure_warning", "300", "high_discharge_pressure_warning"),
        ("high_discharge_pressure_shutdown", "300", "high_discharge_pressure_shutdown"),
        ("sensor_5_high_shutdown", "300", "aux_sensor_5_high_shutdown"),
        ("sensor_2_high_warning", "5", "aux_sensor_2_high_warning"),
    ] {
        let mut site = set(&[(setting, value)]);
        press(&mut site, START);
        site.pass_seconds(50);
        press(&mut site, LOAD_UNLOAD);
        let mut seen = false;
        for _ in 0..60 {
            site.pass_seconds(1);
            seen |= alarm(&site, expected);
        }
        assert!(seen, "{setting}={value}");
        assert_eq!(common(&site, 1), expected.ends_with("shutdown"), "{setting}={value}");
    }
}

#[test]
fn a_setting_can_be_changed_at_any_time_and_counts_from_the_next_status_on() {
    let mut site = quiet();
    press(&mut site, START);
    walk_to(&mut site, 6);
    site.device.set("start_idle_time", "100").unwrap();
    site.device.set("warming_up_time", "1").unwrap();
    assert_eq!(stays(&mut site), 100, "a delay that runs is not changed");
    assert_eq!(stays(&mut site), 10);
    let refused = site.device.set("crank_time", "2").unwrap_err();
    assert_eq!(refused.to_string(), "`crank_time` cannot be set to `2`; choose a number from 3 to 60 s");
}

#[test]
fn another_interval_begins_its_countdown_anew() {
    let mut site = quiet();
    let before = site.number("maintenance_6_hours");
    site.device.set("maintenance_5_interval", "300").unwrap();
    site.pass(TENTH);
    assert_eq!(site.number("maintenance_5_hours"), 300.0);
    assert_eq!(site.number("maintenance_6_hours"), before);
    let site = set(&[("maintenance_9_interval", "12")]);
    assert_eq!(site.number("maintenance_9_hours"), 12.0);
}

#[test]
fn manual_heating_is_for_a_unit_at_rest_and_ends_by_itself() {
    let mut site = set(&[("heating_time", "60")]);
    let heats = |site: &Site| common(site, 14);
    pull(&mut site, "heating", "on");
    site.pass(TENTH);
    assert!(heats(&site));
    site.pass_seconds(59);
    assert!(heats(&site));
    site.pass_seconds(1);
    assert!(!heats(&site));
    assert_eq!(site.device.lever("heating").unwrap().to_string(), "off");

    pull(&mut site, "heating", "on");
    site.pass_seconds(5);
    press(&mut site, START);
    assert!(!heats(&site), "a start ends it");
    pull(&mut site, "heating", "on");
    site.pass_seconds(1);
    assert!(!heats(&site), "the menu does not offer it to a unit that starts");

    let mut site = quiet();
    for end in ["stop", "emergency_stop"] {
        pull(&mut site, "heating", "on");
        site.pass_seconds(5);
        assert!(heats(&site));
        match end {
            "stop" => press(&mut site, STOP),
            _ => pull(&mut site, end, "pressed"),
        }
        site.pass(TENTH);
        assert!(!heats(&site), "{end}");
    }
    pull(&mut site, "heating", "on");
    site.pass(TENTH);
    assert!(!heats(&site), "not while a shutdown stands");
}

#[test]
fn manual_heating_warms_the_engine() {
    let warmed = |heating: &str| {
        let mut site = set(&[("heating_time", "3600")]);
        pull(&mut site, "ambient", "-20");
        pull(&mut site, "heating", heating);
        site.pass_seconds(1800);
        site.number("engine_temperature")
    };
    assert!(warmed("on") > warmed("off") + 12.0);
}
