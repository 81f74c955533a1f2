//! The contacts on the unit's inputs: what AUTO may not do, and what it must.

use super::{SHUTDOWN, WARNING, alarms, closed, pull, set, until};
use crate::site::{GCB, RUN, Site, TEST};

#[test]
fn each_contact_shows_in_its_flag_and_its_input() {
    let mut site = Site::quiet();
    for (place, (lever, flag)) in [
        ("input.protections_disabled", 68),
        ("input.auto_start_disabled", 70),
        ("input.force_to_start", 71),
        ("input.restore_inhibited", 72),
        ("input.loading_inhibited", 73),
    ]
    .into_iter()
    .enumerate()
    {
        for (word, on) in [("on", true), ("off", false)] {
            pull(&mut site, lever, word);
            site.pass_seconds(1);
            assert_eq!(
                (site.flag(flag), site.codes("onboard_inputs")[5 + place]),
                (on, u8::from(on)),
                "{lever}"
            );
        }
    }
}

#[test]
fn auto_starts_nothing_where_it_is_forbidden_and_stops_nothing_either() {
    let mut site = Site::quiet();
    pull(&mut site, "input.auto_start_disabled", "on");
    pull(&mut site, "mains", "failed");
    pull(&mut site, "remote_start", "on");
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), closed(&site), site.flag(41)), (0, (false, false), false));
    pull(&mut site, "input.auto_start_disabled", "off");
    site.walk_to(13);
    pull(&mut site, "input.auto_start_disabled", "on");
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 13);
    // Started by hand it runs.
    let mut site = Site::quiet();
    pull(&mut site, "input.auto_start_disabled", "on");
    site.press(TEST);
    site.walk_to(13);
}

#[test]
fn a_forced_start_takes_the_load_from_good_mains() {
    let mut site = set(&[("power_export", "1")]);
    pull(&mut site, "input.force_to_start", "on");
    site.walk_to(13);
    assert_eq!(closed(&site), (true, false));
    pull(&mut site, "input.force_to_start", "off");
    site.walk_to(0);
}

#[test]
fn the_load_stays_on_the_genset_while_its_return_is_inhibited() {
    let mut site = Site::quiet();
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    pull(&mut site, "input.restore_inhibited", "on");
    pull(&mut site, "mains", "normal");
    site.pass_seconds(120);
    assert_eq!((site.code("operation_status"), site.flag(44)), (13, false));
    pull(&mut site, "input.restore_inhibited", "off");
    site.pass_seconds(1);
    assert_eq!(site.code("operation_status"), 20);
}

#[test]
fn a_genset_that_may_not_be_loaded_runs_off_load() {
    let mut site = Site::quiet();
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    pull(&mut site, "input.loading_inhibited", "on");
    site.walk_to(8);
    site.pass_seconds(10);
    assert_eq!((site.code("operation_status"), closed(&site)), (8, (false, false)));
    pull(&mut site, "mains", "normal");
    until(&mut site, 5, |site| closed(site) == (false, true));
    site.walk_to(0);
    site.press(RUN);
    site.walk_to(8);
    site.press(GCB);
    site.pass_seconds(10);
    assert_eq!((site.code("operation_status"), closed(&site)), (8, (false, true)));
}

#[test]
fn disabled_protections_warn_and_an_engine_that_stalls_is_started_anew() {
    let mut site = Site::quiet();
    pull(&mut site, "input.protections_disabled", "on");
    pull(&mut site, "mains", "failed");
    site.walk_to(13);
    pull(&mut site, "oil", "leaking");
    until(&mut site, 200, |site| alarms(site, WARNING).contains(&54));
    site.pass_seconds(60);
    assert_eq!((site.code("operation_status"), alarms(&site, SHUTDOWN)), (13, vec![]));
    pull(&mut site, "fuel.supply", "shut");
    site.walk_to(25);
    assert!(alarms(&site, SHUTDOWN).is_empty());
    pull(&mut site, "fuel.supply", "open");
    site.walk_to(13);
    pull(&mut site, "emergency_stop", "pressed");
    site.walk_to(24);
    assert_eq!(alarms(&site, SHUTDOWN), [3]);
    pull(&mut site, "input.protections_disabled", "off");
}
