//! Contactors that refuse, mains that come and go at the wrong moment, and sources that do not meet.

use super::{AUTO, LOAD_TEST, MODE_KEYS, OFF, config, quiet};
use crate::site::{Site, TENTH};

fn relays(site: &Site) -> (bool, bool) {
    (site.bits("relays").contains(4), site.bits("relays").contains(5))
}

fn power(site: &Site) -> (f64, f64) {
    (site.number("genset_active_power"), site.number("mains_active_power"))
}

#[test]
fn a_genset_contactor_that_does_not_close_keeps_the_status_and_closes_when_it_can() {
    let mut site = quiet();
    site.device.pull("breaker.genset", "will_not_close").unwrap();
    site.device.pull("mains", "failed").unwrap();
    site.walk_to(7);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), site.number("operation_timer")), (7, 0.0));
    assert_eq!((relays(&site), power(&site)), ((true, false), (0.0, 0.0)));
    site.device.pull("breaker.genset", "normal").unwrap();
    site.walk_to(8);
    assert!(power(&site).0 > 20.0);
}

#[test]
fn in_step_it_is_let_go_and_tried_again_while_the_mains_keep_the_load() {
    let mut site = quiet();
    site.device.pull("breaker.genset", "will_not_close").unwrap();
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(6);
    let mut tries = 0;
    let mut last = 6;
    for _ in 0..600 {
        site.pass(TENTH);
        let now = site.code("operation_status");
        tries += u32::from(last == 5 && now == 6);
        last = now;
        assert!([5, 6].contains(&now) && power(&site).1 > 20.0, "{now}");
    }
    assert!(tries > 2, "{tries}");
    assert!(site.bits("warning_alarms_2").contains(8), "synchronization fail");
    site.device.pull("breaker.genset", "normal").unwrap();
    site.walk_to(8);
    assert!(!site.bits("warning_alarms_2").contains(8), "they have met");
}

#[test]
fn a_mains_contactor_that_does_not_open_keeps_the_genset_off_dead_mains() {
    let mut site = quiet();
    site.device.pull("breaker.mains", "will_not_open").unwrap();
    site.device.pull("mains", "failed").unwrap();
    site.walk_to(7);
    site.pass_seconds(30);
    assert_eq!((site.code("operation_status"), relays(&site)), (7, (false, false)));
    site.device.pull("breaker.mains", "normal").unwrap();
    site.walk_to(8);
}

#[test]
fn a_genset_contactor_that_does_not_open_stays_beside_the_mains_until_it_does() {
    let mut site = quiet();
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(8);
    site.device.pull("breaker.genset", "will_not_open").unwrap();
    site.write(MODE_KEYS, AUTO);
    site.walk_to(14);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), relays(&site)), (14, (false, true)));
    assert!(power(&site).0.abs() < 5.0 && power(&site).1 > 20.0);
    site.device.pull("breaker.genset", "normal").unwrap();
    assert_eq!(site.walk_to(13), [14, 12, 13]);
}

#[test]
fn a_mains_contactor_that_does_not_close_leaves_the_load_where_it_is() {
    let mut site = quiet();
    site.device.pull("mains", "failed").unwrap();
    site.walk_to(8);
    site.device.pull("breaker.mains", "will_not_close").unwrap();
    site.device.pull("mains", "normal").unwrap();
    site.walk_to(10);
    for _ in 0..300 {
        site.pass(TENTH);
        assert!([9, 10].contains(&site.code("operation_status")) && power(&site).0 > 20.0);
    }
    site.device.pull("breaker.mains", "normal").unwrap();
    site.walk_to(12);
    assert!(power(&site).1 > 20.0);
}

#[test]
fn mains_that_come_back_at_any_moment_of_an_outage_end_with_the_load() {
    for tenths in (0..400).step_by(23) {
        let mut site = quiet();
        site.device.pull("mains", "failed").unwrap();
        site.pass(TENTH * (tenths + 5));
        site.device.pull("mains", "normal").unwrap();
        let settled = (0..180).any(|_| {
            site.pass_seconds(1);
            let (genset, mains) = relays(&site);
            assert!(!(genset && mains) || [6, 10, 14, 15].contains(&site.code("operation_status")));
            site.code("operation_status") == 0 && mains && site.number("engine_speed") == 0.0
        });
        assert!(settled && power(&site).1 > 20.0, "after {tenths} tenths");
        for word in ["shutdown_alarms_1", "shutdown_alarms_2", "load_dump_alarms"] {
            assert!(site.bits(word).is_empty(), "{word} after {tenths} tenths");
        }
    }
}

#[test]
fn mains_that_fail_in_the_middle_of_a_soft_transfer_leave_the_load_to_the_genset() {
    for status in [6, 15] {
        let mut site = quiet();
        site.write(MODE_KEYS, LOAD_TEST);
        site.walk_to(status);
        site.pass_seconds(1);
        site.device.pull("mains", "failed").unwrap();
        site.pass_seconds(2);
        assert_eq!(site.code("operation_status"), 8, "from {status}");
        site.pass_seconds(3);
        assert!(power(&site).0 > 20.0 && site.bits("warning_alarms_3").contains(8));
        assert_eq!(relays(&site), (true, false));
    }
}

#[test]
fn out_of_step_the_load_moves_with_a_break_and_a_warning() {
    let mut site = Site::new(&busbar_emulator::Config {
        pins: vec![("governor_control".into(), "0".into()), ("synchronization_time".into(), "10".into())],
        ..config()
    });
    site.device.pull("mains.frequency", "50.6").unwrap();
    site.pass_seconds(10);
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [0, 1, 2, 3, 4, 5, 7, 8]);
    assert!(site.bits("warning_alarms_2").contains(8));
    site.write(MODE_KEYS, AUTO);
    assert!(!{
        site.pass(TENTH);
        site.bits("warning_alarms_2").contains(8)
    });
    assert_eq!(site.walk_to(12), [9, 11, 12]);
    assert!(site.bits("warning_alarms_2").contains(8), "again");
    assert!(power(&site).1 > 20.0);
}

#[test]
fn off_takes_nothing_from_good_mains() {
    let mut site = quiet();
    site.write(MODE_KEYS, OFF);
    for _ in 0..100 {
        site.pass(TENTH);
        assert_eq!((site.code("operation_status"), relays(&site)), (0, (false, true)));
    }
}

#[test]
fn a_contactor_closed_out_of_step_is_a_fault_and_not_tried_again() {
    let mut site = Site::new(&busbar_emulator::Config {
        pins: vec![("ignore_phase_order".into(), "1".into())],
        ..config()
    });
    site.device.pull("mains", "reversed").unwrap();
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    assert!(site.bits("warning_alarms_2").contains(8));
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), relays(&site)), (8, (true, false)));
    assert!(site.bits("warning_alarms_2").contains(8) && power(&site).0 > 20.0);
    // A key lets it try again: the site has been put right.
    site.device.pull("mains", "normal").unwrap();
    site.write(MODE_KEYS, AUTO);
    assert_eq!(site.walk_to(12), [8, 9, 10, 14, 12]);
    assert!(!site.bits("warning_alarms_2").contains(8));
}

#[test]
fn a_genset_does_not_go_on_feeding_a_dead_line() {
    let mut site = Site::new(&busbar_emulator::Config {
        pins: vec![("soft_transfer_ramp".into(), "1".into())],
        ..config()
    });
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(15);
    site.device.pull("breaker.mains", "will_not_open").unwrap();
    site.pass_seconds(3);
    site.device.pull("mains", "failed").unwrap();
    site.pass_seconds(5);
    assert_eq!(relays(&site), (false, false), "whatever the status, {}", site.code("operation_status"));
    assert_eq!(power(&site).0, 0.0);
    // The line comes back: nothing is there to meet it.
    site.device.pull("mains", "normal").unwrap();
    for _ in 0..100 {
        site.pass(TENTH);
        assert!(site.number("genset_l1_current") == 0.0);
    }
    assert!(power(&site).1 > 20.0);
}

#[test]
fn a_mains_contactor_that_refuses_does_not_keep_a_load_test_from_starting() {
    let mut site = quiet();
    site.device.pull("mains", "failed").unwrap();
    site.pass_seconds(3);
    site.device.pull("breaker.mains", "will_not_close").unwrap();
    site.device.pull("mains", "normal").unwrap();
    site.walk_to(11);
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 11, "it waits");
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [11, 0, 1, 2, 3, 4, 7, 8]);
    site.write(MODE_KEYS, OFF);
    site.device.pull("breaker.mains", "normal").unwrap();
    site.walk_to(13);
    assert!(power(&site).1 > 20.0);
}
