//! Every alarm of the DKG-705: what causes it, and what comes of it.

use std::collections::BTreeSet;

use busbar_emulator::{Config, InjectError};
use busbar_profile::Class;

use super::{AUTO, LOAD_TEST, MODE_KEYS, OFF, TEST, config, quiet};
use crate::site::{Site, TENTH};

/// How one alarm comes about: what is set, in which mode, from which status on, what is pulled, and for how long.
struct Cause {
    alarm: &'static str,
    set: &'static [(&'static str, &'static str)],
    key: u16,
    from: u32,
    pull: &'static [(&'static str, &'static str)],
    seconds: u64,
}

const fn cause(
    alarm: &'static str,
    set: &'static [(&'static str, &'static str)],
    (key, from): (u16, u32),
    pull: &'static [(&'static str, &'static str)],
    seconds: u64,
) -> Cause {
    Cause { alarm, set, key, from, pull, seconds }
}

const AT_REST: (u16, u32) = (AUTO, 0);
const WARMING: (u16, u32) = (TEST, 4);
const LOADED: (u16, u32) = (LOAD_TEST, 8);
const MOVING: (u16, u32) = (LOAD_TEST, 15);
const PEAK: &[(&str, &str)] =
    &[("peak_lopping", "1"), ("peak_lopping_start", "20"), ("peak_lopping_stop", "5")];
/// The load moves so slowly that there is time for something to happen.
const SLOW: &[(&str, &str)] = &[("soft_transfer_ramp", "0.5")];

const CAUSES: &[Cause] = &[
    cause(
        "shutdown_alarms_1.input_0",
        &[],
        LOADED,
        &[("sender.oil_pressure", "broken"), ("oil", "leaking")],
        180,
    ),
    cause(
        "shutdown_alarms_1.input_1",
        &[],
        LOADED,
        &[("sender.temperature", "broken"), ("radiator", "blocked"), ("load", "75")],
        600,
    ),
    cause("shutdown_alarms_1.input_2", &[], AT_REST, &[("emergency_stop", "pressed")], 1),
    cause("shutdown_alarms_1.genset_under_frequency", &[], LOADED, &[("fuel.supply", "shut")], 60),
    cause("shutdown_alarms_1.genset_over_frequency", &[], WARMING, &[("governor", "runaway")], 60),
    cause(
        "shutdown_alarms_1.high_battery_voltage",
        &[("high_battery_voltage_shutdown_limit", "27.6")],
        WARMING,
        &[],
        60,
    ),
    cause("shutdown_alarms_1.low_fuel_level", &[], AT_REST, &[("tank", "2")], 5),
    cause(
        "shutdown_alarms_1.high_oil_temperature",
        &[("oil_temperature_margin", "0"), ("load_shedding_high", "0")],
        LOADED,
        &[("load", "75")],
        900,
    ),
    cause(
        "shutdown_alarms_1.high_coolant_temperature",
        &[],
        LOADED,
        &[("radiator", "blocked"), ("load", "75")],
        600,
    ),
    cause("shutdown_alarms_1.low_oil_pressure", &[], LOADED, &[("oil", "leaking")], 180),
    cause("shutdown_alarms_2.fail_to_stop", &[], (OFF, 13), &[], 0),
    cause("shutdown_alarms_2.fail_to_start", &[], (TEST, 1), &[("ignition", "never")], 120),
    cause("shutdown_alarms_2.genset_low_voltage", &[], WARMING, &[("avr", "failed")], 60),
    cause("shutdown_alarms_2.genset_high_voltage", &[], WARMING, &[("avr", "high")], 60),
    cause("shutdown_alarms_2.genset_phase_sequence_fail", &[], WARMING, &[("genset.wiring", "swapped")], 10),
    cause(
        "shutdown_alarms_2.genset_low_rpm",
        &[("rpm_from_genset_frequency", "0")],
        LOADED,
        &[("pickup", "broken")],
        10,
    ),
    cause(
        "shutdown_alarms_2.genset_high_rpm",
        &[("high_frequency_shutdown_limit", "0")],
        WARMING,
        &[("governor", "runaway")],
        60,
    ),
    cause("shutdown_alarms_2.j1939_ecu_communication_fail", &[], WARMING, &[("ecu", "cut")], 10),
    cause("shutdown_alarms_2.communication_lost", &[("multi_genset", "1")], AT_REST, &[], 10),
    cause("load_dump_alarms.genset_reverse_power", PEAK, (AUTO, 15), &[("fuel.supply", "shut")], 60),
    cause(
        "load_dump_alarms.genset_excess_power",
        &[],
        LOADED,
        // More than shedding takes off.
        &[("load", "120"), ("load.power_factor", "1")],
        30,
    ),
    cause(
        "load_dump_alarms.alternator_overcurrent",
        &[],
        LOADED,
        &[("load", "85"), ("load.power_factor", "0.5")],
        30,
    ),
    cause("warning_alarms_1.j1939_ecu_warning", &[], AT_REST, &[("tank", "15")], 5),
    cause("warning_alarms_1.genset_on_load", &[("genset_on_load_warning", "1")], LOADED, &[], 1),
    cause("warning_alarms_1.mains_on_load", &[("mains_on_load_warning", "1")], AT_REST, &[], 1),
    cause("warning_alarms_1.service_request", &[], AT_REST, &[("service.hours", "250")], 1),
    cause("warning_alarms_2.input_4", &[], AT_REST, &[("charger", "failed")], 1),
    cause(
        "warning_alarms_2.synchronization_fail",
        &[("governor_control", "0")],
        (LOAD_TEST, 4),
        &[("mains.frequency", "50.6")],
        90,
    ),
    cause(
        "warning_alarms_2.genset_under_frequency",
        &[("low_frequency_warning_limit", "51")],
        WARMING,
        &[],
        30,
    ),
    cause(
        "warning_alarms_2.genset_over_frequency",
        &[("high_frequency_warning_limit", "49")],
        WARMING,
        &[],
        30,
    ),
    cause(
        "warning_alarms_2.high_battery_voltage",
        &[("high_battery_voltage_warning_limit", "27.6")],
        WARMING,
        &[],
        60,
    ),
    cause("warning_alarms_2.low_fuel_level", &[], AT_REST, &[("tank", "15")], 5),
    cause(
        "warning_alarms_2.high_oil_temperature",
        &[("oil_temperature_margin", "0"), ("load_shedding_high", "0")],
        LOADED,
        &[("load", "75")],
        900,
    ),
    cause(
        "warning_alarms_2.high_coolant_temperature",
        &[],
        LOADED,
        &[("radiator", "blocked"), ("load", "75")],
        600,
    ),
    cause("warning_alarms_2.low_oil_pressure", &[], LOADED, &[("oil", "leaking")], 180),
    cause("warning_alarms_3.mains_phase_sequence_fail", &[], AT_REST, &[("mains", "reversed")], 2),
    cause("warning_alarms_3.charge_fail", &[], LOADED, &[("charge_alternator", "failed")], 30),
    cause(
        "warning_alarms_3.low_battery_voltage",
        &[],
        AT_REST,
        &[("battery", "flat"), ("charger", "failed")],
        600,
    ),
    cause(
        "warning_alarms_3.avr_control_fail",
        &[("high_voltage_shutdown_limit", "0")],
        WARMING,
        &[("avr", "high")],
        60,
    ),
    cause("warning_alarms_3.governor_control_fail", &[("governor_reverse_polarity", "1")], WARMING, &[], 120),
    cause("warning_alarms_3.genset_low_rpm", &[("low_rpm_warning", "1550")], WARMING, &[], 30),
    cause("warning_alarms_3.genset_high_rpm", &[("high_rpm_warning", "1400")], WARMING, &[], 30),
    cause("warning_alarms_3.parallel_mains_failure", SLOW, MOVING, &[("mains", "failed")], 3),
    cause("warning_alarms_3.parallel_mains_reverse_power", &[], LOADED, &[], 0),
    cause(
        "warning_alarms_3.parallel_mains_frequency_fail",
        &[("soft_transfer_ramp", "0.5"), ("mains_frequency_high", "50.3")],
        MOVING,
        &[("mains.frequency", "50.6")],
        5,
    ),
    cause(
        "warning_alarms_3.parallel_no_mains_frequency",
        // Else the jump and the voltage part them before the frequency is seen to be gone.
        &[
            ("peak_lopping", "1"),
            ("peak_lopping_start", "20"),
            ("peak_lopping_stop", "5"),
            ("vector_shift_limit", "90"),
            ("mains_fail_time", "2"),
        ],
        (AUTO, 15),
        &[("mains", "failed")],
        3,
    ),
    cause(
        "warning_alarms_3.parallel_rocof",
        &[("soft_transfer_ramp", "0.5"), ("rocof_limit", "0.3")],
        MOVING,
        &[("mains.frequency", "49")],
        10,
    ),
    cause("warning_alarms_3.parallel_vector_shift", SLOW, MOVING, &[("mains", "failed")], 3),
    cause(
        "warning_alarms_3.communication_lost",
        &[("multi_genset", "1"), ("single_genset_load", "1")],
        AT_REST,
        &[],
        10,
    ),
];

/// What no lever and no setting brings about: inputs that nothing is wired to, and gensets that this one is not.
const INJECTED_ONLY: &[&str] = &[
    "shutdown_alarms_1.input_3",
    "shutdown_alarms_1.input_4",
    "shutdown_alarms_1.input_5",
    "shutdown_alarms_1.input_6",
    "shutdown_alarms_1.input_7",
    "shutdown_alarms_2.slave_unavailable",
    "load_dump_alarms.input_0",
    "load_dump_alarms.input_1",
    "load_dump_alarms.input_2",
    "load_dump_alarms.input_3",
    "load_dump_alarms.input_4",
    "load_dump_alarms.input_5",
    "load_dump_alarms.input_6",
    "load_dump_alarms.input_7",
    "warning_alarms_2.input_0",
    "warning_alarms_2.input_1",
    "warning_alarms_2.input_2",
    "warning_alarms_2.input_3",
    "warning_alarms_2.input_5",
    "warning_alarms_2.input_6",
    "warning_alarms_2.input_7",
];

fn alarms() -> BTreeSet<String> {
    quiet().device.alarms().map(|alarm| format!("{}.{}", alarm.point, alarm.id)).collect()
}

/// Whether an alarm is on, by point and id.
fn is_on(site: &Site, alarm: &str) -> bool {
    let (point, id) = alarm.split_once('.').unwrap();
    let bit = site.device.profile().point(point).unwrap().bit_by_id(id).unwrap().bit;
    site.bits(point).contains(bit)
}

fn pull(site: &mut Site, levers: &[(&str, &str)]) {
    for (lever, to) in levers {
        site.device.pull(lever, to).unwrap();
    }
}

fn set(settings: &[(&str, &str)]) -> Site {
    let pins = settings.iter().map(|(id, value)| ((*id).to_owned(), (*value).to_owned())).collect();
    Site::new(&Config { pins, ..config() })
}

#[test]
fn every_alarm_is_caused_or_can_only_be_injected() {
    let caused: BTreeSet<_> = CAUSES.iter().map(|cause| cause.alarm.to_owned()).collect();
    let injected: BTreeSet<_> = INJECTED_ONLY.iter().map(|alarm| (*alarm).to_owned()).collect();
    assert!(caused.is_disjoint(&injected));
    assert_eq!(caused.union(&injected).cloned().collect::<BTreeSet<_>>(), alarms());
}

#[test]
fn each_alarm_follows_its_cause() {
    let mut wrong = Vec::new();
    for cause in CAUSES.iter().filter(|cause| cause.seconds > 0) {
        let mut site = set(cause.set);
        site.pass(TENTH);
        if cause.key != AUTO {
            site.write(MODE_KEYS, cause.key);
        }
        if !within(&mut site, 300, |site| site.code("operation_status") == cause.from) {
            wrong.push(format!("{}: status {} never came", cause.alarm, cause.from));
            continue;
        }
        if is_on(&site, cause.alarm) && !cause.pull.is_empty() {
            wrong.push(format!("{} was there before its cause", cause.alarm));
        }
        pull(&mut site, cause.pull);
        if !within(&mut site, cause.seconds, |site| is_on(site, cause.alarm)) {
            wrong.push(format!("{} does not come", cause.alarm));
        }
        assert_eq!(site.device.misfits(), 0, "{}", cause.alarm);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Whether something comes to be so in that time.
fn within(site: &mut Site, seconds: u64, so: impl Fn(&Site) -> bool) -> bool {
    (0..10 * seconds).any(|_| {
        let is_so = so(site);
        if !is_so {
            site.pass(TENTH);
        }
        is_so
    }) || so(site)
}

#[test]
fn an_engine_whose_solenoid_sticks_does_not_stop() {
    let mut site = quiet();
    site.write(MODE_KEYS, TEST);
    site.walk_to(4);
    site.pass_seconds(10);
    pull(&mut site, &[("fuel.solenoid", "stuck")]);
    site.write(MODE_KEYS, OFF);
    site.walk_to(13);
    site.pass_seconds(13);
    assert!(is_on(&site, "shutdown_alarms_2.fail_to_stop"));
    assert_eq!(site.code("operation_status"), 13);
    pull(&mut site, &[("fuel.solenoid", "normal")]);
    site.walk_to(0);
    assert!(is_on(&site, "shutdown_alarms_2.fail_to_stop"), "it is latched");
    site.write(MODE_KEYS, AUTO);
    site.pass_seconds(1);
    assert!(!is_on(&site, "shutdown_alarms_2.fail_to_stop"));
}

#[test]
fn a_load_that_falls_away_in_a_soft_transfer_sends_power_into_the_mains() {
    let mut site = quiet();
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(15);
    while site.number("genset_active_power") < 20.0 {
        site.pass(TENTH);
    }
    pull(&mut site, &[("load", "0")]);
    site.pass_seconds(2);
    assert!(is_on(&site, "warning_alarms_3.parallel_mains_reverse_power"));
    assert!(is_on(&site, "warning_alarms_3.parallel_mains_failure"), "they parted");
    assert_eq!(site.code("operation_status"), 8);
    // Mains that are trusted again are no failure any more.
    site.pass_seconds(30);
    assert!(!is_on(&site, "warning_alarms_3.parallel_mains_failure"));
}

#[test]
fn what_is_injected_is_on_until_it_is_taken_back_and_latched_ones_until_a_key() {
    let mut site = quiet();
    let all: Vec<_> = site.device.alarms().collect();
    assert_eq!(all.len(), CAUSES.len() + INJECTED_ONLY.len());
    for alarm in all {
        let name = format!("{}.{}", alarm.point, alarm.id);
        site.device.inject(&name, true).unwrap();
        site.pass_seconds(1);
        assert!(is_on(&site, &name), "{name}");
        let functions = site.bits("relay_functions_1");
        assert!(functions.contains(3) && functions.contains(9), "{name}: both alarm outputs");
        let locks = matches!(alarm.class, Class::Shutdown | Class::LoadDump);
        assert_eq!(functions.contains(11), !locks, "{name}: auto ready");
        site.write(MODE_KEYS, LOAD_TEST);
        site.pass_seconds(1);
        assert_eq!(site.code("operation_status") == 0, locks, "{name}: who starts");
        site.device.inject(&name, false).unwrap();
        site.pass_seconds(1);
        assert_eq!(is_on(&site, &name), locks, "{name}: latched");
        site.write(MODE_KEYS, AUTO);
        site.pass_seconds(1);
        assert!(!is_on(&site, &name), "{name}: acknowledged");
        assert_eq!(site.code("operation_status"), 0, "{name}");
    }
}

#[test]
fn the_injected_warning_of_the_ecu_is_a_fault_that_it_reports() {
    let mut site = quiet();
    site.device.inject("j1939_ecu_warning", true).unwrap();
    site.pass(TENTH);
    assert_eq!((site.number("ecu_warning_1_spn"), site.number("ecu_warning_1_fmi")), (629.0, 12.0));
    let error = site.device.inject("relays.relay_1", true).unwrap_err();
    assert!(matches!(error, InjectError::Unknown { .. }), "an output is no alarm");
}

#[test]
fn a_shutdown_on_load_stops_at_once_and_a_load_dump_cools_down_first() {
    for (alarm, statuses) in
        [("slave_unavailable", &[8, 13, 0, 11, 0][..]), ("genset_excess_power", &[8, 11, 12, 13, 0])]
    {
        let mut site = quiet();
        site.write(MODE_KEYS, LOAD_TEST);
        site.walk_to(8);
        site.pass_seconds(5);
        site.device.inject(alarm, true).unwrap();
        let mut seen = vec![8];
        for _ in 0..900 {
            site.pass(TENTH);
            seen.push(site.code("operation_status"));
            seen.dedup();
        }
        assert_eq!(seen, statuses, "{alarm}");
        assert!(!site.bits("relays").contains(6) && site.number("mains_active_power") > 20.0, "{alarm}");
    }
}

#[test]
fn the_emergency_stop_takes_the_fuel_whatever_the_unit_does_and_no_start_passes_it() {
    let mut site = quiet();
    pull(&mut site, &[("mains", "failed")]);
    site.walk_to(8);
    pull(&mut site, &[("emergency_stop", "pressed")]);
    site.pass(2 * TENTH);
    assert_eq!(site.code("operation_status"), 13);
    assert!(!site.bits("relays").contains(4) && !site.bits("relays").contains(6));
    site.walk_to(0);
    for key in [AUTO, LOAD_TEST] {
        site.write(MODE_KEYS, key);
        site.pass_seconds(20);
        assert!(is_on(&site, "shutdown_alarms_1.input_2"));
        assert_eq!((site.code("operation_status"), site.number("engine_speed")), (0, 0.0));
    }
    pull(&mut site, &[("emergency_stop", "released")]);
    site.pass_seconds(5);
    assert_eq!(site.code("operation_status"), 0, "it is latched");
    site.write(MODE_KEYS, AUTO);
    site.walk_to(8);
}

#[test]
fn the_horn_sounds_for_its_timer_from_every_new_alarm_on() {
    let mut site = set(&[("horn_timer", "5")]);
    let horn = |site: &Site| site.bits("relays").contains(3);
    site.device.inject("charge_fail", true).unwrap();
    site.pass_seconds(4);
    assert!(horn(&site));
    site.pass_seconds(2);
    assert!(!horn(&site) && site.bits("relay_functions_1").contains(9));
    site.device.inject("low_battery_voltage", true).unwrap();
    site.pass_seconds(1);
    assert!(horn(&site));
    site.write(MODE_KEYS, AUTO);
    site.pass(TENTH);
    assert!(!horn(&site), "a key silences it");
}

#[test]
fn no_time_is_no_fault_where_there_is_no_cause() {
    let mut site = set(&[("ecu_silence_time", "0"), ("control_fail_time", "0")]);
    site.pass_seconds(5);
    site.write(MODE_KEYS, TEST);
    site.walk_to(4);
    site.pass_seconds(30);
    for word in ["shutdown_alarms_2", "warning_alarms_3"] {
        assert!(site.bits(word).is_empty(), "{word}");
    }
    pull(&mut site, &[("ecu", "cut")]);
    site.pass(2 * TENTH);
    assert!(is_on(&site, "shutdown_alarms_2.j1939_ecu_communication_fail"));
}

#[test]
fn an_engine_that_runs_away_or_loses_its_oil_is_stopped_while_it_heats() {
    for (lever, to, alarm, seconds) in [
        ("governor", "runaway", "shutdown_alarms_1.genset_over_frequency", 12),
        ("oil", "leaking", "shutdown_alarms_1.low_oil_pressure", 110),
        ("fuel.supply", "shut", "shutdown_alarms_1.genset_under_frequency", 20),
    ] {
        let mut site = set(&[("engine_heating_timer", "200")]);
        site.write(MODE_KEYS, TEST);
        site.walk_to(4);
        pull(&mut site, &[(lever, to)]);
        assert!(within(&mut site, seconds, |site| is_on(site, alarm)), "{lever}");
        assert!(site.number("engine_speed") < 1950.0);
        assert_eq!(site.walk_to(0), [13, 0], "{lever}");
    }
}

#[test]
fn the_holdoff_counts_from_idle_speed_on() {
    for (holdoff, idle, seconds) in [("10", "0", 13), ("2", "9", 14), ("0", "0", 3)] {
        let mut site = set(&[("holdoff_time", holdoff), ("idle_timer", idle), ("low_rpm_shutdown", "1700")]);
        site.write(MODE_KEYS, TEST);
        site.walk_to(4);
        site.pass_seconds(seconds - 1);
        assert!(!is_on(&site, "shutdown_alarms_2.genset_low_rpm"), "too early at {holdoff} and {idle}");
        site.pass(15 * TENTH);
        assert!(is_on(&site, "shutdown_alarms_2.genset_low_rpm"), "{holdoff} and {idle}");
    }
}

#[test]
fn a_long_holdoff_does_not_keep_the_genset_from_synchronizing() {
    let mut site = set(&[("holdoff_time", "60")]);
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [0, 1, 2, 3, 4, 5, 6, 15, 8]);
    assert!(site.bits("warning_alarms_2").is_empty());
}

#[test]
fn a_genset_of_the_wrong_order_is_stopped_unless_nobody_looks() {
    for (ignore, wrong) in [("0", true), ("1", false)] {
        let mut site = set(&[("ignore_phase_order", ignore)]);
        pull(&mut site, &[("genset.wiring", "swapped")]);
        site.write(MODE_KEYS, LOAD_TEST);
        site.walk_to(if wrong { 13 } else { 8 });
        assert_eq!(is_on(&site, "shutdown_alarms_2.genset_phase_sequence_fail"), wrong);
        assert!(!wrong || site.bits("genset_phase_order").contains(7));
        assert!(!site.bits("mains_phase_order").contains(7));
    }
}
