//! The particle filter of an ACC1700CAN's engine, as its ECU tells of it: what it asks for, who sees to it, and how it ends.

use super::alarms::{alarm, pull};
use super::{START, STOP, common, loaded, press, quiet, status, walk_to};
use crate::site::{Site, TENTH};

#[test]
fn a_filter_that_nobody_sees_to_stops_the_engine_in_the_end() {
    let mut site = loaded();
    for (soot, word, warned) in [
        ("96", "please_regenerate_manually", true),
        ("121", "dpf_fault", true),
        ("141", "ecu_shutdown", false),
    ] {
        pull(&mut site, "dpf.regeneration", "inhibited");
        pull(&mut site, "dpf.soot", soot);
        site.pass_seconds(2);
        assert!(alarm(&site, word), "{soot} %");
        assert_eq!((common(&site, 1), status(&site) == 9), (!warned, warned), "{soot} %");
    }
    walk_to(&mut site, 0);
    press(&mut site, STOP);
    assert!(common(&site, 1), "it is still full");
    pull(&mut site, "dpf.soot", "0");
    site.pass(TENTH);
    press(&mut site, STOP);
    assert!(!common(&site, 0));
}

#[test]
fn the_particle_filter_asks_burns_and_is_seen_to() {
    let states =
        |site: &Site| -> Vec<u16> { site.bits("engine_indicators").iter().filter(|bit| *bit < 8).collect() };
    let mut site = loaded();
    pull(&mut site, "air.consumption", "9");
    pull(&mut site, "dpf.soot", "85");
    site.pass(TENTH);
    let mut seen = vec![states(&site)];
    for _ in 0..3600 {
        site.pass_seconds(1);
        if seen.last() != Some(&states(&site)) {
            seen.push(states(&site));
        }
    }
    assert!(seen.contains(&vec![3, 7]), "it burns on load: {seen:?}");
    assert!(seen.last().unwrap().is_empty(), "and is clean then: {seen:?}");

    let mut site = quiet();
    press(&mut site, START);
    walk_to(&mut site, 8);
    for (lever, to, expected) in [
        ("dpf.soot", "85", &[1][..]),
        ("dpf.regeneration", "inhibited", &[1, 2]),
        ("dpf.soot", "97", &[1, 2, 5]),
        ("dpf.soot", "125", &[0, 1, 2, 5]),
        ("dpf.soot", "85", &[1, 2]),
        ("dpf.regeneration", "by_hand", &[3, 4, 7]),
        ("dpf.soot", "10", &[]),
    ] {
        pull(&mut site, lever, to);
        site.pass_seconds(1);
        assert_eq!(states(&site), expected, "{lever} {to}");
    }
    pull(&mut site, "dpf.soot", "130");
    pull(&mut site, "ecu", "silent");
    site.pass_seconds(1);
    assert!(states(&site).is_empty(), "nobody tells");
}

#[test]
fn what_a_silent_ecu_said_last_is_not_shown() {
    let mut site = quiet();
    pull(&mut site, "dpf.soot", "125");
    site.pass_seconds(1);
    let said = ["dpf_fault", "please_regenerate_manually", "ecu_warning", "engine_fault_status"];
    assert!(said.iter().all(|id| alarm(&site, id)));
    pull(&mut site, "ecu", "silent");
    site.pass(TENTH);
    assert!(said.iter().all(|id| !alarm(&site, id)));
    pull(&mut site, "ecu", "normal");
    site.pass(TENTH);
    assert!(said.iter().all(|id| alarm(&site, id)));
}
