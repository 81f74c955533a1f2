//! What happens at the machine and what the ACC1700 makes of it: every alarm that the plant can cause is caused here.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_emulator::{Config, Lever};
use busbar_modbus::Request;
use proptest::prelude::*;

use super::alarms::{alarm, pull, set, shown};
use super::{LOAD_UNLOAD, START, STOP, common, config, indicator, loaded, press, quiet, status, walk_to};
use crate::site::{Site, TENTH};

/// Where the unit is when something happens.
#[derive(Clone, Copy, Debug)]
enum At {
    Rest,
    Idle,
    Loaded,
}
use At::{Idle, Loaded, Rest};

/// A row: where, what it is set to, what happens, and what it finds wrong within so many seconds.
type Row = (
    At,
    &'static [(&'static str, &'static str)],
    &'static [(&'static str, &'static str)],
    u64,
    &'static [&'static str],
);

const ROWS: &[Row] = &[
    (Rest, &[], &[("emergency_stop", "pressed")], 1, &["emergency_stop"]),
    (Loaded, &[], &[("emergency_stop", "pressed")], 1, &["emergency_stop"]),
    (Idle, &[], &[("governor", "runaway")], 20, &["overspeed_warning", "overspeed_shutdown"]),
    (Loaded, &[], &[("fuel.supply", "shut")], 40, &["underspeed_warning", "underspeed_shutdown"]),
    // Idling, nobody looks for an underspeed; nor does the ECU want oil pressure of an engine that dies.
    (Idle, &[], &[("fuel.supply", "shut")], 40, &["low_engine_oil_pressure_shutdown"]),
    (
        Loaded,
        &[],
        &[("tank", "0")],
        20,
        &["input_3_warning", "aux_sensor_3_low_warning", "underspeed_shutdown"],
    ),
    (
        Loaded,
        &[],
        &[("pickup", "broken")],
        5,
        &["loss_of_speed_signal_alarm", "ecu_warning", "engine_fault_status"],
    ),
    (Loaded, &[("speed_loss_action", "2")], &[("pickup", "broken")], 5, &["loss_of_speed_signal_warning"]),
    (Loaded, &[], &[("ecu", "silent")], 6, &["ecu_communication_failure_shutdown"]),
    (Loaded, &[], &[("coolant", "leaking")], 120, &["low_coolant_level_input_shutdown"]),
    (
        Loaded,
        &[],
        &[("radiator", "blocked"), ("air.consumption", "9")],
        600,
        &["high_engine_temperature_warning", "high_engine_temperature_shutdown"],
    ),
    (
        Loaded,
        &[("high_engine_temperature_shutdown", "200")],
        &[("radiator", "blocked"), ("air.consumption", "9")],
        900,
        &["ecu_warning", "high_temperature_input_shutdown"],
    ),
    (
        Loaded,
        &[("high_engine_temperature_shutdown", "200"), ("input_2_action", "0")],
        &[("radiator", "blocked"), ("air.consumption", "9")],
        900,
        &["ecu_shutdown", "engine_fault_status"],
    ),
    (
        Loaded,
        &[],
        &[("oil", "leaking")],
        200,
        &["low_engine_oil_pressure_warning", "low_engine_oil_pressure_shutdown"],
    ),
    (
        Loaded,
        &[("low_oil_pressure_shutdown", "0")],
        &[("oil", "leaking")],
        300,
        &["low_engine_oil_pressure_warning", "ecu_warning", "ecu_shutdown"],
    ),
    (Idle, &[], &[("charge_alternator", "failed")], 30, &["charging_failure_warning"]),
    (Rest, &[], &[("battery", "flat")], 30, &["battery_undervoltage_warning"]),
    (Rest, &[("battery_overvoltage_warning", "26")], &[], 30, &["battery_overvoltage_warning"]),
    (
        Rest,
        &[("low_engine_temperature_warning", "30")],
        &[("ambient", "-25")],
        3600,
        &["low_engine_temperature_warning"],
    ),
    (
        Loaded,
        &[],
        &[("load_valve", "stuck_open"), ("air.consumption", "1")],
        60,
        &["high_discharge_pressure_warning", "high_discharge_pressure_shutdown"],
    ),
    (Loaded, &[], &[("oil_separator", "clogged")], 60, &["aux_sensor_2_high_warning"]),
    (
        Loaded,
        &[],
        &[("oil_cooler", "blocked"), ("air.consumption", "9")],
        600,
        &["aux_sensor_4_high_warning", "aux_sensor_4_high_shutdown"],
    ),
    (
        Idle,
        &[],
        &[("dpf.soot", "96")],
        2,
        &["please_regenerate_manually", "ecu_warning", "engine_fault_status"],
    ),
    (Idle, &[], &[("dpf.soot", "125")], 2, &["dpf_fault", "ecu_warning"]),
    (Idle, &[], &[("sender.separator", "broken")], 5, &["aux_sensor_2_open_warning"]),
    (Idle, &[], &[("sender.fuel_level", "broken")], 5, &["aux_sensor_3_open_warning"]),
    (Idle, &[], &[("sender.discharge_temperature", "broken")], 5, &["aux_sensor_4_open_warning"]),
    (Idle, &[], &[("sender.discharge_temperature", "shorted")], 5, &["aux_sensor_4_error"]),
    (Loaded, &[], &[("sender.discharge_pressure", "broken")], 5, &["aux_sensor_5_open_shutdown"]),
    (Idle, &[], &[("sender.temperature", "broken")], 5, &["ecu_warning"]),
    (Idle, &[], &[("sender.oil_pressure", "broken")], 5, &["ecu_warning"]),
    (Rest, &[], &[("tank", "19.5")], 5, &["input_3_warning"]),
    (Rest, &[], &[("door", "open")], 1, &["input_5_indication"]),
    (Rest, &[("input_4_action", "3")], &[("input.4", "closed")], 3, &["input_4_shutdown"]),
    (Rest, &[], &[("maintenance.1", "0")], 1, &["fuel_filter_time_over_warning"]),
    (Rest, &[], &[("maintenance.10", "0")], 1, &["maintenance_10_over_indication"]),
];

fn at(situation: At, settings: &[(&str, &str)]) -> Site {
    let mut site = set(settings);
    if !matches!(situation, Rest) {
        press(&mut site, START);
        walk_to(&mut site, 8);
    }
    if matches!(situation, Loaded) {
        press(&mut site, LOAD_UNLOAD);
        site.pass_seconds(30);
    }
    site
}

#[test]
fn whatever_happens_to_the_machine_is_found_and_nothing_else_stops_it() {
    for (situation, settings, levers, seconds, expected) in ROWS {
        let row = format!("{situation:?} {settings:?} {levers:?}");
        let mut site = at(*situation, settings);
        let before: BTreeSet<_> = active(&site);
        for (lever, to) in *levers {
            pull(&mut site, lever, to);
        }
        let mut seen = BTreeSet::new();
        // Some warnings last no longer than the engine that falls still.
        let look = if *seconds > 100 { 10 * TENTH } else { 2 * TENTH };
        let until = site.now + Duration::from_secs(*seconds);
        while site.now < until {
            site.pass(look);
            seen.extend(active(&site));
            if expected.iter().all(|id| seen.contains(id)) {
                break;
            }
        }
        let asked = expected.iter().any(|id| id.starts_with("ecu_") || id.starts_with("dpf_"));
        assert!(asked || !seen.contains("ecu_shutdown"), "{row}: {seen:?}");
        for id in *expected {
            assert!(
                !before.contains(id) || settings.iter().any(|(setting, _)| setting == id),
                "{row}: {id} before"
            );
            assert!(seen.contains(id), "{row}: no {id} in {seen:?}");
        }
        let stops = expected
            .iter()
            .any(|id| id.ends_with("shutdown") || *id == "emergency_stop" || id.ends_with("signal_alarm"));
        assert_eq!(common(&site, 1), stops, "{row}: {seen:?}");
        assert_eq!(
            site.bits("outputs").contains(0),
            !stops && !matches!(situation, Rest),
            "{row}: the fuel relay"
        );
        assert_eq!(site.device.misfits(), 0, "{row}");
    }
}

fn active(site: &Site) -> BTreeSet<&'static str> {
    site.device.alarms().filter(|alarm| shown(site, alarm)).map(|alarm| alarm.id).collect()
}

#[test]
fn an_emergency_stop_is_released_and_acknowledged_before_a_start_is_taken() {
    let mut site = loaded();
    pull(&mut site, "emergency_stop", "pressed");
    site.pass(TENTH);
    assert!(site.bits("input_signals").contains(0) && alarm(&site, "emergency_stop"));
    assert_eq!(walk_to(&mut site, 0), [12, 13, 15, 0]);
    press(&mut site, STOP);
    press(&mut site, START);
    assert_eq!(status(&site), 0, "it is still pressed");
    pull(&mut site, "emergency_stop", "released");
    site.pass(TENTH);
    assert!(!site.bits("input_signals").contains(0));
    press(&mut site, START);
    assert_eq!(status(&site), 0, "nobody has acknowledged it");
    press(&mut site, STOP);
    press(&mut site, START);
    assert_eq!(walk_to(&mut site, 8), [1, 2, 3, 5, 6, 7, 8]);
}

#[test]
fn it_starts_on_the_attempt_that_succeeds_and_gives_up_when_none_does() {
    for (ignition, cranks) in [("1", 1), ("2", 2), ("3", 3)] {
        let mut site = quiet();
        pull(&mut site, "ignition", ignition);
        press(&mut site, START);
        let seen = walk_to(&mut site, 8);
        assert_eq!(seen.iter().filter(|status| **status == 3).count(), cranks, "{seen:?}");
        assert!(!common(&site, 0));
    }
    for (lever, to) in [("ignition", "never"), ("ignition", "4"), ("battery", "flat")] {
        let mut site = quiet();
        pull(&mut site, lever, to);
        press(&mut site, START);
        let starts = site.number("total_starts");
        let seen = walk_to(&mut site, 0);
        assert_eq!(seen.iter().filter(|status| **status == 3).count(), 3, "{lever} {to}: {seen:?}");
        assert!(alarm(&site, "start_failure_shutdown"), "{lever} {to}");
        assert_eq!(site.number("total_starts"), starts);
        press(&mut site, START);
        assert_eq!(status(&site), 0, "a failed start is acknowledged first");
    }
}

#[test]
fn a_solenoid_that_sticks_is_a_stop_failure_until_somebody_shuts_the_cock() {
    let mut site = loaded();
    pull(&mut site, "fuel.solenoid", "stuck");
    press(&mut site, STOP);
    assert_eq!(walk_to(&mut site, 14), [10, 11, 12, 13, 14]);
    site.pass_seconds(60);
    assert!(alarm(&site, "stop_failure_warning") && status(&site) == 14);
    assert!((800.0..1000.0).contains(&site.number("engine_speed")), "it idles on");
    assert!(!site.bits("outputs").contains(0));
    pull(&mut site, "fuel.supply", "shut");
    assert_eq!(walk_to(&mut site, 0), [14, 15, 0]);
    assert!(!alarm(&site, "stop_failure_warning"));
}

#[test]
fn a_screw_that_binds_overloads_the_engine_and_is_unloaded() {
    let mut site = loaded();
    pull(&mut site, "air.consumption", "8");
    site.pass_seconds(40);
    pull(&mut site, "screw", "binding");
    let protected = |site: &Site| site.bits("engine_indicators").contains(14);
    let mut tenths = 0;
    while !protected(&site) {
        site.pass(TENTH);
        tenths += 1;
        assert!(tenths < 600, "{} %", site.number("engine_load_ratio"));
    }
    assert_eq!([5, 6].map(|bit| indicator(&site, bit)), [false, true]);
    assert_eq!(status(&site), 9);
    site.pass_seconds(10);
    assert!(site.number("engine_load_ratio") < 110.0 && protected(&site));
    site.pass_seconds(25);
    assert!(!protected(&site), "it tries again");
}

#[test]
fn a_stop_waits_for_the_pressure_that_a_blocked_valve_holds_but_not_for_ever() {
    let mut site = set(&[("stop_pressure_time", "40")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    site.pass_seconds(60);
    pull(&mut site, "blow_down", "blocked");
    pull(&mut site, "air.consumption", "0");
    press(&mut site, STOP);
    site.pass_seconds(39);
    assert_eq!((status(&site), indicator(&site, 7), site.number("engine_delay")), (10, true, 20.0));
    site.pass_seconds(3);
    assert!(!indicator(&site, 7) && site.number("engine_delay") < 20.0);
    assert_eq!(walk_to(&mut site, 0), [10, 11, 12, 13, 15, 0]);
    assert!(site.number("discharge_pressure") > 300.0);

    // Started again under that pressure and stopped before it has warmed up.
    press(&mut site, START);
    walk_to(&mut site, 6);
    press(&mut site, STOP);
    site.pass_seconds(39);
    assert_eq!((status(&site), indicator(&site, 7), site.number("engine_delay")), (11, true, 10.0));
    pull(&mut site, "blow_down", "clear");
    assert_eq!(walk_to(&mut site, 0), [11, 12, 13, 15, 0]);
    assert!(site.number("discharge_pressure") < 200.0);
}

#[test]
fn broken_sensors_have_a_code_of_their_own_and_open_terminals() {
    let registers = |site: &Site, wanted: &[(u16, u16)], what: &str| {
        for (register, value) in wanted {
            assert_eq!(site.device.registers(*register, 1), Some(&[*value][..]), "{what}: {register}");
        }
    };
    const BROKEN: u16 = 32767;
    const ABSENT: u16 = 32766;
    let mut shorted = quiet();
    pull(&mut shorted, "sender.discharge_temperature", "shorted");
    shorted.pass(TENTH);
    registers(&shorted, &[(63, 0), (64, BROKEN), (194, BROKEN)], "shorted");
    for (lever, can, plain) in [
        (
            "sender.fuel_level",
            &[(61, 65535), (62, BROKEN), (192, BROKEN)][..],
            &[(62, BROKEN), (192, BROKEN)][..],
        ),
        (
            "sender.discharge_temperature",
            &[(63, 65535), (64, BROKEN), (194, BROKEN)],
            &[(64, BROKEN), (194, BROKEN)],
        ),
        (
            "sender.discharge_pressure",
            &[(65, 0), (66, BROKEN), (193, BROKEN)],
            &[(66, BROKEN), (193, BROKEN)],
        ),
        ("sender.separator", &[(59, 65535), (60, BROKEN)], &[]),
        (
            "sender.temperature",
            &[(190, ABSENT), (57, 65535), (58, ABSENT)],
            &[(57, 65535), (58, BROKEN), (190, BROKEN)],
        ),
        ("sender.oil_pressure", &[(191, ABSENT)], &[(59, 65535), (60, BROKEN), (191, BROKEN)]),
        ("pickup", &[(50, 0)], &[(50, 0)]),
    ] {
        for (model, wanted) in [("ACC1700CAN", can), ("ACC1700", plain)] {
            let mut site = Site::new(&Config { model: Some(model.into()), ..config() });
            press(&mut site, START);
            walk_to(&mut site, 7);
            pull(&mut site, lever, "broken");
            site.pass(TENTH);
            registers(&site, wanted, &format!("{model} {lever}"));
            pull(&mut site, lever, "normal");
            site.pass(TENTH);
            for (register, _) in
                wanted.iter().filter(|(register, _)| ![57, 58].contains(register) || model == "ACC1700")
            {
                let now = site.device.registers(*register, 1).unwrap()[0];
                assert!(![BROKEN, ABSENT, 65535].contains(&now), "{model} {lever}: {register} = {now}");
            }
        }
    }
}

#[test]
fn nobody_fills_a_receiver_whose_pressure_he_does_not_know() {
    let mut site = set(&[("sensor_5_open_action", "2")]);
    press(&mut site, START);
    walk_to(&mut site, 8);
    press(&mut site, LOAD_UNLOAD);
    assert!(indicator(&site, 5));
    pull(&mut site, "sender.discharge_pressure", "broken");
    site.pass_seconds(5);
    assert!(alarm(&site, "aux_sensor_5_open_warning") && !common(&site, 1));
    assert_eq!([5, 6].map(|bit| indicator(&site, bit)), [false, true]);
    assert_eq!(status(&site), 9);
    press(&mut site, STOP);
    site.pass_seconds(2);
    assert!(!indicator(&site, 7), "nor does he wait for it");
    pull(&mut site, "sender.discharge_pressure", "normal");
    walk_to(&mut site, 0);
    assert!(!common(&site, 0));
}

#[test]
fn an_engine_that_cannot_be_seen_to_fire_by_its_speed_is_seen_by_its_oil() {
    let mut site = quiet();
    pull(&mut site, "pickup", "broken");
    press(&mut site, START);
    let seen = walk_to(&mut site, 12);
    assert_eq!(
        seen,
        [1, 2, 3, 5, 6, 12],
        "the starter let go, and the lost signal is found once it is watched"
    );
    assert!(alarm(&site, "loss_of_speed_signal_alarm"));
    assert_eq!(walk_to(&mut site, 0), [12, 13, 15, 0]);
}

#[test]
fn a_starter_lets_go_of_an_engine_that_neither_speed_nor_oil_tell_of() {
    for (lever, to) in [("sender.oil_pressure", "broken"), ("oil", "leaking")] {
        for model in ["ACC1700CAN", "ACC1700"] {
            let mut site = Site::new(&Config {
                model: Some(model.into()),
                // Whatever else is found meanwhile.
                pins: vec![
                    ("speed_loss_action".into(), "0".into()),
                    ("wait_for_stop_time".into(), "4".into()),
                ],
                ..config()
            });
            pull(&mut site, "pickup", "broken");
            pull(&mut site, lever, to);
            site.pass_seconds(120);
            press(&mut site, START);
            assert_eq!(
                walk_to(&mut site, 6),
                [1, 2, 3, 5, 6],
                "{model} {lever}: the charge alternator tells"
            );
            pull(&mut site, "fuel.solenoid", "stuck");
            press(&mut site, STOP);
            assert_eq!(
                walk_to(&mut site, 14).last(),
                Some(&14),
                "{model} {lever}: nor is it taken for at rest"
            );
            pull(&mut site, "fuel.supply", "shut");
            assert_eq!(walk_to(&mut site, 0), [14, 15, 0]);
        }
    }
}

#[test]
fn between_two_cranks_the_engine_comes_to_rest() {
    let mut site = quiet();
    pull(&mut site, "ignition", "2");
    press(&mut site, START);
    assert_eq!(walk_to(&mut site, 4), [1, 2, 3, 4]);
    assert!(site.bits("outputs").is_empty() && site.number("engine_speed") > 100.0);
    site.pass_seconds(8);
    assert_eq!((status(&site), site.number("engine_speed"), site.number("fuel_pressure")), (4, 0.0, 0.0));
    assert_eq!(walk_to(&mut site, 8), [4, 3, 5, 6, 7, 8]);
}

#[test]
fn a_lever_of_every_kind_can_be_pulled_and_stands_where_it_is() {
    let mut site = quiet();
    let levers = site.device.levers();
    for (number, lever) in levers.iter().enumerate() {
        assert!(levers[..number].iter().all(|other| other.id != lever.id), "{} twice", lever.id);
        assert!(site.device.lever(lever.id).is_some(), "{}", lever.id);
        // Somebody who does a service does not leave it so.
        for word in lever.words.iter().rev().filter(|word| word.id != "done") {
            pull(&mut site, lever.id, word.id);
            assert_eq!(site.device.lever(lever.id).unwrap().to_string(), word.id, "{}", lever.id);
        }
        if let Some(numbers) = lever.numbers {
            pull(&mut site, lever.id, &numbers.max.to_string());
            assert_eq!(
                site.device.lever(lever.id).unwrap().to_string(),
                numbers.max.to_string(),
                "{}",
                lever.id
            );
        }
    }
    let refused = site.device.pull("maintenance.11", "1").unwrap_err().to_string();
    assert!(refused.starts_with("the plant has no `maintenance.11`; it has air.consumption, "), "{refused}");
}

#[test]
fn the_story_goes_on_once_the_machine_is_seen_to() {
    for (lever, to, healthy) in [("emergency_stop", "pressed", "released"), ("fuel.supply", "shut", "open")] {
        let mut site = Site::new(&Config { story: true, ..config() });
        site.pass_seconds(70);
        assert_eq!(status(&site), 9);
        pull(&mut site, lever, to);
        site.pass_seconds(60);
        assert!(common(&site, 1) && status(&site) == 0, "{lever}");
        site.pass_seconds(300);
        assert!(status(&site) != 9, "{lever}: nobody has seen to it");
        pull(&mut site, lever, healthy);
        site.pass_seconds(300 - 60);
        // Its people press the stop key in the evening, which acknowledges, and start in the morning.
        assert_eq!((status(&site), common(&site, 1)), (9, false), "{lever}");
    }
}

/// One of the positions of a lever.
fn position(lever: &Lever, choice: usize) -> String {
    let numbers = lever.numbers.map(|numbers| [numbers.min, (numbers.min + numbers.max) / 2.0, numbers.max]);
    let numbers = numbers.into_iter().flatten().map(|number| number.to_string());
    let positions: Vec<_> = lever.words.iter().map(|word| word.id.to_owned()).chain(numbers).collect();
    positions[choice % positions.len()].clone()
}

/// Never run backwards, whatever happens.
fn counters(site: &Site) -> [f64; 4] {
    let hours = site.number("total_running_hours");
    let seconds = 60.0 * site.number("total_running_minutes") + site.number("total_running_seconds");
    let [starts, fuel, events] = ["total_starts", "total_fuel", "event_logs"].map(|id| site.number(id));
    [3600.0 * hours + seconds, starts, fuel, events]
}

/// What holds whatever the machine and the people at it do.
fn lawful(site: &Site, place: &str) {
    let (status, outputs) = (status(site), site.bits("outputs"));
    assert_eq!(outputs.contains(0), matches!(status, 2 | 3 | 5..=11), "{place}: fuel in status {status}");
    assert_eq!(outputs.contains(1), status == 3, "{place}: crank in status {status}");
    assert_eq!(indicator(site, 6), status == 9, "{place}: load indicator in status {status}");
    assert!(!indicator(site, 5) || status == 9, "{place}: load valve in status {status}");
    assert!(!indicator(site, 7) || matches!(status, 10 | 11), "{place}: waits in status {status}");
    assert_eq!(indicator(site, 8), status == 8, "{place}: idle running in status {status}");
    assert!(!common(site, 14) || status == 0, "{place}: heats in status {status}");
    let engine = site.bits("engine_indicators");
    assert_eq!(engine.contains(8), status == 1, "{place}: preheats in status {status}");
    assert!(!engine.contains(14) || (5..=11).contains(&status), "{place}: protects in status {status}");
    for twins in [[62, 192], [64, 194], [66, 193]] {
        let [one, other] = twins.map(|register| site.device.registers(register, 1));
        assert_eq!(one, other, "{place}: {twins:?}");
    }
    assert_eq!(common(site, 10), !common(site, 11), "{place}: one mode");
    let any = |class: &str| active(site).iter().any(|id| id.contains(class));
    assert!(!common(site, 1) || matches!(status, 0 | 12..), "{place}: a shutdown in status {status}");
    assert!(!any("_shutdown") || common(site, 1), "{place}");
    assert_eq!(site.device.misfits(), 0, "{place}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_order_of_levers_keys_and_alarms_leads_astray(
        seed in any::<u64>(),
        plain in any::<bool>(),
        deeds in prop::collection::vec((0..6_u8, 0..200_usize, 0..5_usize, 0..400_u64), 1..40),
    ) {
        let model = Some(if plain { "ACC1700" } else { "ACC1700CAN" }.to_owned());
        let play = || {
            let mut site = Site::new(&Config { seed, model: model.clone(), ..config() });
            let (levers, alarms): (_, Vec<_>) = (site.device.levers(), site.device.alarms().collect());
            for (kind, which, how, tenths) in &deeds {
                let before = counters(&site);
                match kind {
                    0..=2 => {
                        let lever = &levers[which % levers.len()];
                        pull(&mut site, lever.id, &position(lever, *how));
                    }
                    3 | 4 => {
                        let address = [START, STOP, LOAD_UNLOAD, START, LOAD_UNLOAD][*how];
                        site.device.answer(1, &Request::WriteSingleCoil { address, value: 0xFF00 });
                    }
                    _ => {
                        let alarm = alarms[which % alarms.len()];
                        // The engine's fault follows from others.
                        let _ = site.device.inject(alarm.id, *how > 1);
                    }
                }
                site.pass(TENTH * *tenths as u32 + TENTH);
                lawful(&site, &format!("{kind} {which} {how}, {tenths} tenths later"));
                let now = counters(&site);
                assert!(before.iter().zip(&now).all(|(before, now)| before <= now), "{before:?} {now:?}");
            }
            site.image()
        };
        prop_assert_eq!(play(), play());
    }
}
