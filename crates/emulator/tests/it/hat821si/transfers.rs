//! Sources that fail and return, and how the switches follow: with a gap, without one, and not at all.

use std::collections::BTreeSet;

use super::{active, bit, has, positions, pull, quiet, send, set, until, with};
use crate::site::{Site, TENTH};

const S1_MASTER: u16 = 15005;

#[test]
fn each_trouble_of_a_source_has_its_status_and_moves_its_section() {
    for (lever, to, status) in [
        ("", "failed", 3),
        ("", "swelling", 4),
        ("", "sagging", 5),
        ("", "l1_lost", 8),
        ("", "l2_lost", 8),
        ("", "l3_lost", 8),
        ("", "reversed", 9),
        (".voltage", "7200", 4),
        (".voltage", "4000", 5),
        (".voltage", "0", 3),
        (".frequency", "56", 6),
        (".frequency", "44", 7),
    ] {
        for (source, replaced) in [(1, [0, 1, 1]), (2, [1, 1, 0])] {
            let mut site = quiet();
            let lever = format!("src{source}{lever}");
            pull(&mut site, &lever, to);
            site.pass_seconds(4);
            assert_eq!(site.code(&format!("s{source}_voltage_status")), 1, "{lever} {to}: in doubt");
            assert_eq!(positions(&site), [1, 0, 1], "{lever} {to}");
            site.pass_seconds(16);
            assert_eq!(site.code(&format!("s{source}_voltage_status")), status, "{lever} {to}");
            let kind = u16::try_from(status).unwrap() + 5;
            assert!(bit(&site, &format!("s{source}_power"), kind), "{lever} {to}");
            assert_eq!(positions(&site), replaced, "{lever} {to}");
            let first = if lever.contains('.') { "normal" } else { site.device.levers()[0].words[0].id };
            pull(&mut site, &lever, first);
            site.pass_seconds(25);
            assert_eq!(positions(&site), [1, 0, 1], "{lever} {to}");
            assert_eq!(active(&site), Vec::<&str>::new(), "{lever} {to}");
        }
    }
}

#[test]
fn dips_that_are_shorter_than_the_delay_move_nothing() {
    let mut site = quiet();
    pull(&mut site, "src1", "flickering");
    let mut seen = BTreeSet::new();
    for _ in 0..600 {
        site.pass(TENTH);
        seen.insert(site.code("s1_voltage_status"));
        assert_eq!(positions(&site), [1, 0, 1]);
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn after_a_gap_of_whatever_length_everything_is_as_it_was() {
    for tenths in 1..40 {
        let mut site = quiet();
        pull(&mut site, "src1", "failed");
        site.pass(TENTH * tenths);
        pull(&mut site, "src1", "normal");
        site.pass_seconds(20);
        let closed = site.bits("load_1_closed").len() + site.bits("load_2_closed").len();
        assert_eq!((positions(&site), closed), ([1, 0, 1], 24), "{tenths} tenths");
    }
}

#[test]
fn a_switch_whose_first_closing_fails_is_closed_again_where_that_is_set() {
    for (again, left, alarms) in [("0", [0, 0, 1], vec!["qtie_close_failure"]), ("3", [0, 1, 1], vec![])] {
        let mut site = with(&[("closing_again_time", again)]);
        pull(&mut site, "switch.qtie", "closes_at_second");
        pull(&mut site, "src1", "failed");
        site.pass_seconds(20);
        assert_eq!((positions(&site), active(&site)), (left, alarms));
    }
}

#[test]
fn nobody_is_connected_to_a_source_that_has_just_failed() {
    let mut site = with(&[("s2_abnormal_delay", "30")]);
    pull(&mut site, "src1", "failed");
    site.pass_seconds(4);
    pull(&mut site, "src2", "failed");
    site.pass_seconds(10);
    assert_eq!((site.code("s2_voltage_status"), positions(&site)), (1, [1, 0, 1]));
    set(&mut site, "transfer_011");
    site.pass_seconds(5);
    assert_eq!(positions(&site), [1, 0, 1]);
    pull(&mut site, "src2", "normal");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [0, 1, 1]);
}

#[test]
fn delays_and_thresholds_are_as_they_are_set() {
    let mut site = with(&[("s1_abnormal_delay", "30"), ("s1_normal_delay", "3"), ("transfer_rest", "7")]);
    pull(&mut site, "src1", "failed");
    site.pass(TENTH * 292);
    assert_eq!((site.code("s1_voltage_status"), site.number("s1_voltage_delay")), (1, 1.0));
    let rest = until(&mut site, 30, "rest", |site| site.code("ats_status") == 5);
    assert!(rest > 5, "{rest}");
    let rested = until(&mut site, 100, "no rest", |site| site.code("ats_status") != 5);
    assert!((69..=71).contains(&rested), "{rested}");
    pull(&mut site, "src1", "normal");
    site.pass_seconds(2);
    assert_eq!((site.code("s1_voltage_status"), site.number("s1_voltage_delay")), (0, 2.0));

    let mut site = with(&[("under_voltage", "60"), ("phase_sequence_check", "0")]);
    pull(&mut site, "src1", "sagging");
    pull(&mut site, "src2", "reversed");
    site.pass_seconds(20);
    assert_eq!((site.code("s1_voltage_status"), site.code("s2_voltage_status")), (2, 2));
}

#[test]
fn without_restoring_it_stays_until_somebody_asks() {
    let mut site = with(&[("auto_restore", "0")]);
    pull(&mut site, "src1", "failed");
    site.pass_seconds(20);
    pull(&mut site, "src1", "normal");
    site.pass_seconds(30);
    assert_eq!(positions(&site), [0, 1, 1]);
    pull(&mut site, "input.auto_restore", "on");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [1, 0, 1]);
    assert!(bit(&site, "controls_and_inhibits", 11) && bit(&site, "aux_inputs", 9));

    let mut site = with(&[("auto_restore", "0")]);
    pull(&mut site, "src2", "failed");
    site.pass_seconds(20);
    pull(&mut site, "src2", "normal");
    site.pass_seconds(30);
    assert_eq!(positions(&site), [1, 1, 0]);
    send(&mut site, S1_MASTER, super::ON);
    site.pass_seconds(10);
    assert_eq!(positions(&site), [1, 0, 1]);
}

/// The statuses on the way from a command until all is done.
fn walk(site: &mut Site, command: &str) -> Vec<u32> {
    set(site, command);
    let mut seen = Vec::new();
    for _ in 0..300 {
        site.pass(TENTH);
        seen.push(site.code("ats_status"));
        seen.dedup();
    }
    seen
}

#[test]
fn a_loop_closing_interrupts_nobody() {
    let mut site = with(&[("loop_closing", "1")]);
    site.pass(TENTH);
    assert!(!bit(&site, "common_status", 12));
    assert_eq!(site.number("parallel_mode"), 1.0);
    let mut power: Vec<f64> = Vec::new();
    for (command, statuses, reached) in [
        ("transfer_110", vec![0, 10, 9, 30, 4, 22], [1, 1, 0]),
        ("transfer_011", vec![0, 10, 12, 30, 2, 23], [0, 1, 1]),
        ("transfer_101", vec![0, 10, 11, 30, 21, 24], [1, 0, 1]),
    ] {
        assert_eq!(walk(&mut site, command), statuses, "{command}");
        assert_eq!(positions(&site), reached, "{command}");
        assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);
        power.push(site.number("s1_active_power") + site.number("s2_active_power"));
    }
    assert!(power.iter().all(|kw| (kw / power[0] - 1.0).abs() < 0.1), "{power:?}");
    assert_eq!(active(&site), Vec::<&str>::new());

    set(&mut site, "transfer_110");
    let mut loops = false;
    for _ in 0..100 {
        site.pass(TENTH);
        let joined = positions(&site) == [1; 3];
        loops |= joined;
        assert!(!joined || bit(&site, "common_status", 12), "the mode says so");
        assert!(!joined || site.number("s1_active_power") > 0.0 && site.number("s2_active_power") > 0.0);
    }
    assert!(loops);
    // A source that has failed is left with a gap.
    set(&mut site, "transfer_101");
    site.pass_seconds(20);
    pull(&mut site, "src1", "failed");
    let mut seen = BTreeSet::new();
    for _ in 0..200 {
        site.pass(TENTH);
        seen.insert(site.code("ats_status"));
        assert_ne!(positions(&site), [1; 3]);
    }
    assert!(seen.contains(&5) && !seen.contains(&10));
    pull(&mut site, "src1", "normal");
    until(&mut site, 200, "joined again", |site| positions(site) == [1; 3]);
}

#[test]
fn sources_that_do_not_fit_are_waited_for() {
    let mut site = with(&[("loop_closing", "1"), ("sync_time", "20")]);
    pull(&mut site, "src2.angle", "25");
    set(&mut site, "transfer_110");
    site.pass_seconds(3);
    assert_eq!(site.code("ats_status"), 10);
    let left = site.number("sync_failure_delay");
    assert!((17.0..=18.0).contains(&left), "{left}");
    site.pass_seconds(25);
    assert!(has(&site, "sync_failure_warning") && !has(&site, "sync_failure_fault"));
    assert_eq!((site.code("ats_status"), positions(&site)), (10, [1, 0, 1]));
    pull(&mut site, "src2.angle", "normal");
    site.pass_seconds(10);
    assert_eq!((positions(&site), active(&site)), ([1, 1, 0], vec![]));

    let mut site = with(&[("loop_closing", "1"), ("sync_time", "20"), ("sync_fault", "1")]);
    pull(&mut site, "src2.angle", "25");
    set(&mut site, "transfer_110");
    site.pass_seconds(30);
    assert_eq!(active(&site), ["sync_failure_fault"]);
    pull(&mut site, "src2.angle", "normal");
    site.pass_seconds(10);
    assert_eq!((positions(&site), active(&site)), ([1, 1, 0], vec!["sync_failure_fault"]));
    set(&mut site, "alarm_reset");
    assert_eq!(active(&site), Vec::<&str>::new());

    let mut site = with(&[("loop_closing", "1"), ("sync_time", "20"), ("sync_fallback", "1")]);
    pull(&mut site, "src2.angle", "25");
    set(&mut site, "transfer_110");
    site.pass_seconds(40);
    assert_eq!((positions(&site), active(&site)), ([1, 1, 0], vec![]));
}

#[test]
fn sources_that_slip_are_joined_when_they_pass() {
    let mut site = with(&[("loop_closing", "1")]);
    pull(&mut site, "src2.frequency", "50.2");
    site.pass_seconds(1);
    set(&mut site, "transfer_110");
    until(&mut site, 100, "joined", |site| positions(site) == [1; 3]);
    assert!(site.number("phase_difference").abs() < 15.0, "{}", site.number("phase_difference"));
    site.pass_seconds(5);
    assert_eq!((positions(&site), active(&site)), ([1, 1, 0], vec![]));
}

#[test]
fn joined_out_of_step_the_relay_separates_them() {
    let mut site = with(&[("loop_closing", "1"), ("sync_check", "0")]);
    pull(&mut site, "src2.angle", "90");
    set(&mut site, "transfer_110");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [1, 0, 1]);
    assert_eq!(active(&site), ["ats_tripping_fault", "qtie_tripping_fault"]);
}

#[test]
fn elevators_stop_before_a_section_is_interrupted() {
    let mut site = with(&[("elevator_delay", "10")]);
    set(&mut site, "transfer_110");
    site.pass_seconds(5);
    assert_eq!((site.code("ats_status"), site.number("ats_delay")), (15, 6.0));
    assert!(bit(&site, "controls_and_inhibits", 5) && positions(&site) == [1, 0, 1]);
    site.pass_seconds(6);
    assert!(bit(&site, "controls_and_inhibits", 5), "until all is done");
    site.pass_seconds(5);
    assert!(!bit(&site, "controls_and_inhibits", 5) && positions(&site) == [1, 1, 0]);

    let mut site = with(&[("elevator_delay", "60")]);
    pull(&mut site, "src1", "failed");
    site.pass_seconds(20);
    assert_eq!(positions(&site), [0, 1, 1], "nothing stops where nothing runs");
}

#[test]
fn a_switch_that_is_not_ready_is_waited_for() {
    let mut site = quiet();
    set(&mut site, "transfer_001");
    site.pass_seconds(3);
    pull(&mut site, "switch.qs1.position", "test");
    set(&mut site, "transfer_101");
    site.pass_seconds(5);
    assert_eq!(site.code("ats_status"), 13);
    assert!(bit(&site, "start_and_inhibits", 14) && positions(&site) == [0, 0, 1]);
    pull(&mut site, "switch.qs1.position", "work");
    site.pass_seconds(3);
    assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec![]));

    set(&mut site, "transfer_001");
    site.pass_seconds(3);
    pull(&mut site, "switch.qs1.position", "test");
    set(&mut site, "transfer_101");
    site.pass_seconds(15);
    assert_eq!(active(&site), ["ats_transfer_failure", "s1_close_failure"]);
}

#[test]
fn a_switch_on_the_test_bench_carries_nothing() {
    let mut site = with(&[("position_feedback", "0")]);
    send(&mut site, 15004, super::OFF);
    set(&mut site, "transfer_001");
    site.pass_seconds(3);
    pull(&mut site, "switch.qs1.position", "test");
    set(&mut site, "transfer_101");
    site.pass_seconds(5);
    assert_eq!(positions(&site), [1, 0, 1]);
    assert_eq!(site.number("s1_active_power"), 0.0);
    assert!(site.bits("load_1_closed").is_empty());
}

#[test]
fn contacts_hold_switches_open() {
    for (input, word, number, wanted) in [
        ("s1_close_inhibit", "start_and_inhibits", 12, [0, 1, 1]),
        ("s2_close_inhibit", "start_and_inhibits", 13, [1, 1, 0]),
        ("qs1_qtie_close_inhibit", "tie_switch", 10, [0, 0, 1]),
        ("qs2_qtie_close_inhibit", "tie_switch", 11, [1, 0, 0]),
    ] {
        let mut site = quiet();
        pull(&mut site, &format!("input.{input}"), "on");
        site.pass_seconds(5);
        assert!(bit(&site, word, number), "{input}");
        assert_eq!(positions(&site), wanted, "{input}");
        pull(&mut site, &format!("input.{input}"), "off");
        site.pass_seconds(10);
        assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec![]), "{input}");
    }
    for (input, number, failed, left) in [
        ("qtie_close_inhibit", 8, "src1", [0, 0, 1]),
        ("s2_supply_qtie_inhibit", 14, "src1", [0, 0, 1]),
        ("s1_supply_qtie_inhibit", 13, "src2", [1, 0, 0]),
        ("s1_supply_qtie_inhibit", 13, "src1", [0, 1, 1]),
    ] {
        let mut site = quiet();
        pull(&mut site, &format!("input.{input}"), "on");
        pull(&mut site, failed, "failed");
        site.pass_seconds(20);
        assert!(bit(&site, "controls_and_inhibits", number), "{input}");
        assert_eq!(positions(&site), left, "{input}");
        send(&mut site, 15004, super::OFF);
        set(&mut site, if failed == "src1" { "transfer_011" } else { "transfer_110" });
        site.pass_seconds(10);
        assert_eq!(positions(&site), left, "{input}: the command is ignored");
    }
    // By hand a switch that is closed stays so.
    let mut site = quiet();
    send(&mut site, 15004, super::OFF);
    pull(&mut site, "input.s1_close_inhibit", "on");
    site.pass_seconds(10);
    assert_eq!(positions(&site), [1, 0, 1]);
}

#[test]
fn a_forced_opening_opens_everything_in_either_mode() {
    for mode in [super::ON, super::OFF] {
        let mut site = with(&[("elevator_delay", "60")]);
        send(&mut site, 15004, mode);
        pull(&mut site, "input.forced_open", "on");
        site.pass_seconds(3);
        assert_eq!((positions(&site), active(&site)), ([0; 3], vec!["forced_open_fault"]));
        set(&mut site, "transfer_101");
        pull(&mut site, "input.forced_open", "off");
        site.pass_seconds(10);
        assert_eq!(positions(&site), [0; 3], "until somebody resets it");
        set(&mut site, "alarm_reset");
        site.pass_seconds(5);
        let automatic = mode == super::ON;
        assert_eq!(positions(&site), if automatic { [1, 0, 1] } else { [0; 3] });
    }
    let mut site = with(&[("forced_open_fault", "0")]);
    pull(&mut site, "input.forced_open", "on");
    site.pass_seconds(3);
    assert_eq!((positions(&site), active(&site)), ([0; 3], vec!["forced_open_warning"]));
    pull(&mut site, "input.forced_open", "off");
    site.pass_seconds(5);
    assert_eq!((positions(&site), active(&site)), ([1, 0, 1], vec![]));
}

#[test]
fn remote_commands_are_ignored_while_a_contact_or_the_key_says_so() {
    for (lever, to, back) in [("front", "local", "remote"), ("input.remote_inhibit", "on", "off")] {
        let mut site = quiet();
        pull(&mut site, lever, to);
        site.pass(TENTH);
        let mut twin = quiet();
        pull(&mut twin, lever, to);
        twin.pass(TENTH);
        assert_eq!(bit(&site, "common_status", 9), lever == "front");
        assert_eq!(bit(&site, "controls_and_inhibits", 12), lever != "front");
        for coil in site.device.profile().coils.iter().map(|coil| coil.address) {
            send(&mut site, coil, super::OFF);
            send(&mut site, coil, super::ON);
        }
        for site in [&mut site, &mut twin] {
            site.pass_seconds(20);
        }
        assert_eq!(site.image(), twin.image(), "{lever}");
        pull(&mut site, lever, back);
        site.pass(TENTH);
        set(&mut site, "transfer_110");
        site.pass_seconds(5);
        assert_eq!(positions(&site), [1, 1, 0], "{lever}");
    }
}
