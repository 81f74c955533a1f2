//! AUTO: what starts the genset, what does not, and how the load comes home.

use super::{SHUTDOWN, alarms, closed, load, pull, set, until};
use crate::site::{AUTO, RUN, STOP, Site, TENTH, TEST};

#[test]
fn mains_that_fail_are_replaced_and_trusted_again_only_after_their_wait() {
    let mut site = Site::quiet();
    site.pass_seconds(5);
    pull(&mut site, "mains", "failed");
    assert_eq!(site.walk_to(13), [0, 1, 2, 3, 5, 6, 7, 8, 12, 11, 13]);
    assert!(site.flag(44) && closed(&site) == (true, false));
    site.pass_seconds(20);
    assert!(load(&site) > 25.0 && site.number("mains_active_power") == 0.0);

    pull(&mut site, "mains", "normal");
    let back = until(&mut site, 5, |site| !site.flag(44));
    assert!(back >= 1.0, "{back}");
    // The wait is shown, and the genset keeps the load meanwhile.
    assert_eq!(site.number("operation_timer"), 20.0);
    assert_eq!(site.codes("leds")[7], 3, "mains back: slow flash");
    site.pass_seconds(19);
    assert_eq!((site.code("operation_status"), site.number("operation_timer")), (13, 1.0));
    assert_eq!(site.walk_to(0), [13, 20, 19, 21, 22, 23, 25, 0]);
    assert!(closed(&site) == (false, true) && load(&site) > 25.0);
    assert_eq!(site.codes("leds")[7], 1);
}

#[test]
fn a_dip_shorter_than_the_delay_changes_nothing_and_one_before_the_crank_starts_nothing() {
    let mut site = set(&[("mains_fail_delay", "2")]);
    site.pass_seconds(5);
    pull(&mut site, "mains", "failed");
    site.pass_seconds(1);
    assert_eq!(site.codes("leds")[7], 2, "mains outside their limits: quick flash");
    pull(&mut site, "mains", "normal");
    for _ in 0..200 {
        site.pass(TENTH);
        assert_eq!((site.code("operation_status"), closed(&site)), (0, (false, true)));
    }

    let cranks = site.number("genset_cranks");
    pull(&mut site, "mains", "failed");
    site.walk_to(3);
    assert_eq!(closed(&site), (false, false));
    pull(&mut site, "mains", "normal");
    assert_eq!(site.walk_to(0), [3, 0]);
    until(&mut site, 3, |site| closed(site) == (false, true));
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), site.number("genset_cranks")), (0, cranks));
}

#[test]
fn every_kind_of_bad_mains_starts_the_genset() {
    for word in ["sagging", "swelling", "l1_lost", "l2_lost", "l3_lost", "reversed"] {
        let mut site = Site::quiet();
        pull(&mut site, "mains", word);
        site.walk_to(13);
        assert!(alarms(&site, SHUTDOWN).is_empty(), "{word}");
        assert_eq!(site.flag(39), word == "reversed");
    }
    for (lever, value) in [("mains.voltage", "188"), ("mains.frequency", "46"), ("mains.frequency", "54")] {
        let mut site = Site::quiet();
        pull(&mut site, lever, value);
        site.walk_to(13);
    }
    let mut site = Site::quiet();
    pull(&mut site, "mains.voltage", "200");
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 0, "low, but inside the limits");
}

#[test]
fn mains_back_while_the_engine_warms_up_feed_at_once_and_are_watched() {
    let mut site = Site::quiet();
    pull(&mut site, "mains", "failed");
    site.walk_to(7);
    pull(&mut site, "mains", "normal");
    site.walk_to(8);
    assert_eq!(closed(&site), (false, true), "nobody waits in the dark");
    assert!(site.number("operation_timer") > 5.0);
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    pull(&mut site, "mains", "normal");
    site.walk_to(0);
}

#[test]
fn a_remote_start_takes_the_load_and_gives_it_back() {
    let mut site = Site::quiet();
    pull(&mut site, "remote_start", "on");
    site.pass(TENTH);
    assert!(site.flag(69) && site.codes("onboard_inputs")[4] == 1);
    site.walk_to(13);
    site.pass_seconds(30);
    pull(&mut site, "remote_start", "off");
    assert_eq!(site.walk_to(0), [13, 20, 19, 21, 22, 23, 25, 0]);
}

#[test]
fn the_engine_starts_at_the_attempt_that_succeeds_or_not_at_all() {
    let mut site = Site::quiet();
    let cranks = site.number("genset_cranks");
    pull(&mut site, "ignition", "3");
    pull(&mut site, "mains", "failed");
    let walk = site.walk_to(13);
    assert_eq!(walk[..10], [0, 1, 2, 3, 5, 4, 5, 4, 5, 6]);
    assert_eq!(site.number("genset_cranks"), cranks + 3.0);

    let mut site = Site::quiet();
    pull(&mut site, "ignition", "never");
    pull(&mut site, "mains", "failed");
    assert_eq!(site.walk_to(25), [0, 1, 2, 3, 5, 4, 5, 4, 5, 25]);
    site.walk_to(0);
    site.pass_seconds(60);
    assert_eq!(alarms(&site, SHUTDOWN), [98]);
    assert_eq!(site.code("operation_status"), 0, "it stays as it is until somebody comes");
    // The cause is gone, the alarm is not.
    pull(&mut site, "ignition", "normal");
    site.pass_seconds(30);
    assert_eq!((site.code("operation_status"), site.flag(41)), (0, false));
    site.press(STOP);
    assert!(alarms(&site, SHUTDOWN).is_empty());
    site.press(AUTO);
    assert!(site.flag(41));
    site.walk_to(13);
}

#[test]
fn settings_decide_how_often_and_for_how_long() {
    let mut site = set(&[("start_attempts", "1"), ("crank_time", "4"), ("start_delay", "10")]);
    pull(&mut site, "ignition", "never");
    pull(&mut site, "mains", "failed");
    site.walk_to(1);
    assert_eq!(site.number("operation_timer"), 10.0);
    site.walk_to(5);
    assert_eq!(site.number("operation_timer"), 4.0);
    assert_eq!(site.walk_to(25), [5, 25]);
    site.device.set("crank_time", "7").unwrap();
    site.press(STOP);
    site.press(AUTO);
    site.walk_to(5);
    assert_eq!(site.number("operation_timer"), 7.0);
}

#[test]
fn in_run_a_running_genset_helps_unless_it_is_set_otherwise() {
    for (helps, status) in [("1", 13), ("0", 8)] {
        let mut site = set(&[("emergency_backup", helps)]);
        site.press(RUN);
        site.walk_to(8);
        pull(&mut site, "mains", "failed");
        site.pass_seconds(20);
        assert_eq!(site.code("operation_status"), status);
        pull(&mut site, "mains", "normal");
        site.pass_seconds(40);
        assert_eq!((site.code("operation_status"), closed(&site)), (8, (false, true)));
    }
}

#[test]
fn stop_in_the_dark_stops_and_test_needs_no_mains() {
    let mut site = Site::quiet();
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    site.press(STOP);
    assert_eq!(site.walk_to(0), [13, 21, 22, 23, 25, 0]);
    assert_eq!(closed(&site), (false, false));
    site.press(TEST);
    site.walk_to(13);
}

#[test]
fn the_exerciser_runs_the_genset_by_the_clock() {
    let mut site = set(&[("exerciser_interval", "1"), ("exerciser_duration", "120")]);
    site.pass_seconds(3590);
    assert_eq!((site.code("operation_status"), site.flag(42)), (0, false));
    site.pass_seconds(11);
    assert!(site.flag(42) && site.flag(43));
    site.walk_to(13);
    site.walk_to(0);
    site.pass_seconds(7200 - 3600 - 300);
    assert!(!site.flag(42));
    until(&mut site, 400, |site| site.flag(42));
    let mut site = set(&[("exerciser_interval", "1"), ("exerciser_on_load", "0")]);
    site.pass_seconds(3660);
    assert_eq!((site.code("operation_status"), closed(&site)), (8, (false, true)));
}
