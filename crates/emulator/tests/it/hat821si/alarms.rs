//! Every alarm: what at the site causes it, what the controller then does, and what it does when it is only told so.

use super::{active, bit, has, positions, pull, quiet, send, set, with};
use crate::site::Site;

/// A site where what is set and pulled has caused something.
fn caused(settings: &[(&str, &str)], levers: &[(&str, &str)], seconds: u64) -> Site {
    let mut site = with(settings);
    levers.iter().for_each(|(lever, to)| pull(&mut site, lever, to));
    site.pass_seconds(seconds);
    site
}

/// A site where an alarm of this name has its cause.
fn cause(alarm: &str) -> Site {
    let stuck = |switch: &str, wear: &str, command: &str| {
        let mut site = quiet();
        pull(&mut site, switch, wear);
        set(&mut site, command);
        site.pass_seconds(10);
        site
    };
    match alarm {
        "ats_transfer_failure" | "s1_open_failure" => stuck("switch.qs1", "will_not_open", "transfer_001"),
        "s2_open_failure" => stuck("switch.qs2", "will_not_open", "transfer_100"),
        "qtie_close_failure" => stuck("switch.qtie", "will_not_close", "transfer_110"),
        "qtie_open_failure" => {
            let mut site = stuck("switch.qtie", "will_not_open", "transfer_110");
            set(&mut site, "transfer_101");
            site.pass_seconds(10);
            site
        }
        "s1_close_failure" => {
            let mut site = stuck("switch.qs1", "will_not_close", "transfer_001");
            set(&mut site, "transfer_101");
            site.pass_seconds(10);
            site
        }
        "s2_close_failure" => {
            let mut site = stuck("switch.qs2", "will_not_close", "transfer_100");
            set(&mut site, "transfer_101");
            site.pass_seconds(10);
            site
        }
        "ground_fault" => caused(&[], &[("earth_fault1", "200")], 5),
        "ground_fault_warning" => caused(&[], &[("earth_fault2", "70")], 5),
        "qs1_ground_overcurrent" => caused(&[], &[("short_circuit1", "present")], 5),
        "qs2_ground_overcurrent" => caused(&[], &[("short_circuit2", "present")], 5),
        "s1_load_overcurrent_trip" => heavy("load1", "rated_current", 20),
        "s2_load_overcurrent_trip" => heavy("load2", "rated_current", 20),
        "s1_load_overcurrent_warning" => heavy("load1", "rated_current", 5),
        "s2_load_overcurrent_warning" => heavy("load2", "rated_current", 5),
        "overload" => heavy("load1", "source_1_capacity", 8),
        "forced_open_fault" => caused(&[], &[("input.forced_open", "on")], 5),
        "forced_open_warning" => caused(&[("forced_open_fault", "0")], &[("input.forced_open", "on")], 5),
        "s1_genset_fault" => sets("genset1", &[("gensets", "2"), ("genset_choice", "1")]),
        "s2_genset_fault" | "genset_fault" => sets("genset", &[]),
        "ats_tripping_fault" | "qs1_tripping_fault" => caused(&[], &[("switch.qs1", "trips")], 5),
        "qs2_tripping_fault" => caused(&[], &[("switch.qs2", "trips")], 5),
        "qtie_tripping_fault" => {
            let mut site = caused(&[], &[("src1", "failed")], 20);
            pull(&mut site, "switch.qtie", "trips");
            site.pass_seconds(5);
            site
        }
        "sync_failure_fault" => apart(&[("loop_closing", "1"), ("sync_fault", "1"), ("sync_time", "5")]),
        "sync_failure_warning" => apart(&[("loop_closing", "1"), ("sync_time", "5")]),
        "ats_parallel_connection" => joined(),
        "s1_pt_broken_wire" => caused(&[], &[("src1.pt", "l1_broken")], 5),
        "s2_pt_broken_wire" => caused(&[], &[("src2.pt", "l3_broken")], 5),
        "s1_reverse_power_fault" => caused(&[], &[("infeed1", "4000")], 5),
        "s2_reverse_power_fault" => caused(&[], &[("infeed2", "4000")], 5),
        module if module.contains("_module_") => silent(module),
        of_loads => load_switch(of_loads),
    }
}

/// Three times what is rated.
fn heavy(load: &str, rated: &str, seconds: u64) -> Site {
    let low = if rated == "rated_current" { "100" } else { "1500" };
    let still =
        [("smart_unloading", "0"), ("nel_count", "0"), ("overcurrent_trip_delay", "10"), (rated, low)];
    caused(&still, &[(load, "2200")], seconds)
}

/// Nobody has mains, and a set does not start.
fn sets(genset: &str, settings: &[(&str, &str)]) -> Site {
    caused(settings, &[(genset, "will_not_start"), ("src1", "failed"), ("src2", "failed")], 50)
}

/// Sources that are to be joined and do not fit.
fn apart(settings: &[(&str, &str)]) -> Site {
    let mut site = caused(settings, &[("src2.angle", "60")], 1);
    set(&mut site, "transfer_110");
    site.pass_seconds(10);
    site
}

/// Sources that are joined and stay so.
fn joined() -> Site {
    let settings = [("loop_closing", "1"), ("parallel_time", "2")];
    let mut site = caused(&settings, &[("switch.qs2", "will_not_open")], 1);
    set(&mut site, "transfer_110");
    site.pass_seconds(4);
    site
}

/// `input_module_2_comm_failure` and the like.
fn silent(alarm: &str) -> Site {
    let mut parts = alarm.split('_');
    let (kind, number) = (parts.next().unwrap(), parts.nth(1).unwrap());
    let is_fault = if alarm.ends_with("failure") { "1" } else { "0" };
    caused(&[("module_fault", is_fault)], &[(&format!("module.{kind}_{number}"), "silent")], 5)
}

/// `load_1_3_trip`, `l1_transfer_failure_fault` and the like.
fn load_switch(alarm: &str) -> Site {
    if let Some(rest) = alarm.strip_prefix('l').filter(|rest| rest.starts_with(['1', '2'])) {
        let mut site = with(&[("load_switch_fault", if rest.ends_with("fault") { "1" } else { "0" })]);
        let side = &rest[..1];
        pull(&mut site, &format!("switch.l{side}_8"), "will_not_open");
        set(&mut site, &format!("load_{side}_8_open"));
        site.pass_seconds(5);
        return site;
    }
    if alarm == "load_ats_trip_warning" {
        return caused(&[], &[("switch.l1_1", "trips")], 1);
    }
    let [_, side, number, what] = alarm.splitn(4, '_').collect::<Vec<_>>()[..] else { panic!("{alarm}") };
    let (lever, switch) = (format!("switch.l{side}_{number}"), format!("load_{side}_{number}"));
    let mut site = quiet();
    match what {
        "trip" => pull(&mut site, &lever, "trips"),
        "opening_failure" => {
            pull(&mut site, &lever, "will_not_open");
            set(&mut site, &format!("{switch}_open"));
        }
        "closing_failure" => {
            pull(&mut site, &lever, "will_not_close");
            set(&mut site, &format!("{switch}_open"));
            site.pass_seconds(2);
            set(&mut site, &format!("{switch}_close"));
        }
        _ => panic!("nobody said what causes {alarm}"),
    }
    site.pass_seconds(5);
    site
}

#[test]
fn every_alarm_has_its_cause_and_goes_with_it() {
    let alarms: Vec<_> = quiet().device.alarms().collect();
    assert_eq!(alarms.len(), 57 + 6 * 12);
    for alarm in alarms {
        let mut site = cause(alarm.id);
        assert!(has(&site, alarm.id), "{}: {:?}, {:?}", alarm.id, active(&site), positions(&site));
        assert!(bit(&site, "common_status", 0) && site.device.misfits() == 0, "{}", alarm.id);
        let healthy: Vec<_> =
            site.device.levers().iter().map(|lever| (lever.id, lever.words[0].id)).collect();
        healthy.iter().for_each(|(lever, word)| pull(&mut site, lever, word));
        let standard: Vec<_> = site.device.settings().map(|(setting, _)| setting).collect();
        standard.iter().for_each(|it| site.device.set(&it.id, &it.value.to_string()).unwrap());
        site.pass_seconds(2);
        set(&mut site, "alarm_reset");
        site.pass_seconds(40);
        assert_eq!(active(&site), Vec::<&str>::new(), "after {}", alarm.id);
        assert!(!bit(&site, "common_status", 0), "{}", alarm.id);
    }
}

#[test]
fn every_alarm_can_be_injected_or_follows_from_others() {
    let alarms: Vec<_> = quiet().device.alarms().collect();
    let mut derived = Vec::new();
    for alarm in alarms {
        let mut site = quiet();
        let name = format!("{}.{}", alarm.point, alarm.id);
        if let Err(error) = site.device.inject(&name, true) {
            assert_eq!(error.to_string(), format!("`{name}` follows from other alarms; inject one of those"));
            derived.push(alarm.id);
            continue;
        }
        for _ in 0..3 {
            site.pass_seconds(4);
            assert!(has(&site, alarm.id) && bit(&site, "common_status", 0), "{name}");
            set(&mut site, "alarm_reset");
        }
        site.device.inject(&name, false).unwrap();
        set(&mut site, "alarm_reset");
        site.pass_seconds(40);
        assert_eq!(active(&site), Vec::<&str>::new(), "after {name}");
    }
    assert_eq!(
        derived,
        [
            "ats_transfer_failure",
            "ats_tripping_fault",
            "genset_fault",
            "l1_transfer_failure_fault",
            "l2_transfer_failure_fault",
            "load_ats_trip_warning",
            "l1_transfer_failure_warning",
            "l2_transfer_failure_warning",
        ]
    );
}

#[test]
fn faults_open_what_they_are_of_and_keep_it_open() {
    for (alarm, reached) in [
        ("ground_fault", [0, 0, 0]),
        ("qs1_ground_overcurrent", [0, 0, 1]),
        ("qs2_ground_overcurrent", [1, 0, 0]),
        ("s1_load_overcurrent_trip", [0, 0, 1]),
        ("s2_load_overcurrent_trip", [1, 0, 0]),
        ("forced_open_fault", [0, 0, 0]),
        ("qs1_tripping_fault", [0, 0, 1]),
        ("qs2_tripping_fault", [1, 0, 0]),
        ("qtie_tripping_fault", [1, 0, 1]),
        ("s1_reverse_power_fault", [0, 1, 1]),
        ("s2_reverse_power_fault", [1, 1, 0]),
        ("s1_close_failure", [1, 0, 1]),
        ("overload", [1, 0, 1]),
        ("ground_fault_warning", [1, 0, 1]),
    ] {
        let mut site = quiet();
        site.device.inject(alarm, true).unwrap();
        site.pass_seconds(20);
        assert_eq!(positions(&site), reached, "{alarm}");
        for command in ["transfer_101", "transfer_110", "transfer_011"] {
            let closes = |digit: usize| command.as_bytes()["transfer_".len() + digit] == b'1';
            let barred = (0..3).any(|digit| closes(digit) && reached[digit] == 0);
            set(&mut site, command);
            site.pass_seconds(8);
            if barred && reached != [1, 0, 1] {
                assert_eq!(positions(&site), reached, "{alarm}: {command}");
            }
        }
        site.device.inject(alarm, false).unwrap();
        set(&mut site, "alarm_reset");
        send(&mut site, 15004, super::ON);
        site.pass_seconds(40);
        assert_eq!(positions(&site), [1, 0, 1], "after {alarm}");
    }
}

#[test]
fn behind_a_fault_nothing_is_closed_from_the_other_side() {
    let mut site = caused(&[], &[("src2", "failed")], 20);
    assert_eq!(positions(&site), [1, 1, 0]);
    pull(&mut site, "src2", "normal");
    pull(&mut site, "earth_fault1", "200");
    site.pass_seconds(30);
    assert_eq!(positions(&site), [0, 0, 1], "source 2 feeds its own section alone");
    assert_eq!(active(&site), ["ground_fault"]);
    pull(&mut site, "earth_fault1", "none");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [0, 0, 1]);
    set(&mut site, "alarm_reset");
    site.pass_seconds(10);
    assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec![]));

    // A short circuit that is still there is met again.
    let mut site = caused(&[], &[("short_circuit1", "present")], 5);
    assert_eq!(positions(&site), [0, 0, 1]);
    set(&mut site, "alarm_reset");
    site.pass_seconds(5);
    assert_eq!((positions(&site), active(&site)), ([0, 0, 1], vec!["qs1_ground_overcurrent"]));
}

#[test]
fn a_broken_wire_is_told_from_a_missing_phase_by_the_current() {
    let mut site = quiet();
    pull(&mut site, "src1.pt", "l2_broken");
    site.pass_seconds(1);
    assert_eq!(site.code("s1_voltage_status"), 1, "in doubt at first");
    site.pass_seconds(10);
    assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec!["s1_pt_broken_wire"]));
    assert_eq!((site.code("s1_voltage_status"), site.number("s1_b_voltage")), (2, 0.0));
    assert!(site.number("s1_b_current") > 50.0 && site.number("s1_b_active_power") == 0.0);
    // It stays known while no current flows.
    set(&mut site, "transfer_001");
    site.pass_seconds(10);
    assert_eq!(active(&site), ["s1_pt_broken_wire"]);
    pull(&mut site, "src1.pt", "normal");
    site.pass_seconds(1);
    assert!(active(&site).is_empty());

    let mut site = quiet();
    set(&mut site, "transfer_001");
    site.pass_seconds(5);
    pull(&mut site, "src1.pt", "l2_broken");
    site.pass_seconds(10);
    assert_eq!(site.code("s1_voltage_status"), 8, "without current nobody can tell");
}

#[test]
fn power_that_flows_back_makes_a_source_bad_until_it_is_reset() {
    let mut site = quiet();
    pull(&mut site, "infeed1", "4000");
    site.pass_seconds(2);
    assert!(site.number("s1_active_power") > 1000.0, "an amount, for the register has no sign");
    site.pass_seconds(20);
    assert_eq!((positions(&site), site.code("s1_voltage_status")), ([0, 1, 1], 10));
    assert!(bit(&site, "s1_power", 15) && active(&site).contains(&"s1_reverse_power_fault"));
    pull(&mut site, "infeed1", "none");
    set(&mut site, "alarm_reset");
    site.pass_seconds(60);
    assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec![]));
}

#[test]
fn a_close_failure_leaves_the_others_to_be_used() {
    let mut site = quiet();
    pull(&mut site, "src1", "failed");
    site.pass_seconds(20);
    pull(&mut site, "switch.qs1", "will_not_close");
    pull(&mut site, "src1", "normal");
    site.pass_seconds(40);
    assert_eq!((positions(&site), has(&site, "s1_close_failure")), ([0, 1, 1], true));
    pull(&mut site, "switch.qs1", "normal");
    set(&mut site, "alarm_reset");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [1, 0, 1]);
}

#[test]
fn a_tie_that_trips_is_not_closed_again() {
    let mut site = caused(&[], &[("src1", "failed")], 20);
    pull(&mut site, "switch.qtie", "trips");
    pull(&mut site, "switch.qtie", "normal");
    site.pass_seconds(20);
    assert_eq!(positions(&site), [0, 0, 1]);
    assert_eq!(active(&site), ["ats_tripping_fault", "qtie_tripping_fault"]);
    set(&mut site, "alarm_reset");
    site.pass_seconds(5);
    assert_eq!(positions(&site), [0, 1, 1]);
}

#[test]
fn the_horn_sounds_for_as_long_as_it_is_set_to() {
    let mut site = with(&[("horn_time", "8")]);
    pull(&mut site, "switch.l1_1", "trips");
    site.pass_seconds(5);
    assert!(bit(&site, "common_status", 6) && bit(&site, "aux_outputs", 1));
    site.pass_seconds(5);
    assert!(!bit(&site, "common_status", 6) && bit(&site, "aux_outputs", 2));
    // One goes as another one comes.
    site.device.set("forced_open_fault", "0").unwrap();
    pull(&mut site, "module.input_1", "silent");
    site.pass_seconds(12);
    assert!(has(&site, "input_module_1_comm_warning") && !bit(&site, "common_status", 6));
    pull(&mut site, "module.input_1", "normal");
    pull(&mut site, "input.forced_open", "on");
    site.pass_seconds(1);
    assert!(bit(&site, "common_status", 6));
}
