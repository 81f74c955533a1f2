//! What goes wrong with a genset, and what the unit does about it: sounds, unloads, stops.

use busbar_emulator::InjectError;

use super::{LOAD_DUMP, SHUTDOWN, WARNING, alarms, closed, load, pull, set, until};
use crate::site::{AUTO, RUN, STOP, Site, TENTH, TEST};

const DOWN: u16 = 1 << 10;
const LONG: u16 = 1 << 14;

fn on_load() -> Site {
    let mut site = Site::quiet();
    site.press(TEST);
    site.walk_to(13);
    site.pass_seconds(15);
    site
}

/// The mains are dead and the genset carries the load, so that nothing else can.
fn in_the_dark() -> Site {
    let mut site = Site::quiet();
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    site.pass_seconds(15);
    site
}

#[test]
fn a_shutdown_stops_the_engine_at_once_and_stays_until_it_is_reset() {
    for (lever, word, seconds, expected) in [
        ("oil", "leaking", 200, 54),
        ("radiator", "blocked", 1500, 57),
        ("coolant", "leaking", 300, 103),
        ("governor", "runaway", 10, 51),
        ("avr", "high", 10, 53),
        ("avr", "failed", 10, 52),
        ("fuel.supply", "shut", 60, 50),
        ("pickup", "broken", 10, 129),
        ("emergency_stop", "pressed", 2, 3),
    ] {
        let mut site = on_load();
        pull(&mut site, lever, word);
        let has = |site: &Site| alarms(site, SHUTDOWN).contains(&expected);
        until(&mut site, seconds, has);
        assert!(site.flag(50) && site.flag(53) && !site.flag(41), "{lever}");
        assert_eq!(site.codes("leds")[0], 1, "{lever}");
        let walk = site.walk_to(0);
        assert!(walk.ends_with(&[24, 25, 0]) && !walk.contains(&22), "{lever}: {walk:?}");
        until(&mut site, 5, |site| closed(site) == (false, true));
        assert!(load(&site) > 20.0, "{lever}: the mains have it");

        // TEST still wants it.
        site.pass_seconds(30);
        assert_eq!((site.code("operation_status"), site.code("unit_mode")), (0, 8), "{lever}");
        let first = site.device.levers().iter().find(|known| known.id == lever).unwrap().words[0].id;
        pull(&mut site, lever, first);
        site.pass_seconds(5);
        assert!(has(&site), "{lever}: it stays");
        site.press(STOP);
        assert!(!has(&site), "{lever}: {:?}", alarms(&site, SHUTDOWN));
    }
}

#[test]
fn a_cause_that_is_still_there_cannot_be_reset() {
    let mut site = Site::quiet();
    pull(&mut site, "emergency_stop", "pressed");
    site.pass_seconds(1);
    assert_eq!(site.codes("onboard_inputs")[3], 1);
    site.press(STOP);
    assert_eq!(alarms(&site, SHUTDOWN), [3]);
    site.press(AUTO);
    pull(&mut site, "mains", "failed");
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), closed(&site)), (0, (false, false)));
}

#[test]
fn an_overload_opens_cools_and_stops() {
    let mut site = in_the_dark();
    pull(&mut site, "load", "84");
    until(&mut site, 10, |site| alarms(site, WARNING).contains(&107));
    assert!(alarms(&site, LOAD_DUMP).is_empty() && site.flag(33), "shed what can be shed");
    site.pass_seconds(20);
    assert_eq!(site.code("operation_status"), 13);
    pull(&mut site, "load", "95");
    let seconds = until(&mut site, 10, |site| alarms(site, LOAD_DUMP) == [107]);
    assert!((4.9..6.0).contains(&seconds), "{seconds}");
    assert!(site.flag(51) && site.flag(53) && !site.flag(50));
    assert_eq!(site.codes("leds")[1], 1);
    let walk = site.walk_to(22);
    assert!(walk.ends_with(&[21, 22]) && closed(&site) == (false, false), "{walk:?}");
    assert_eq!(site.walk_to(0), [22, 23, 25, 0]);
    assert_eq!(alarms(&site, LOAD_DUMP), [107]);
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 0, "the mains are dead and it stays off until it is reset");
    pull(&mut site, "load", "40");
    site.press(DOWN | LONG);
    site.walk_to(13);
}

#[test]
fn much_reactive_load_is_over_current() {
    let mut site = in_the_dark();
    pull(&mut site, "load.power_factor", "0.6");
    pull(&mut site, "load", "72");
    until(&mut site, 20, |site| alarms(site, LOAD_DUMP) == [106]);
    assert!(!alarms(&site, WARNING).contains(&107));
    site.walk_to(22);
}

#[test]
fn a_warning_only_sounds_and_goes_with_its_cause() {
    for (lever, word, seconds, bit) in [
        ("tank", "18", 5, 58),
        ("sender.oil_pressure", "broken", 5, 82),
        ("sender.temperature", "broken", 5, 83),
        ("sender.fuel_level", "broken", 5, 84),
        ("charge_alternator", "failed", 60, 100),
        ("load.balance", "uneven", 60, 105),
        ("mains", "reversed", 5, 110),
    ] {
        let mut site = on_load();
        pull(&mut site, lever, word);
        until(&mut site, seconds, |site| alarms(site, WARNING).contains(&bit));
        assert!(site.flag(1) && site.flag(52) && !site.flag(53), "{lever}");
        assert_eq!(site.codes("leds")[..3], [0, 0, 1], "{lever}");
        site.pass_seconds(60);
        assert!(!site.flag(1), "{lever}: the horn ends");
        assert_eq!(site.code("operation_status"), 13, "{lever}");
        let known = site.device.levers().iter().find(|known| known.id == lever).unwrap();
        pull(&mut site, lever, known.words.first().map_or("60", |word| word.id));
        until(&mut site, 60, |site| !alarms(site, WARNING).contains(&bit));
    }
}

#[test]
fn a_battery_without_charge_is_warned_of_and_then_starts_nothing() {
    let mut site = Site::quiet();
    pull(&mut site, "battery", "flat");
    until(&mut site, 60, |site| alarms(site, WARNING).contains(&96));
    pull(&mut site, "mains", "failed");
    until(&mut site, 120, |site| alarms(site, SHUTDOWN).contains(&98));
    assert!(site.number("battery_min_cranking_voltage") < 18.0);
}

#[test]
fn senders_that_are_broken_read_nothing() {
    let mut site = Site::quiet();
    for lever in ["sender.oil_pressure", "sender.temperature", "sender.fuel_level"] {
        pull(&mut site, lever, "broken");
    }
    site.pass_seconds(3);
    assert_eq!(site.decode("engine_temperature").value, None);
    assert_eq!((site.number("oil_pressure"), site.number("fuel_level")), (0.0, 0.0));
    assert!(site.number("analog_input_1") > 4000.0);
    assert_eq!(alarms(&site, WARNING), [82, 83, 84], "no low level from a sender that is broken");
}

#[test]
fn a_pickup_without_signal_leaves_the_speed_to_the_frequency() {
    let mut site = set(&[("pickup_loss_delay", "60")]);
    site.press(RUN);
    site.walk_to(8);
    pull(&mut site, "pickup", "broken");
    site.pass_seconds(2);
    assert_eq!(site.number("pickup_speed"), 0.0);
    assert!((1450.0..1550.0).contains(&site.number("engine_speed")));
}

#[test]
fn a_genset_breaker_that_will_not_close_gives_the_load_up() {
    let mut site = Site::quiet();
    pull(&mut site, "breaker.genset", "will_not_close");
    site.press(TEST);
    site.walk_to(11);
    assert_eq!(site.number("operation_timer"), 3.0);
    let seconds = until(&mut site, 10, |site| alarms(site, LOAD_DUMP) == [111]);
    assert!((2.5..3.5).contains(&seconds), "{seconds}");
    assert_eq!(site.walk_to(0), [20, 19, 21, 22, 23, 25, 0]);
    assert!(closed(&site) == (false, true) && load(&site) > 20.0);
    pull(&mut site, "breaker.genset", "normal");
    site.press(DOWN | LONG);
    site.walk_to(13);
}

#[test]
fn a_genset_breaker_that_will_not_open_keeps_the_load_and_says_so() {
    let mut site = on_load();
    pull(&mut site, "breaker.genset", "will_not_open");
    site.press(AUTO);
    until(&mut site, 10, |site| alarms(site, WARNING) == [112]);
    site.pass_seconds(20);
    assert_eq!((site.code("operation_status"), closed(&site)), (13, (true, false)));
    assert!(load(&site) > 20.0);
    pull(&mut site, "breaker.genset", "normal");
    site.walk_to(0);
    assert_eq!(alarms(&site, WARNING), [112], "it tells of it until it is reset");

    // What cannot be unloaded is stopped.
    let mut site = on_load();
    pull(&mut site, "breaker.genset", "will_not_open");
    site.device.inject("load_dump_alarms.over_load", true).unwrap();
    until(&mut site, 10, |site| alarms(site, SHUTDOWN) == [112]);
    site.walk_to(0);
    assert_eq!(site.number("engine_speed"), 0.0);
}

#[test]
fn a_mains_breaker_that_will_not_open_keeps_the_genset_off() {
    let mut site = Site::quiet();
    pull(&mut site, "breaker.mains", "will_not_open");
    pull(&mut site, "mains", "failed");
    until(&mut site, 10, |site| alarms(site, LOAD_DUMP) == [114]);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), closed(&site)), (0, (false, true)));
}

#[test]
fn a_mains_breaker_that_will_not_close_leaves_the_load_to_the_genset() {
    let mut site = in_the_dark();
    pull(&mut site, "breaker.mains", "will_not_close");
    pull(&mut site, "mains", "normal");
    until(&mut site, 60, |site| alarms(site, WARNING) == [113]);
    site.walk_to(13);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), closed(&site)), (13, (true, false)));
    pull(&mut site, "breaker.mains", "normal");
    site.press(DOWN | LONG);
    site.walk_to(0);
    assert_eq!(closed(&site), (false, true));
}

#[test]
fn an_engine_that_will_not_stop_is_told_of() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    pull(&mut site, "fuel.solenoid", "stuck");
    site.press(STOP);
    until(&mut site, 120, |site| alarms(site, WARNING) == [99]);
    assert_eq!(site.code("operation_status"), 25);
    assert!(site.number("engine_speed") > 1000.0);
    pull(&mut site, "fuel.solenoid", "normal");
    site.walk_to(0);
    assert_eq!(alarms(&site, WARNING), [99]);
    site.press(STOP);
    assert!(alarms(&site, WARNING).is_empty());
}

#[test]
fn fuel_that_runs_out_stops_the_engine_before_the_line_is_dry() {
    let mut site = in_the_dark();
    pull(&mut site, "fuel.pump", "failed");
    pull(&mut site, "tank", "3.5");
    until(&mut site, 300, |site| alarms(site, WARNING).contains(&137));
    until(&mut site, 3600, |site| alarms(site, SHUTDOWN) == [58]);
    assert!(site.number("fuel_level") > 2.5);
    // Set otherwise it runs dry, and dies of it.
    let mut site = set(&[("low_fuel_shutdown", "0")]);
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    pull(&mut site, "fuel.pump", "failed");
    pull(&mut site, "tank", "0.1");
    until(&mut site, 3600, |site| alarms(site, SHUTDOWN).contains(&50));
    assert_eq!(site.number("fuel_level"), 0.0);
}

#[test]
fn every_alarm_can_be_injected_into_every_array_and_does_what_the_array_does() {
    let mut site = Site::quiet();
    site.press(RUN);
    site.walk_to(8);
    let all: Vec<_> = site.device.alarms().collect();
    assert_eq!(all.len(), 3 * 142);
    for alarm in all.iter().filter(|alarm| alarm.point == WARNING) {
        let name = format!("{}.{}", alarm.point, alarm.id);
        site.device.inject(&name, true).unwrap();
        site.pass(TENTH);
        assert_eq!(alarms(&site, WARNING), [alarm.bit], "{name}");
        assert_eq!((site.flag(52), site.flag(53), site.code("operation_status")), (true, false, 8), "{name}");
        site.device.inject(&name, false).unwrap();
        site.press(DOWN | LONG);
        site.pass(TENTH);
        assert!(alarms(&site, WARNING).is_empty(), "{name}");
    }
    for (array, status) in [(LOAD_DUMP, 21), (SHUTDOWN, 24)] {
        for alarm in all.iter().filter(|alarm| alarm.point == array).step_by(13) {
            let mut site = Site::quiet();
            site.press(RUN);
            site.walk_to(8);
            site.device.inject(&format!("{array}.{}", alarm.id), true).unwrap();
            site.pass(TENTH);
            assert_eq!((alarms(&site, array), site.code("operation_status")), (vec![alarm.bit], status));
        }
    }
    assert!(matches!(site.device.inject("low_oil_pressure", true), Err(InjectError::Ambiguous { .. })));
}

#[test]
fn injected_phase_order_and_service_show_in_their_flags() {
    let mut site = Site::quiet();
    for (name, flag) in
        [("genset_phase_order_fail", 40), ("service_2_request", 37), ("mains_phase_order_fail", 39)]
    {
        site.device.inject(&format!("{WARNING}.{name}"), true).unwrap();
        site.pass(TENTH);
        assert!(site.flag(flag), "{name}");
    }
    assert_eq!(site.codes("leds")[12], 1, "a service is due");
}

#[test]
fn every_key_silences_the_horn_and_a_new_alarm_sounds_again() {
    let mut site = Site::quiet();
    pull(&mut site, "tank", "10");
    until(&mut site, 5, |site| site.flag(1));
    site.press(1 << 9);
    assert!(!site.flag(1));
    site.pass_seconds(3);
    assert!(!site.flag(1));
    pull(&mut site, "sender.temperature", "broken");
    until(&mut site, 5, |site| site.flag(1));
    assert_eq!(alarms(&site, WARNING), [58, 83]);
}

#[test]
fn the_flashing_relay_flashes_while_there_is_an_alarm() {
    let mut site = Site::quiet();
    pull(&mut site, "tank", "10");
    site.pass_seconds(5);
    let seen: Vec<bool> = (0..40)
        .map(|_| {
            site.pass(TENTH);
            site.flag(16)
        })
        .collect();
    assert!(seen.contains(&true) && seen.contains(&false));
}

#[test]
fn thresholds_are_settings() {
    let mut site = set(&[("high_temperature_warning", "35")]);
    site.pass_seconds(5);
    assert_eq!(alarms(&site, WARNING), [57]);
    site.device.set("high_temperature_warning", "90").unwrap();
    site.pass_seconds(1);
    assert!(alarms(&site, WARNING).is_empty());
}

#[test]
fn a_service_is_done_when_somebody_says_so_on_its_page() {
    let mut site = set(&[("service_1_hours", "10")]);
    site.pass_seconds(1);
    assert_eq!((alarms(&site, WARNING), site.flag(36)), (vec![118], true));
    site.press(1 << 15 | DOWN);
    site.pass_seconds(1);
    assert!(site.flag(36), "not on another page");
    for _ in 0..7 {
        site.press(1 << 7);
    }
    site.press(1 << 15 | DOWN);
    site.pass_seconds(1);
    assert!(alarms(&site, WARNING).is_empty() && !site.flag(36));
    assert!(site.number("service_1_hours_left") > 9.9 && site.number("hours_since_service") < 0.1);
}
