//! Gensets behind the sources: why they are started, when they carry load, and what is said when they do not run.

use super::{active, bit, has, positions, pull, quiet, send, set, until, with};
use crate::site::Site;

fn fail_both(site: &mut Site) {
    pull(site, "src1", "failed");
    pull(site, "src2", "failed");
}

#[test]
fn without_mains_the_genset_feeds_both_sections_until_mains_are_back() {
    for (returns, reached) in [("src1", [1, 1, 0]), ("src2", [0, 1, 1])] {
        let mut site = quiet();
        fail_both(&mut site);
        site.pass_seconds(6);
        assert_eq!((site.code("genset_status"), bit(&site, "switches", 14)), (0, true));
        site.pass_seconds(40);
        assert_eq!((site.code("genset_status"), positions(&site)), (8, [0, 1, 1]));
        assert!(site.number("s2_active_power") > 2000.0 && bit(&site, "aux_outputs", 5));
        pull(&mut site, returns, "normal");
        site.pass_seconds(40);
        assert_eq!((site.code("genset_status"), positions(&site)), (9, reached), "{returns}");
        assert!(!bit(&site, "switches", 14) && active(&site).is_empty());
    }
}

#[test]
fn mains_that_are_ill_are_replaced_as_dead_ones_are() {
    for trouble in ["sagging", "swelling", "l2_lost", "reversed"] {
        let mut site = quiet();
        pull(&mut site, "src1", trouble);
        pull(&mut site, "src2", trouble);
        site.pass_seconds(60);
        assert_eq!((positions(&site), site.code("s2_voltage_status")), ([0, 1, 1], 2), "{trouble}");
    }
}

#[test]
fn contacts_start_it_with_and_without_load() {
    let mut site = quiet();
    pull(&mut site, "input.remote_start_off_load", "on");
    site.pass_seconds(15);
    assert!(bit(&site, "switches", 13) && bit(&site, "aux_inputs", 3));
    assert_eq!((site.code("genset_status"), positions(&site)), (8, [1, 0, 1]));
    let mains = site.number("s2_frequency");
    assert!((mains - 50.0).abs() < 0.06, "it feeds nothing: {mains}");
    pull(&mut site, "input.remote_start_off_load", "off");
    pull(&mut site, "input.remote_start_on_load", "on");
    site.pass_seconds(10);
    assert!(bit(&site, "switches", 12) && !bit(&site, "switches", 13));
    let genset = site.number("s2_frequency");
    assert!((49.5..49.95).contains(&genset), "the set carries section 2: {genset}");
    assert_eq!(positions(&site), [1, 0, 1]);
    pull(&mut site, "input.start_inhibit", "on");
    site.pass_seconds(10);
    assert!(bit(&site, "start_and_inhibits", 10) && site.code("genset_status") == 9);
    assert!((site.number("s2_frequency") - 50.0).abs() < 0.06);
}

#[test]
fn the_clock_starts_it() {
    // Calendars start on a Monday at ten.
    let mut site = with(&[
        ("scheduled_run", "2"),
        ("scheduled_run_weekday", "1"),
        ("scheduled_run_hour", "10"),
        ("scheduled_run_minute", "1"),
        ("scheduled_run_length", "2"),
    ]);
    site.pass_seconds(55);
    assert_eq!(site.code("genset_status"), 9);
    site.pass_seconds(30);
    assert_eq!((site.code("genset_status"), site.number("genset_delay")), (3, 95.0));
    assert!(bit(&site, "switches", 15) && bit(&site, "common_status", 15));
    assert!(site.number("s2_frequency") < 49.95, "with load");
    site.pass_seconds(120);
    assert_eq!(site.code("genset_status"), 9);

    let mut site = with(&[
        ("scheduled_not_run", "1"),
        ("scheduled_not_run_hour", "10"),
        ("scheduled_not_run_length", "3"),
    ]);
    fail_both(&mut site);
    site.pass_seconds(60);
    assert_eq!((site.code("genset_status"), site.number("genset_delay")), (2, 120.0));
    assert!(bit(&site, "start_and_inhibits", 4) && !bit(&site, "common_status", 15));
    site.pass_seconds(150);
    assert_eq!(site.code("genset_status"), 8);
}

#[test]
fn a_set_that_does_not_run_is_a_fault() {
    let mut site = quiet();
    pull(&mut site, "genset", "will_not_start");
    fail_both(&mut site);
    site.pass_seconds(60);
    assert_eq!(active(&site), ["s2_genset_fault", "genset_fault"]);
    assert!(!bit(&site, "common_status", 15), "it is not asked again");
    pull(&mut site, "genset", "normal");
    set(&mut site, "alarm_reset");
    site.pass_seconds(40);
    assert_eq!((positions(&site), active(&site)), ([0, 1, 1], vec![]));
    pull(&mut site, "genset", "fails");
    site.pass_seconds(60);
    assert!(has(&site, "s2_genset_fault") && site.number("s2_a_voltage") == 0.0);
}

#[test]
fn of_two_sets_one_is_started_and_the_other_stands_in() {
    let master = [("gensets", "2"), ("genset_choice", "1")];
    let mut site = with(&master);
    fail_both(&mut site);
    site.pass_seconds(60);
    assert!(bit(&site, "start_and_inhibits", 2) && bit(&site, "aux_outputs", 4));
    assert_eq!(positions(&site), [1, 1, 0]);
    pull(&mut site, "genset1", "fails");
    site.pass_seconds(90);
    assert_eq!((positions(&site), active(&site)), ([0, 1, 1], vec!["s1_genset_fault", "genset_fault"]));

    let mut site =
        with(&[("gensets", "2"), ("genset_choice", "0"), ("genset_2_turn", "2"), ("genset_1_turn", "3")]);
    fail_both(&mut site);
    site.pass_seconds(60);
    assert!(bit(&site, "start_and_inhibits", 0));
    assert_eq!(positions(&site), [0, 1, 1]);
    let fed = |site: &Site| positions(site) != [0, 1, 1] || site.number("s2_a_voltage") > 5000.0;
    let tenths = until(&mut site, 2000, "the other one", |site| {
        assert!(fed(site), "the first one goes on until the other one has its load");
        positions(site) == [1, 1, 0]
    });
    assert!(tenths > 600, "{tenths}");
    until(&mut site, 3000, "and back", |site| positions(site) == [0, 1, 1]);

    let mut site = with(&[("gensets", "2"), ("genset_choice", "2")]);
    fail_both(&mut site);
    site.pass_seconds(60);
    assert!(bit(&site, "start_and_inhibits", 1));
}

#[test]
fn manual_mode_stops_no_genset_that_somebody_needs() {
    let mut site = quiet();
    fail_both(&mut site);
    site.pass_seconds(60);
    send(&mut site, 15004, super::OFF);
    pull(&mut site, "input.start_inhibit", "on");
    site.pass_seconds(60);
    assert!(site.number("s2_a_voltage") > 5000.0 && bit(&site, "switches", 14));
    set(&mut site, "genset_stop");
    site.pass_seconds(10);
    assert_eq!((site.number("s2_a_voltage"), site.code("genset_status")), (0.0, 9));
}

#[test]
fn a_start_that_is_inhibited_is_forgotten() {
    let mut site = quiet();
    pull(&mut site, "input.start_inhibit", "on");
    site.pass_seconds(1);
    set(&mut site, "genset_start");
    site.pass_seconds(5);
    pull(&mut site, "input.start_inhibit", "off");
    site.pass_seconds(30);
    assert!(!bit(&site, "common_status", 15) && site.code("genset_status") == 9);
}

#[test]
fn a_stop_over_the_wire_ends_what_a_start_over_the_wire_began() {
    let mut site = quiet();
    send(&mut site, 15004, super::OFF);
    set(&mut site, "genset_start");
    site.pass_seconds(20);
    assert!(bit(&site, "common_status", 15));
    set(&mut site, "genset_stop");
    site.pass_seconds(10);
    assert!(!bit(&site, "common_status", 15));
}

#[test]
fn mains_that_return_are_joined_with_the_genset_where_that_is_set() {
    let mut site = with(&[("loop_closing", "1")]);
    ["load1", "load2"].iter().for_each(|load| pull(&mut site, load, "1000"));
    fail_both(&mut site);
    site.pass_seconds(60);
    pull(&mut site, "src1", "normal");
    until(&mut site, 600, "joined", |site| positions(site) == [1; 3]);
    for _ in 0..30 {
        site.pass_seconds(1);
        assert_eq!(site.bits("load_2_closed").len(), 12, "nobody falls when the set stops");
    }
    assert_eq!((positions(&site), active(&site)), ([1, 1, 0], vec![]));
    assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);
}
