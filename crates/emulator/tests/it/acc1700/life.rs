//! What an ACC1700 shows while it lives: plausible, moving, and in keeping with physics at every moment.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use busbar_emulator::Config;
use busbar_modbus::Request;
use busbar_profile::{Point, Quality, Value};
use proptest::prelude::*;

use super::{
    LOAD_UNLOAD, START, STOP, command, common, config, indicator, loaded, pinned, press, quiet, status,
    walk_to,
};
use crate::site::{Site, TENTH, believe};

/// Not fitted to the demonstration unit.
const ABSENT: [&str; 2] = ["sensor_1_value", "coolant_pressure"];
const ALARM_WORDS: [&str; 12] = [
    "shutdown_alarms_1",
    "shutdown_alarms_2",
    "shutdown_alarms_3",
    "shutdown_alarms_4",
    "shutdown_alarms_5",
    "shutdown_alarms_6",
    "warning_alarms_1",
    "warning_alarms_2",
    "warning_alarms_3",
    "warning_alarms_4",
    "warning_alarms_5",
    "warning_alarms_6",
];

fn story(seed: u64) -> Site {
    Site::new(&Config { seed, story: true, ..config() })
}

#[test]
fn every_point_is_plausible_in_every_situation() {
    let mut site = quiet();
    judge(&site, "power-on");
    press(&mut site, START);
    for wanted in 1..=15 {
        if ![4, 14].contains(&wanted) {
            walk_to(&mut site, wanted);
            site.pass(TENTH);
            judge(&site, &format!("status {wanted}"));
        }
        if wanted == 8 {
            press(&mut site, LOAD_UNLOAD);
        }
        if wanted == 9 {
            for _ in 0..30 {
                site.pass_seconds(10);
                judge(&site, "on load");
            }
            press(&mut site, STOP);
        }
    }
    assert_eq!(site.device.misfits(), 0);
}

fn judge(site: &Site, situation: &str) {
    for point in site.device.profile().points.iter().filter(|point| point.access.is_readable()) {
        let decoded = site.decode(&point.id);
        if ABSENT.contains(&point.id.as_str()) {
            assert_eq!(decoded.quality, Quality::Invalid, "{situation}: {}", point.id);
            assert_eq!(site.device.registers(point.address, 1), Some(&[32766][..]));
            continue;
        }
        believe(point, decoded, plausible, situation);
    }
}

/// What a person at this site would believe; a new point needs a line here.
fn plausible(point: &Point) -> RangeInclusive<f64> {
    let id = point.id.as_str();
    match (id, point.unit.as_deref()) {
        ("engine_speed", _) => 0.0..=1560.0,
        ("engine_delay", _) => 0.0..=20.0,
        ("engine_temperature" | "oil_temperature", _) => 20.0..=105.0,
        ("engine_oil_pressure", _) => 0.0..=600.0,
        ("engine_fuel_level" | "sensor_3_value", _) => 10.0..=100.0,
        ("discharge_pressure" | "sensor_5_value", _) => 0.0..=770.0,
        ("discharge_temperature" | "sensor_4_value", _) => 15.0..=105.0,
        ("sensor_2_value", _) => 0.0..=60.0,
        ("coolant_level", _) => 70.0..=100.0,
        ("fuel_pressure", _) => 0.0..=420.0,
        ("fuel_temperature" | "air_inlet_temperature", _) => 10.0..=65.0,
        ("turbo_pressure", _) => 0.0..=150.0,
        ("exhaust_outlet_temperature", _) => 15.0..=600.0,
        ("fuel_consumption", _) => 0.0..=25.0,
        ("engine_load_ratio" | "torque_percentage", _) => 0.0..=105.0,
        ("water_in_fuel", _) => 0.0..=0.0,
        ("ash_percentage", _) => 3.0..=30.0,
        ("battery_voltage", _) => 18.0..=29.0,
        ("charger_voltage", _) => 0.0..=29.0,
        ("sensor_1_resistance", _) => 6553.5..=6553.5,
        (_, Some("ohm")) => 10.0..=200.0,
        ("sensor_5_current", _) => 4.0..=20.0,
        ("total_running_hours", _) => 900.0..=2700.0,
        ("current_running_hours", _) => 0.0..=3.0,
        (id, _) if id.starts_with("maintenance") && id.ends_with("hours") => 40.0..=4000.0,
        (_, Some("min" | "s")) => 0.0..=59.0,
        ("total_starts", _) => 400.0..=2000.0,
        ("total_fuel", _) => 5000.0..=30_000.0,
        ("event_logs", _) => 1.0..=99.0,
        ("controller_model", _) => 1700.0..=1700.0,
        ("software_version" | "hardware_version" | "pc_software_version", _) => 1.0..=999.0,
        ("release_year", _) => 20.0..=99.0,
        ("release_month", _) => 1.0..=12.0,
        ("release_day", _) => 1.0..=31.0,
        other => panic!("nobody said what is plausible for {other:?}"),
    }
}

#[test]
fn five_minutes_on_load_move_everything_that_ought_to_move() {
    let mut site = loaded();
    // What stays: what does not exist here, what moves in hours, and what is the unit itself.
    let still = [
        "engine_delay",
        "water_in_fuel",
        "ash_percentage",
        "engine_fuel_level",
        "sensor_3_value",
        "sensor_1_resistance",
        "total_running_hours",
        "current_running_hours",
        "total_starts",
        "event_logs",
    ];
    let profile = site.device.profile();
    let moving = profile.points.iter().filter(|point| {
        let id = point.id.as_str();
        let hours = id.starts_with("maintenance") && id.ends_with("hours");
        let identity = (113..=119).contains(&point.address);
        matches!(site.decode(id).value, Some(Value::Number(_))) && !still.contains(&id) && !hours && !identity
    });
    let moving: Vec<&str> = moving.map(|point| point.id.as_str()).collect();
    assert!(moving.len() > 45, "{}", moving.len());
    let mut seen = vec![BTreeSet::new(); moving.len()];
    for _ in 0..300 {
        site.pass_seconds(1);
        for (seen, id) in seen.iter_mut().zip(&moving) {
            seen.insert(format!("{}", site.exact(id)));
        }
    }
    for (seen, id) in seen.iter().zip(&moving) {
        assert!(seen.len() > 1, "{id} stayed {seen:?}");
    }
    assert!(site.number("discharge_pressure") > 500.0);
}

#[test]
fn an_hour_obeys_physics_whatever_the_seed() {
    for (seed, seconds) in [(1, 1), (2, 3), (77, 3), (0xDEAD_BEEF, 3)] {
        let mut site = story(seed);
        let mut last = Vec::new();
        let mut temperatures = temperatures_of(&site);
        for second in (0..3600).step_by(seconds) {
            site.pass_seconds(seconds as u64);
            let place = format!("seed {seed}, second {second}");
            states_agree(&site, &place);
            derived_bits_agree(&site, &place);
            sensors_agree(&site, &place);

            let now = counters_of(&site);
            assert!(
                last.iter().zip(&now).all(|(before, after)| before <= after),
                "{place}: {last:?} {now:?}"
            );
            last = now;
            for (before, after) in temperatures.iter_mut().zip(temperatures_of(&site)) {
                assert!((after - *before).abs() <= 1.0 + 2.0 * seconds as f64, "{place}: {before} {after}");
                *before = after;
            }
        }
        assert_eq!(site.device.misfits(), 0);
    }
}

/// Grow, or hold their sign so that they do.
fn counters_of(site: &Site) -> Vec<f64> {
    let clock = |prefix: &str| {
        let part = |name: &str| site.number(&format!("{prefix}_{name}"));
        3600.0 * part("hours") + 60.0 * part("minutes") + part("seconds")
    };
    let mut counters = ["total_starts", "total_fuel", "event_logs"].map(|id| site.number(id)).to_vec();
    counters.push(clock("total_running"));
    counters.extend((1..=10).map(|service| -clock(&format!("maintenance_{service}"))));
    counters
}

fn temperatures_of(site: &Site) -> [f64; 4] {
    ["engine_temperature", "oil_temperature", "discharge_temperature", "fuel_temperature"]
        .map(|id| site.number(id))
}

fn states_agree(site: &Site, place: &str) {
    let (status, rpm) = (status(site), site.number("engine_speed"));
    let running = (5..=11).contains(&status);
    assert_eq!(indicator(site, 4), running, "{place}");
    match status {
        0 | 1 | 2 | 15 => assert_eq!(rpm, 0.0, "{place}: status {status}"),
        9 => assert!(rpm > 850.0, "{place}: {rpm}"),
        // A load that is thrown off lets the governor overshoot.
        8 => assert!((850.0..=1560.0).contains(&rpm), "{place}: {rpm}"),
        _ if running => assert!(rpm > 380.0, "{place}: status {status}, {rpm}"),
        _ => {}
    }
    let outputs = site.bits("outputs");
    assert_eq!(outputs.contains(0), matches!(status, 2 | 3 | 5..=11), "{place}: fuel");
    assert_eq!(outputs.contains(1), status == 3, "{place}: crank");
    assert_eq!(indicator(site, 6), status == 9, "{place}: load indicator");
    assert_eq!(indicator(site, 8), status == 8, "{place}: idle running");
    assert!(!indicator(site, 5) || indicator(site, 6), "{place}: the valve is open in status {status}");
    assert_eq!(common(site, 10), !common(site, 11), "{place}: one mode");
    assert_eq!(site.bits("engine_indicators").contains(8), status == 1, "{place}: preheating");
    if rpm == 0.0 {
        for id in ["fuel_consumption", "engine_load_ratio", "torque_percentage"] {
            assert_eq!(site.number(id), 0.0, "{place}: {id}");
        }
    }
    if running {
        assert!(site.number("fuel_consumption") > 0.5, "{place}");
        assert!(site.number("engine_load_ratio") >= site.number("torque_percentage"), "{place}");
    }
}

fn derived_bits_agree(site: &Site, place: &str) {
    let any = |words: &[&str]| words.iter().any(|word| !site.bits(word).is_empty());
    let (shutdown, warning) = (any(&ALARM_WORDS[..6]), any(&ALARM_WORDS[6..]));
    assert_eq!([0, 1, 2].map(|bit| common(site, bit)), [shutdown || warning, shutdown, warning], "{place}");
    assert!(!shutdown, "{place}: healthy");
    let warned: Vec<_> = ALARM_WORDS[6..].iter().filter(|word| !site.bits(word).is_empty()).collect();
    assert!(warned.iter().all(|word| **word == "warning_alarms_5"), "{place}: {warned:?}");
    assert_eq!(site.bits("indications_1").contains(4), site.bits("active_inputs").contains(4), "{place}");
    assert_ne!(site.bits("input_signals").contains(5), site.bits("active_inputs").contains(4), "{place}");
}

/// Two rows that tell of one thing tell the same.
fn sensors_agree(site: &Site, place: &str) {
    for (sensor, value) in [
        ("sensor_3_value", "engine_fuel_level"),
        ("sensor_4_value", "discharge_temperature"),
        ("sensor_5_value", "discharge_pressure"),
    ] {
        assert_eq!(site.number(sensor), site.number(value), "{place}");
    }
    let kilopascal = (site.number("sensor_5_current") - 4.0) / 16.0 * 1600.0;
    assert!((kilopascal - site.number("discharge_pressure")).abs() <= 1.5, "{place}: {kilopascal}");
}

#[test]
fn pressure_rises_only_while_the_valve_is_open_and_hunts_between_its_limits() {
    let mut site = loaded();
    let (mut turns, mut valve) = (0, true);
    let mut pressure = 0.0;
    for tenth in 0..4000 {
        let open = indicator(&site, 5);
        site.pass(TENTH);
        let now = site.number("discharge_pressure");
        assert!(open || now <= pressure, "tenth {tenth}: {pressure} kPa, then {now} with the valve shut");
        assert!(now <= 760.0, "tenth {tenth}: {now}");
        if tenth > 1500 {
            assert!(now >= 600.0, "tenth {tenth}: {now}");
        }
        if open != valve {
            turns += 1;
            valve = open;
        }
        pressure = now;
        assert_eq!(status(&site), 9);
    }
    assert!(turns >= 8, "{turns} turns of the valve");

    press(&mut site, LOAD_UNLOAD);
    let before = site.number("discharge_pressure");
    site.pass_seconds(20);
    assert!(site.number("discharge_pressure") < before - 50.0, "the site goes on drawing");
}

#[test]
fn cranking_dips_the_battery_and_running_charges_it() {
    let mut site = quiet();
    site.pass_seconds(30);
    let rest = site.number("battery_voltage");
    assert!(site.number("charger_voltage") < 2.0);
    press(&mut site, START);
    walk_to(&mut site, 3);
    site.pass_seconds(1);
    assert!(site.number("battery_voltage") < rest - 4.0);
    walk_to(&mut site, 8);
    assert!(site.number("battery_voltage") > rest);
    assert!(site.number("charger_voltage") > 27.0);
}

#[test]
fn a_run_counts_a_start_a_time_and_its_events() {
    let mut site = quiet();
    let (starts, events) = (site.number("total_starts"), site.number("event_logs"));
    let before = counters_of(&site);
    command(&mut site, "start_and_load");
    assert_eq!(site.number("total_starts"), starts + 1.0);
    assert_eq!(site.number("current_running_hours"), 0.0);
    assert!(site.number("current_running_minutes") <= 1.0);
    site.pass_seconds(120);
    let run =
        |site: &Site| 60.0 * site.number("current_running_minutes") + site.number("current_running_seconds");
    assert!(run(&site) > 120.0);
    command(&mut site, "stop_to_standby");
    assert_eq!(site.number("event_logs"), events + 2.0);
    let last = run(&site);
    site.pass_seconds(60);
    assert_eq!(run(&site), last, "it stays until the next run");
    // Every countdown has lost exactly what the total has gained.
    let now = counters_of(&site);
    let ran = now[3] - before[3];
    assert!(ran > 120.0);
    assert!(now[4..].iter().zip(&before[4..]).all(|(now, before)| now - before == ran), "{before:?} {now:?}");
}

#[test]
fn maintenance_words_follow_their_countdowns() {
    let site = pinned(&[
        ("maintenance_3_hours", "0"),
        ("maintenance_3_minutes", "0"),
        ("maintenance_3_seconds", "0"),
        ("maintenance_10_hours", "0"),
        ("maintenance_10_minutes", "0"),
        ("maintenance_10_seconds", "0"),
        ("maintenance_5_hours", "0"),
    ]);
    let bits = |id: &str| site.bits(id).iter().collect::<Vec<_>>();
    assert_eq!(bits("warning_alarms_6"), [2]);
    assert_eq!(bits("indications_2"), [9]);
    assert!(bits("shutdown_alarms_6").is_empty());
    assert!(common(&site, 0) && !common(&site, 1) && common(&site, 2), "an indication alone is no alarm");
}

#[test]
fn the_engines_fault_and_common_bits_follow_pinned_words() {
    for (word, bit, fault) in [
        ("warning_alarms_1", "ecu_warning", true),
        ("shutdown_alarms_1", "ecu_shutdown", true),
        ("warning_alarms_1", "ncd_error", false),
    ] {
        let site = pinned(&[(word, bit)]);
        assert_eq!(site.bits("engine_indicators").contains(9), fault, "{bit}");
    }
    let site = pinned(&[("shutdown_alarms_4", "high_discharge_pressure_shutdown")]);
    assert_eq!([0, 1, 2].map(|bit| common(&site, bit)), [true, true, false]);
    let site = pinned(&[("indications_1", "0")]);
    assert_eq!([0, 1, 2].map(|bit| common(&site, bit)), [false; 3]);
}

#[test]
fn the_story_shows_every_status_of_a_run_and_a_warning_that_comes_and_goes() {
    let mut site = story(1);
    let (mut statuses, mut warnings, mut doors) = (vec![0], vec![false], vec![false]);
    for _ in 0..(2 * 300 * 10) {
        site.pass(TENTH);
        for (seen, now) in [
            (&mut warnings, site.bits("warning_alarms_5").contains(2)),
            (&mut doors, site.bits("indications_1").contains(4)),
        ] {
            if seen.last() != Some(&now) {
                seen.push(now);
            }
        }
        if statuses.last() != Some(&status(&site)) {
            statuses.push(status(&site));
        }
    }
    let run = [1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 0];
    assert_eq!(statuses, [vec![0], run.to_vec(), run.to_vec()].concat());
    assert_eq!(warnings, [false, true, false, true, false]);
    assert_eq!(doors, [false, true, false, true, false]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_order_of_keys_leads_astray(
        seed in any::<u64>(),
        keys in prop::collection::vec((0..25_u16, any::<bool>(), 0..300_u64), 1..40),
    ) {
        let mut site = Site::new(&Config { seed, ..config() });
        let mut last = counters_of(&site);
        for (coil, on, tenths) in keys {
            let value = if on { 0xFF00 } else { 0 };
            site.device.answer(1, &Request::WriteSingleCoil { address: coil, value });
            states_agree(&site, &format!("coil {coil}, {on}"));
            site.pass(TENTH * tenths as u32);
            states_agree(&site, &format!("{tenths} tenths after coil {coil}, {on}"));
            derived_bits_agree(&site, "keys");
            let now = counters_of(&site);
            prop_assert!(last.iter().zip(&now).all(|(before, after)| before <= after));
            last = now;
        }
        prop_assert_eq!(site.device.misfits(), 0);
    }
}

#[test]
fn the_same_seed_gives_the_same_registers_however_time_is_cut() {
    let (mut fine, mut coarse, mut other) = (story(5), story(5), story(6));
    for _ in 0..900 {
        fine.pass(TENTH);
    }
    coarse.pass_seconds(90);
    other.pass_seconds(90);
    assert_eq!(fine.image(), coarse.image());
    assert_ne!(fine.image(), other.image());
}
