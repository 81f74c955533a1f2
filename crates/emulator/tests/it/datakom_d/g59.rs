//! Mains that are lost, or must be left, while genset and mains are side by side.

use busbar_emulator::Config;

use super::{LOAD_DUMP, WARNING, alarms, closed, load, pull, set, until};
use crate::site::{Site, TENTH};

fn beside(kw: &str, settings: &[(&str, &str)]) -> Site {
    let mut site = set(&[&[("power_export", "1"), ("export_power", "60")], settings].concat());
    pull(&mut site, "load", kw);
    pull(&mut site, "remote_start", "on");
    site.walk_to(15);
    site.pass_seconds(30);
    assert!(alarms(&site, WARNING).is_empty());
    site
}

/// The genset has the load, and nothing was dark.
fn islands(site: &mut Site) {
    until(site, 2, |site| closed(site) == (true, false));
    site.pass(TENTH);
    assert_eq!(site.code("operation_status"), 13);
    assert!(load(site) > 10.0 && alarms(site, LOAD_DUMP).is_empty());
}

#[test]
fn a_frequency_that_changes_fast_is_left_and_met_again() {
    let mut site = beside("40", &[]);
    pull(&mut site, "mains.frequency", "51.5");
    until(&mut site, 2, |site| alarms(site, WARNING) == [124]);
    islands(&mut site);
    assert_eq!(site.walk_to(15), [13, 17, 15]);
    assert_eq!(alarms(&site, WARNING), [124], "it stays until it is reset");
    // The next one is left too.
    site.pass_seconds(10);
    pull(&mut site, "mains.frequency", "normal");
    islands(&mut site);
}

#[test]
fn a_limit_beyond_it_lets_the_genset_follow() {
    let mut site = beside("40", &[("g59_rocof", "10")]);
    pull(&mut site, "mains.frequency", "51.5");
    site.pass_seconds(20);
    assert_eq!((site.code("operation_status"), alarms(&site, WARNING)), (15, vec![]));
}

#[test]
fn mains_that_vanish_with_much_of_the_load_make_the_voltage_jump() {
    let mut site = set(&[("peak_lopping", "1"), ("peak_lopping_power", "55")]);
    pull(&mut site, "load", "70");
    site.walk_to(14);
    site.pass_seconds(30);
    pull(&mut site, "mains", "failed");
    until(&mut site, 1, |site| alarms(site, WARNING).contains(&125));
    islands(&mut site);
}

#[test]
fn what_flows_into_mains_that_are_to_get_nothing_is_found_out() {
    let mut site = set(&[("peak_lopping", "1"), ("peak_lopping_power", "30"), ("g59_reverse_power", "3")]);
    pull(&mut site, "load", "60");
    site.walk_to(14);
    site.pass_seconds(20);
    assert!(alarms(&site, WARNING).is_empty());
    // It carries its least, and nobody takes it.
    pull(&mut site, "load", "0");
    until(&mut site, 20, |site| alarms(site, WARNING).contains(&123));
    until(&mut site, 2, |site| closed(site) == (true, false));
    // Where power is exported nothing is wrong with it.
    let mut site = beside("20", &[("g59_reverse_power", "3")]);
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), alarms(&site, WARNING)), (15, vec![]));
}

#[test]
fn an_export_that_ends_slowly_is_no_reverse_power() {
    let mut site = beside("0", &[("load_ramp", "4")]);
    pull(&mut site, "remote_start", "off");
    assert_eq!(site.walk_to(0), [15, 18, 21, 22, 23, 25, 0]);
    assert!(alarms(&site, WARNING).is_empty());
}

#[test]
fn a_d_700_that_exports_by_hand_keeps_the_load_of_mains_that_fail() {
    let mut site = Site::new(&Config {
        model: Some("D-700".to_owned()),
        pins: [("power_export", "1")].map(|(id, value)| (id.to_owned(), value.to_owned())).to_vec(),
        ..Config::default()
    });
    pull(&mut site, "remote_start", "on");
    site.walk_to(15);
    site.press(crate::site::RUN);
    pull(&mut site, "remote_start", "off");
    site.pass_seconds(20);
    assert_eq!((site.code("unit_mode"), site.code("operation_status")), (2, 15));
    pull(&mut site, "mains", "failed");
    islands(&mut site);
    pull(&mut site, "mains", "normal");
    assert_eq!(site.walk_to(15), [13, 17, 15]);
}

#[test]
fn an_injected_one_separates_as_its_own() {
    let mut site = beside("40", &[]);
    site.device.inject("warning_alarms.g59_vector_shift", true).unwrap();
    islands(&mut site);
    // At rest it only warns.
    let mut site = Site::quiet();
    site.device.inject("warning_alarms.g59_rocof", true).unwrap();
    site.pass_seconds(30);
    assert_eq!((site.code("operation_status"), closed(&site), site.flag(44)), (0, (false, true), false));
}
