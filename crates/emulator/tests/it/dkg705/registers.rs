//! What the DKG-705 says in its registers: plausible at every moment, and in agreement with itself.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use busbar_emulator::Config;
use busbar_profile::{Point, Value};
use proptest::prelude::*;

use super::{AUTO, LOAD_TEST, MODE_KEYS, OFF, TEST, config, quiet, story};
use crate::site::{Site, TENTH, believe};

const STORY_SECONDS: u64 = 330;

#[test]
fn every_point_is_good_and_plausible_in_every_status() {
    let mut site = story(1);
    let mut judged = BTreeSet::new();
    judge(&site);
    for _ in 0..STORY_SECONDS * 10 {
        site.pass(TENTH);
        if judged.insert(site.code("operation_status")) || site.now.as_secs().is_multiple_of(20) {
            judge(&site);
        }
    }
    assert_eq!(judged.into_iter().collect::<Vec<_>>(), (0..16).collect::<Vec<_>>(), "all that there are");
    for keys in [LOAD_TEST, TEST, OFF, OFF] {
        site.write(MODE_KEYS, keys);
        site.pass_seconds(25);
        judge(&site);
    }
    assert_eq!(site.device.misfits(), 0);
}

fn judge(site: &Site) {
    let situation = format!("status {}", site.code("operation_status"));
    for point in site.device.profile().points.iter().filter(|point| point.access.is_readable()) {
        believe(point, site.decode(&point.id), plausible, &situation);
    }
}

/// What a person at this site would believe; a new point needs a line here.
fn plausible(point: &Point) -> RangeInclusive<f64> {
    let id = point.id.as_str();
    match (id, point.unit.as_deref()) {
        ("mains_frequency", _) => 0.0..=50.2,
        ("genset_frequency", _) => 0.0..=52.0,
        ("engine_speed" | "ecu_engine_speed", _) => 0.0..=1560.0,
        ("synchroscope_angle", _) => -180.0..=180.0,
        ("governor_output", _) => 30.0..=90.0,
        ("avr_output", _) => 40.0..=70.0,
        ("charge_input_share", _) => 0.0..=100.0,
        ("battery_voltage", _) => 18.0..=29.0,
        ("external_dc_voltage", _) => 18.0..=29.0,
        ("fuel_level", _) => 15.0..=100.0,
        ("operation_timer", _) => 0.0..=30.0,
        ("ecu_engine_hours", _) => 900.0..=2700.0,
        ("ecu_air_filter_pressure", _) => 0.0..=4.0,
        ("ecu_boost_pressure", _) => 0.0..=1.5,
        ("ecu_fuel_pressure", _) => 0.0..=4.0,
        ("ecu_fuel_rate", _) => 0.0..=25.0,
        ("ecu_fuel_economy", _) => 0.0..=4.0,
        ("ecu_exhaust_temperature", _) => 5.0..=500.0,
        ("ecu_ambient_temperature" | "ecu_air_inlet_temperature", _) => 5.0..=60.0,
        ("ecu_fuel_temperature" | "ecu_intake_manifold_temperature", _) => 5.0..=90.0,
        (id, Some("degC")) if !id.ends_with("limit") => 25.0..=110.0,
        ("oil_pressure" | "ecu_oil_pressure", _) => 0.0..=6.0,
        (id, Some("V")) if id.ends_with("_l1_l2_voltage") || id.ends_with("_l2_l3_voltage") => 0.0..=420.0,
        (id, Some("V")) if id.ends_with("_l3_l1_voltage") => 0.0..=420.0,
        (id, Some("V")) if id.ends_with("_voltage") && id.contains("_l") => 0.0..=242.0,
        (id, Some("A")) if id.ends_with("_current") => 0.0..=110.0,
        (id, Some("kW" | "kvar" | "kVA")) if id.ends_with("_power") => -4.0..=70.0,
        (id, _) if id.ends_with("power_factor") => -1.0..=1.0,
        (id, None) if id.ends_with("_fmi") => 0.0..=31.0,
        (id, None) if id.ends_with("_spn") => 0.0..=1000.0,
        ("clock_year", _) => 26.0..=26.0,
        (id, _) if id.starts_with("clock_") => 0.0..=59.0,
        // Settings: never zero where that would mean that nobody set them.
        (id, _) if id.ends_with("_limit") || id.ends_with("_timer") => 1.0..=260.0,
        ("hysteresis_voltage", _) => 2.0..=20.0,
        ("start_attempts" | "ecu_engine_brand" | "ecu_engine_model", _) => 1.0..=9.0,
        ("current_transformer_ratio", _) => 150.0..=300.0,
        ("service_interval_hours" | "service_interval_days", _) => 100.0..=500.0,
        ("exercise_time", _) => 0.0..=23.0,
        ("exercise_duration", _) => 0.1..=2.0,
        other => panic!("nobody said what is plausible for {other:?}"),
    }
}

#[test]
fn five_minutes_move_every_number_that_lives() {
    let mut site = story(3);
    let lives = |point: &&Point| {
        let id = point.id.as_str();
        // Whole hours, and whole degrees of the weather.
        let still = ["clock_year", "clock_month", "clock_day", "clock_hour", "ecu_ambient_temperature"];
        // A fault code beyond the first needs a second fault.
        let row = id.starts_with("ecu_warning_") && !id.starts_with("ecu_warning_1");
        let setting = point.address >= 0x1000;
        !setting && !row && !still.contains(&id)
    };
    let points: Vec<&Point> = site.device.profile().points.iter().filter(lives).collect();
    let mut seen = vec![BTreeSet::new(); points.len()];
    for _ in 0..300 {
        site.pass_seconds(1);
        for (point, seen) in points.iter().zip(&mut seen) {
            if let Some(Value::Number(number)) = site.decode(&point.id).value {
                seen.insert(number.to_string());
            }
        }
    }
    let dead: Vec<_> =
        points.iter().zip(&seen).filter(|(_, seen)| seen.len() == 1).map(|(point, _)| &point.id).collect();
    assert!(dead.is_empty(), "{dead:?} never moved");
}

#[test]
fn an_hour_obeys_physics_whatever_the_seed() {
    for (seed, told, seconds) in [(1, true, 1), (2, false, 4), (7, true, 4), (0xDEAD_BEEF, true, 4)] {
        let mut site = Site::new(&Config { seed, story: told, ..config() });
        let mut coolant = site.number("coolant_temperature");
        let mut hours = 0.0;
        let mut voltages = BTreeSet::new();
        for second in (0..3600).step_by(seconds) {
            site.pass_seconds(seconds as u64);
            let place = format!("seed {seed}, second {second}");
            for source in ["mains", "genset"] {
                feed_agrees(&site, source, &place);
            }
            engine_agrees(&site, &place);
            outputs_agree(&site, true, &place);
            let warmer = site.number("coolant_temperature");
            assert!((warmer - coolant).abs() <= 2.0, "{place}: temperatures have a memory");
            coolant = warmer;
            let more = site.number("ecu_engine_hours");
            assert!(more >= hours, "{place}: {more} h after {hours} h");
            hours = more;
            voltages.insert(site.exact("mains_l1_voltage").to_string());
        }
        assert_eq!(site.device.misfits(), 0, "seed {seed}");
        assert!(voltages.len() > 20, "values move");
    }
}

fn feed_agrees(site: &Site, source: &str, place: &str) {
    let of = |name: &str| site.number(&format!("{source}_{name}"));
    let phase = [of("l1_voltage"), of("l2_voltage"), of("l3_voltage")];
    for (name, a, b) in [("l1_l2_voltage", 0, 1), ("l2_l3_voltage", 1, 2), ("l3_l1_voltage", 2, 0)] {
        let expected = 3.0_f64.sqrt() * (phase[a] + phase[b]) / 2.0;
        assert!((of(name) - expected).abs() < 0.4, "{place}: {source} {name} {} {phase:?}", of(name));
    }
    let (p, q, s) = (of("active_power"), of("reactive_power"), of("apparent_power"));
    assert!((s - p.hypot(q)).abs() < 0.011, "{place}: {source} {p} {q} {s}");
    let factor = of("power_factor");
    let expected = if s > 0.0 { p.abs() / s } else { 0.0 };
    // Where next to nothing flows, hundredths of a kW weigh.
    let slack = 0.006 + 0.012 / s.max(0.1);
    assert!((factor.abs() - expected).abs() < slack, "{place}: {source} {factor} {p} {s}");
    assert!(factor == 0.0 || (factor < 0.0) == (q < 0.0), "{place}: {source} {factor} {q}");
    let apparent: f64 = (1..=3).map(|n| phase[n - 1] * of(&format!("l{n}_current")) / 1000.0).sum();
    // Phases of unlike power factor add up to more than the whole: a little, but for the rest that the mains carry in
    // parallel with a genset whose phases are even.
    let parallel = [6, 10, 14, 15].contains(&site.code("operation_status"));
    let more = if parallel { 3.0 } else { 0.4 };
    assert!((s - 0.1..s + more).contains(&apparent), "{place}: {source} {apparent} {s}");
    assert_eq!(of("frequency") == 0.0, phase == [0.0; 3], "{place}: {source}");
}

fn engine_agrees(site: &Site, place: &str) {
    let (rpm, hertz) = (site.number("engine_speed"), site.number("genset_frequency"));
    assert!((rpm / 30.0 - hertz).abs() < 0.07, "{place}: {rpm} rpm, {hertz} Hz");
    assert!((rpm - site.number("ecu_engine_speed")).abs() < 0.6, "{place}");
    for (own, other) in [
        ("coolant_temperature", "ecu_coolant_temperature"),
        ("oil_temperature", "ecu_oil_temperature"),
        ("oil_pressure", "ecu_oil_pressure"),
    ] {
        assert_eq!(site.number(own), site.number(other), "{place}: {own}");
    }
    // An engine that runs down turns without burning.
    let burns = site.number("ecu_fuel_rate") > 0.0;
    assert!(!burns || rpm > 400.0, "{place}: {rpm} rpm");
    assert!(burns || !(5..=10).contains(&site.code("operation_status")), "{place}: {rpm} rpm");
}

/// `parted`: whatever its contactors had to do for the status that it is in is done.
fn outputs_agree(site: &Site, parted: bool, place: &str) {
    let (relays, functions) = (site.bits("relays"), site.bits("relay_functions_1"));
    for (relay, function) in [(1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (7, 7)] {
        assert_eq!(relays.contains(relay), functions.contains(function), "{place}: relay {relay}");
    }
    let status = site.code("operation_status");
    assert_eq!(functions.contains(2), status == 3, "{place}: status {status}");
    assert_eq!(functions.contains(7), status == 13, "{place}: status {status}");
    let both = relays.contains(4) && relays.contains(5);
    assert!(!both || [6, 10, 14, 15].contains(&status), "{place}: status {status}");
    if status == 8 && parted {
        assert!(site.number("genset_active_power") > 20.0 && site.number("mains_active_power") == 0.0);
    }
    let words = ["shutdown_alarms_1", "shutdown_alarms_2", "load_dump_alarms"];
    assert!(words.iter().all(|word| site.bits(word).is_empty()), "{place}: nothing trips");
    let warnings = ["warning_alarms_1", "warning_alarms_2", "warning_alarms_3"];
    let any = warnings.iter().any(|word| !site.bits(word).is_empty());
    assert_eq!(functions.contains(9), any, "{place}");
    let ecu = site.number("ecu_warning_1_spn") > 0.0;
    assert_eq!(site.bits("warning_alarms_1").contains(11), ecu, "{place}");
}

#[test]
fn the_story_has_a_dip_an_outage_and_an_exercise_with_a_warning() {
    let mut site = story(1);
    let mut statuses = vec![0];
    let mut low_fuel = vec![false];
    for _ in 0..2 * STORY_SECONDS * 10 {
        site.pass(TENTH);
        statuses.push(site.code("operation_status"));
        statuses.dedup();
        low_fuel.push(site.bits("warning_alarms_2").contains(12));
        low_fuel.dedup();
    }
    let dip = [0, 1, 11];
    let outage = [0, 1, 2, 3, 4, 7, 8, 9, 10, 14, 12, 13];
    let exercise = [0, 1, 2, 3, 4, 5, 6, 15, 8, 9, 10, 14, 12, 13];
    let told = [&dip[..], &outage, &exercise].concat();
    assert_eq!(statuses, [told.clone(), told, vec![0]].concat());
    assert_eq!(low_fuel, [false, true, false, true, false]);
}

#[test]
fn nothing_is_wrong_at_a_healthy_site() {
    let mut site = quiet();
    for _ in 0..600 {
        site.pass_seconds(1);
        for point in site.device.profile().points.iter().filter(|point| point.id.contains("alarms")) {
            assert!(site.bits(&point.id).is_empty(), "{}", point.id);
        }
        assert_eq!(site.code("operation_status"), 0);
    }
    assert!(site.bits("relay_functions_1").contains(11), "auto ready");
}

#[test]
fn the_same_seed_and_inputs_give_the_same_registers_however_time_is_cut() {
    let (mut fine, mut coarse, mut other) = (story(5), story(5), story(6));
    for _ in 0..900 {
        fine.pass(TENTH);
    }
    coarse.pass_seconds(90);
    other.pass_seconds(90);
    assert_eq!(fine.image(), coarse.image());
    assert_ne!(fine.image(), other.image());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn whatever_keys_are_pressed_when_outputs_agree_and_off_ends_at_rest(
        seed in any::<u64>(),
        start in 0..STORY_SECONDS,
        keys in prop::collection::vec(
            (prop::sample::select(vec![AUTO, OFF, TEST, LOAD_TEST]), 0..300_u32),
            1..8,
        ),
    ) {
        let mut site = story(seed);
        site.pass_seconds(start);
        let (mut status, mut since) = (None, 0);
        for (key, tenths) in keys {
            site.write(MODE_KEYS, key);
            for tenth in 0..tenths {
                site.pass(TENTH);
                let now = Some(site.code("operation_status"));
                since = if now == status { since + 1 } else { 0 };
                status = now;
                // A line that its grid has left draws from the genset until their contactor has opened, and its
                // voltage comes back in some tenths more.
                outputs_agree(&site, since > 6, &format!("key {key:02X}, tenth {tenth}"));
            }
        }
        site.write(MODE_KEYS, OFF);
        let rests = (0..240).any(|_| {
            site.pass_seconds(1);
            site.code("operation_status") == 0 && site.number("engine_speed") == 0.0
        });
        prop_assert!(rests);
        prop_assert_eq!(site.device.misfits(), 0);
    }
}
