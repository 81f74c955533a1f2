//! Genset and mains on one bus bar: transfers without a break, peaks, exports.

use super::{LOAD_DUMP, WARNING, alarms, closed, load, pull, set, until};
use crate::site::{GCB, MCB, RUN, Site, TENTH, TEST};

/// What happened to the load on the way to a status.
struct Walk {
    statuses: Vec<u32>,
    /// Least kW of both feeds together, and the greatest change of the genset's kW in a tenth of a second.
    least: f64,
    steepest: f64,
    together: bool,
}

fn walk(site: &mut Site, status: u32) -> Walk {
    let mut walk = Walk {
        statuses: vec![site.code("operation_status")],
        least: f64::INFINITY,
        steepest: 0.0,
        together: false,
    };
    let mut before = site.number("genset_active_power");
    for _ in 0..3000 {
        site.pass(TENTH);
        let now = site.number("genset_active_power");
        walk.steepest = walk.steepest.max((now - before).abs());
        before = now;
        walk.least = walk.least.min(load(site));
        walk.together |= closed(site) == (true, true);
        let code = site.code("operation_status");
        if walk.statuses.last() != Some(&code) {
            walk.statuses.push(code);
        }
        if code == status {
            return walk;
        }
    }
    panic!("status {status} never came: {:?}", walk.statuses);
}

const HOME: [u32; 5] = [21, 22, 23, 25, 0];

#[test]
fn with_a_break_the_load_is_dark_for_a_moment_and_the_two_never_meet() {
    let mut site = Site::quiet();
    site.press(TEST);
    let out = walk(&mut site, 13);
    assert!(out.least == 0.0 && !out.together);
}

#[test]
fn a_soft_transfer_moves_the_load_slowly_there_and_back() {
    let mut site = set(&[("no_break_transfer", "1"), ("soft_transfer", "1")]);
    site.press(TEST);
    let out = walk(&mut site, 13);
    assert_eq!(out.statuses, [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 10, 13]);
    assert!(out.least > 20.0 && out.together && out.steepest < 6.0, "{} {}", out.least, out.steepest);
    assert!(site.number("mains_active_power") < 5.0);
    site.pass_seconds(20);

    site.press(crate::site::AUTO);
    let home = walk(&mut site, 0);
    assert_eq!(home.statuses, [&[13, 17, 18][..], &HOME].concat());
    assert!(home.least > 20.0 && home.steepest < 6.0, "{} {}", home.least, home.steepest);
    assert!(alarms(&site, WARNING).is_empty() && alarms(&site, LOAD_DUMP).is_empty());
}

#[test]
fn without_softness_the_breakers_overlap() {
    let mut site = set(&[("no_break_transfer", "1")]);
    site.press(TEST);
    let out = walk(&mut site, 13);
    assert_eq!(out.statuses, [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 13]);
    assert!(out.least > 20.0 && out.together);
    site.press(crate::site::AUTO);
    let home = walk(&mut site, 0);
    assert_eq!(home.statuses, [&[13, 17][..], &HOME].concat());
    assert!(home.least > 20.0);
}

#[test]
fn synchronizing_is_timed_flagged_and_led_by_the_outputs() {
    let mut site = set(&[("no_break_transfer", "1"), ("synchronizing_time", "90")]);
    site.press(TEST);
    site.walk_to(9);
    assert!(site.flag(65));
    assert_eq!(site.number("operation_timer"), 90.0);
    site.walk_to(13);
    assert!(!site.flag(65));
    let slip = site.number("mains_frequency") - site.number("genset_frequency");
    assert!(slip.abs() < 0.5, "{slip}");
    assert!((1.0..99.0).contains(&site.number("governor_output")));
}

#[test]
fn a_genset_that_cannot_be_led_transfers_with_a_break_and_says_so() {
    let mut site = set(&[("no_break_transfer", "1"), ("synchronizing_time", "10")]);
    pull(&mut site, "governor", "hunting");
    site.press(TEST);
    let out = walk(&mut site, 13);
    assert_eq!(out.statuses, [0, 1, 2, 3, 5, 6, 7, 8, 9, 8, 12, 11, 13]);
    assert!(!out.together);
    assert!(alarms(&site, WARNING).contains(&128));
    // It stays until it is reset: DOWN, held.
    pull(&mut site, "governor", "normal");
    site.pass_seconds(10);
    assert!(alarms(&site, WARNING).contains(&128));
    site.press(1 << 14 | 1 << 10);
    site.pass(TENTH);
    assert!(!alarms(&site, WARNING).contains(&128));
}

#[test]
fn a_load_that_the_genset_cannot_take_whole_is_left_with_the_rest_when_the_timer_ends() {
    let unlimited = [("overload_load_dump", "1000"), ("over_current_load_dump", "1000")];
    let mut site = set(&[&[("no_break_transfer", "1"), ("soft_transfer", "1")][..], &unlimited].concat());
    pull(&mut site, "load", "95");
    site.press(TEST);
    site.walk_to(10);
    assert_eq!(site.number("operation_timer"), 60.0);
    site.walk_to(13);
    assert!(site.number("genset_active_power") > 90.0);
}

#[test]
fn a_genset_does_not_meet_mains_whose_phases_have_changed_places() {
    let mut site = set(&[("no_break_transfer", "1"), ("mains_fail_delay", "600")]);
    pull(&mut site, "remote_start", "on");
    site.walk_to(9);
    pull(&mut site, "mains", "reversed");
    for _ in 0..550 {
        site.pass(TENTH);
        assert_eq!((site.code("operation_status"), closed(&site)), (9, (false, true)));
    }
}

#[test]
fn mains_that_fail_during_a_transfer_leave_the_load_to_the_genset() {
    for status in [10, 17, 18] {
        let mut site = set(&[("no_break_transfer", "1"), ("soft_transfer", "1")]);
        site.press(TEST);
        if status != 10 {
            site.walk_to(13);
            site.press(crate::site::AUTO);
        }
        site.walk_to(status);
        pull(&mut site, "mains", "failed");
        site.walk_to(13);
        site.pass_seconds(5);
        assert_eq!(closed(&site), (true, false), "{status}");
        assert!(load(&site) > 20.0, "{status}");
        assert!(alarms(&site, LOAD_DUMP).is_empty());
    }
}

#[test]
fn peaks_are_lopped_beside_the_mains_until_they_are_over() {
    let mut site = set(&[("peak_lopping", "1"), ("peak_lopping_power", "40")]);
    pull(&mut site, "load", "30");
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 0);
    pull(&mut site, "load", "70");
    assert_eq!(site.walk_to(14), [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 14]);
    site.pass_seconds(20);
    let mains = site.number("mains_active_power");
    assert!((38.0..42.0).contains(&mains), "{mains}");
    assert_eq!(closed(&site), (true, true));
    pull(&mut site, "load", "25");
    site.pass_seconds(20);
    let genset = site.number("genset_active_power");
    assert!((7.0..9.0).contains(&genset), "it carries its least: {genset}");
    assert_eq!(site.walk_to(0), [&[14, 18][..], &HOME].concat());
    assert!(load(&site) > 24.0);
}

#[test]
fn an_export_feeds_the_grid_and_islands_when_it_fails() {
    let mut site = set(&[("power_export", "1"), ("export_power", "60")]);
    pull(&mut site, "load", "20");
    pull(&mut site, "remote_start", "on");
    assert_eq!(site.walk_to(15), [0, 1, 2, 3, 5, 6, 7, 8, 9, 11, 15]);
    site.pass_seconds(30);
    let (genset, mains) = (site.number("genset_active_power"), site.number("mains_active_power"));
    assert!((57.0..63.0).contains(&genset) && (-43.0..-37.0).contains(&mains), "{genset} {mains}");
    let exported = site.number("export_active_energy");
    site.pass_seconds(60);
    assert!(site.number("export_active_energy") > exported);

    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    site.pass_seconds(5);
    assert_eq!(closed(&site), (true, false));
    assert!((19.0..21.0).contains(&site.number("genset_active_power")));
    assert!(alarms(&site, WARNING).contains(&121), "G59 tells of it until it is reset");
    pull(&mut site, "mains", "normal");
    assert_eq!(site.walk_to(15), [13, 17, 15]);
    pull(&mut site, "remote_start", "off");
    assert_eq!(site.walk_to(0), [&[15, 18][..], &HOME].concat());
}

#[test]
fn an_engine_that_dies_beside_the_mains_draws_power_and_is_taken_off() {
    let mut site = set(&[("power_export", "1"), ("low_fuel_shutdown", "0")]);
    pull(&mut site, "remote_start", "on");
    site.walk_to(15);
    site.pass_seconds(20);
    pull(&mut site, "fuel.supply", "shut");
    until(&mut site, 60, |site| alarms(site, LOAD_DUMP) == [108]);
    until(&mut site, 2, |site| closed(site) == (false, true));
    site.walk_to(0);
    assert!(load(&site) > 20.0);
}

#[test]
fn excitation_that_is_lost_beside_the_mains_dumps_the_load() {
    let mut site = set(&[("power_export", "1")]);
    pull(&mut site, "remote_start", "on");
    site.walk_to(15);
    site.pass_seconds(20);
    pull(&mut site, "avr", "failed");
    until(&mut site, 60, |site| alarms(site, LOAD_DUMP).contains(&117));
    until(&mut site, 2, |site| closed(site) == (false, true));
}

#[test]
fn breaker_keys_move_the_load_without_a_break_where_it_is_set_so() {
    let mut site = set(&[("no_break_transfer", "1")]);
    site.press(RUN);
    site.walk_to(8);
    site.press(GCB);
    let out = walk(&mut site, 13);
    assert!(out.least > 20.0 && out.together);
    site.press(MCB);
    let home = walk(&mut site, 8);
    assert_eq!(home.statuses, [13, 17, 8]);
    assert!(home.least > 20.0);
}
