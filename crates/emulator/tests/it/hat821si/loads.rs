//! Load switches and what is shed: worn switches, priorities, sources that carry too much, modules that are silent.

use std::collections::BTreeSet;

use super::{active, bit, has, positions, pull, quiet, send, set, until, with};
use crate::site::TENTH;

#[test]
fn a_load_switch_that_does_not_move_is_told_of_and_the_others_go_on() {
    let mut site = quiet();
    pull(&mut site, "switch.l1_5", "will_not_close");
    set(&mut site, "transfer_001");
    site.pass_seconds(5);
    set(&mut site, "transfer_101");
    site.pass_seconds(40);
    let closed = site.bits("load_1_closed");
    assert!(closed.len() == 11 && !closed.contains(4), "{closed:?}");
    assert_eq!(active(&site), ["l1_transfer_failure_warning", "load_1_5_closing_failure"]);
    assert_eq!(site.number("load_1_transfer_failure_number"), 5.0);
    pull(&mut site, "switch.l1_5", "normal");
    set(&mut site, "load_1_5_close");
    site.pass_seconds(5);
    assert!(!bit(&site, "load_1_closed", 4), "not before a reset");
    set(&mut site, "alarm_reset");
    set(&mut site, "load_1_5_close");
    site.pass_seconds(5);
    assert!(bit(&site, "load_1_closed", 4));
    assert_eq!(site.number("load_1_transfer_failure_number"), 0.0);

    let mut site = with(&[("load_switch_fault", "1"), ("load_switch_time", "8")]);
    pull(&mut site, "switch.l2_12", "will_not_open");
    set(&mut site, "load_2_12_open");
    site.pass_seconds(7);
    assert!(active(&site).is_empty());
    site.pass_seconds(2);
    assert_eq!(active(&site), ["l2_transfer_failure_fault", "load_2_12_opening_failure"]);
    assert!(bit(&site, "load_2_closed", 11) && bit(&site, "common_status", 2));
}

#[test]
fn a_load_switch_that_is_drawn_out_carries_nothing() {
    let mut site = quiet();
    let before = site.number("s1_active_power");
    pull(&mut site, "switch.l1_9.position", "test");
    site.pass_seconds(1);
    assert!(bit(&site, "load_1_testing_positions", 8) && !bit(&site, "load_1_work_positions", 8));
    assert!(!bit(&site, "load_1_closed", 8), "closed, it opens first");
    let without = site.number("s1_active_power");
    assert!(before - without > 80.0);
    set(&mut site, "load_1_9_close");
    site.pass_seconds(2);
    assert!(bit(&site, "load_1_closed", 8) && (site.number("s1_active_power") - without).abs() < 60.0);
    pull(&mut site, "switch.l1_9.position", "work");
    site.pass_seconds(5);
    assert!(!bit(&site, "load_1_closed", 8) && bit(&site, "load_1_work_positions", 8));
    assert_eq!(active(&site), Vec::<&str>::new());
}

#[test]
fn a_trip_stays_until_its_cause_has_gone_and_it_is_reset() {
    let mut site = quiet();
    pull(&mut site, "switch.l2_4", "trips");
    site.pass(TENTH);
    assert_eq!(active(&site), ["load_ats_trip_warning", "load_2_4_trip"]);
    assert!(!bit(&site, "load_2_closed", 3) && bit(&site, "input_module_4", 3));
    set(&mut site, "alarm_reset");
    site.pass(TENTH);
    assert!(has(&site, "load_2_4_trip"), "the contact is still closed");
    pull(&mut site, "switch.l2_4", "normal");
    site.pass(TENTH);
    assert!(has(&site, "load_2_4_trip"), "latched");
    set(&mut site, "alarm_reset");
    set(&mut site, "load_2_4_close");
    site.pass_seconds(1);
    assert_eq!((active(&site), bit(&site, "load_2_closed", 3)), (vec![], true));
}

#[test]
fn load_switches_come_back_by_their_priority_at_their_pace() {
    let mut site = with(&[
        ("load_interval", "3"),
        ("load_1_1_priority", "0"),
        ("load_1_2_priority", "9"),
        ("load_1_9_priority", "2"),
    ]);
    set(&mut site, "transfer_000");
    site.pass_seconds(5);
    set(&mut site, "transfer_101");
    let mut order = Vec::new();
    for _ in 0..600 {
        site.pass(TENTH);
        order.extend(site.bits("load_1_closing_outputs").iter().map(|bit| bit + 1));
        order.dedup();
    }
    assert_eq!(order, [9, 3, 4, 5, 6, 7, 8, 2, 10, 11, 12]);
    assert!(!bit(&site, "load_1_closed", 0), "it does not come back by itself");
}

#[test]
fn non_essential_consumers_are_shed_step_by_step() {
    let mut site = quiet();
    pull(&mut site, "load1", "5700");
    site.pass_seconds(4);
    assert_eq!(site.bits("controls_and_inhibits").register(0) & 7, 0);
    let before = site.number("s1_active_power");
    site.pass_seconds(3);
    assert_eq!(site.bits("controls_and_inhibits").register(0) & 7, 1);
    assert!(before - site.number("s1_active_power") > 250.0);
    pull(&mut site, "load1", "6000");
    site.pass_seconds(8);
    assert_eq!(site.bits("controls_and_inhibits").register(0) & 7, 3);
    pull(&mut site, "load1", "varies");
    site.pass_seconds(60);
    assert_eq!(site.bits("controls_and_inhibits").register(0) & 7, 0);
}

#[test]
fn a_source_that_carries_too_much_gives_up_the_least_important_first() {
    let mut site = with(&[("nel_count", "0"), ("source_1_capacity", "4000"), ("overload_level", "500")]);
    for section in ["load1", "load2"] {
        pull(&mut site, section, "2400");
    }
    site.pass_seconds(10);
    assert!(site.bits("unloading").is_empty());
    pull(&mut site, "src2", "failed");
    site.pass_seconds(60);
    assert_eq!(positions(&site), [1, 1, 0]);
    let unloaded = [1, 2].map(|side| site.bits(&format!("load_{side}_smart_unloading")));
    let all = unloaded[0].union(&unloaded[1]);
    assert!(unloaded[1].len() >= unloaded[0].len(), "the guest goes first: {unloaded:?}");
    assert!(all.len() > 1 && all.iter().all(|bit| bit >= 12 - all.len() as u16 - 1), "{unloaded:?}");
    assert!(bit(&site, "unloading", 0) && !bit(&site, "unloading", 1));
    assert!(site.number("s1_active_power") <= 4000.0);
    let open = 24 - site.bits("load_1_closed").len() - site.bits("load_2_closed").len();
    assert_eq!(open, unloaded[0].len() + unloaded[1].len());

    pull(&mut site, "src2", "normal");
    let mut recovering = BTreeSet::new();
    for _ in 0..900 {
        site.pass(TENTH);
        recovering.insert(site.bits("unloading").register(0));
    }
    assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);
    assert!(site.bits("unloading").is_empty() && site.bits("load_2_smart_unloading").is_empty());
    assert!(recovering.contains(&0b0101), "{recovering:?}");

    let mut site = with(&[("nel_count", "0"), ("smart_unloading", "0"), ("source_1_capacity", "3000")]);
    pull(&mut site, "src2", "failed");
    site.pass_seconds(60);
    assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);
    assert!(has(&site, "overload"));
}

#[test]
fn what_falls_comes_back_only_as_far_as_the_source_carries_it() {
    let mut site = with(&[("nel_count", "0"), ("genset_capacity", "2000")]);
    for section in ["load1", "load2"] {
        pull(&mut site, section, "2400");
    }
    for source in ["src1", "src2"] {
        pull(&mut site, source, "failed");
    }
    let mut most = 0.0_f64;
    for _ in 0..120 {
        site.pass_seconds(1);
        most = most.max(site.number("s2_active_power"));
    }
    assert_eq!(positions(&site), [0, 1, 1]);
    assert!(most < 2300.0, "{most}");
    let closed = site.bits("load_1_closed").len() + site.bits("load_2_closed").len();
    assert!((6..=11).contains(&closed), "{closed}");
    let unloaded = site.bits("load_1_smart_unloading").len() + site.bits("load_2_smart_unloading").len();
    assert_eq!(closed + unloaded, 24);
    pull(&mut site, "src1", "normal");
    site.pass_seconds(120);
    assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);
}

#[test]
fn a_silent_output_module_moves_nothing() {
    let mut site = quiet();
    pull(&mut site, "module.output_2", "silent");
    set(&mut site, "load_1_2_open");
    site.pass_seconds(5);
    assert!(has(&site, "load_1_2_opening_failure") && has(&site, "output_module_2_comm_warning"));
    set(&mut site, "load_1_8_open");
    site.pass_seconds(2);
    assert!(!bit(&site, "load_1_closed", 7), "its output is on module 4");
    set(&mut site, "load_1_8_close");
    site.pass_seconds(5);
    assert!(has(&site, "load_1_8_closing_failure"));
    assert!(site.bits("output_module_2").is_empty());

    send(&mut site, 15013, super::ON);
    assert!(bit(&site, "output_module_1", 1));
    pull(&mut site, "module.output_1", "silent");
    site.pass(TENTH);
    assert!(site.bits("output_module_1").is_empty());
}

#[test]
fn outputs_show_on_their_modules() {
    for (coil, point, number) in [
        ("load_1_3_close", "output_module_2", 2),
        ("load_1_3_open", "output_module_2", 14),
        ("load_2_4_open", "output_module_3", 15),
        ("load_1_5_open", "output_module_4", 0),
        ("load_1_12_open", "output_module_4", 7),
        ("load_2_5_open", "output_module_4", 8),
        ("load_2_12_open", "output_module_4", 15),
    ] {
        let mut site = quiet();
        if coil.ends_with("close") {
            set(&mut site, &coil.replace("close", "open"));
            site.pass_seconds(1);
        }
        set(&mut site, coil);
        assert_eq!(site.bits(point).iter().collect::<Vec<_>>(), [number], "{coil}");
    }
}

#[test]
fn a_silent_input_module_leaves_what_was_heard_last() {
    let mut site = quiet();
    pull(&mut site, "module.input_2", "silent");
    pull(&mut site, "switch.l2_6.position", "test");
    site.pass_seconds(3);
    assert!(bit(&site, "load_2_closed", 5) && !bit(&site, "load_2_work_positions", 5));
    assert_eq!(active(&site), ["input_module_2_comm_warning"]);
    pull(&mut site, "module.input_2", "normal");
    site.pass_seconds(1);
    assert!(!bit(&site, "load_2_closed", 5) && active(&site).is_empty());
}

#[test]
fn consumers_take_what_they_are_set_to() {
    let mut site = quiet();
    pull(&mut site, "load1", "1500");
    pull(&mut site, "load1.power_factor", "0.8");
    pull(&mut site, "load2", "0");
    site.pass_seconds(5);
    // The voltage is not exactly the rated one.
    assert!((site.number("s1_active_power") / 1500.0 - 1.0).abs() < 0.05);
    assert!((site.number("s1_average_power_factor") - 80.0).abs() <= 1.0);
    assert_eq!(site.number("s2_active_power"), 0.0);
    until(&mut site, 10, "still fed", |site| positions(site) == [1, 0, 1]);
}
