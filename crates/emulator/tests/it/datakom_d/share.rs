//! Several gensets on one bus bar: the registers of load sharing.

use super::{load, pull, set};
use crate::site::{Site, TEST};

#[test]
fn alone_the_totals_are_its_own() {
    let mut site = Site::quiet();
    site.press(TEST);
    site.walk_to(13);
    site.pass_seconds(20);
    assert_eq!(site.number("multi_genset_active_power"), site.number("genset_active_power"));
    assert_eq!(site.number("multi_genset_speed_correction"), 0.0);
    assert!(site.flag(78) && !site.flag(79));
}

#[test]
fn sisters_share_the_load_evenly_and_leave_with_it() {
    let mut site = set(&[("slave_unit", "1")]);
    pull(&mut site, "busbar.gensets", "2");
    pull(&mut site, "load", "66");
    site.press(TEST);
    site.walk_to(16);
    assert!(site.flag(79) && !site.flag(78), "a slave, started with the others");
    site.pass_seconds(60);
    let own = site.number("genset_active_power");
    assert!((20.0..24.0).contains(&own), "{own}");
    let total = site.number("multi_genset_active_power");
    assert!((65.0..67.0).contains(&total), "{total}");
    let average = site.number("multi_genset_active_load");
    assert!((total / 2.4 - average).abs() < 0.1, "{average}");
    assert!(site.number("multi_genset_speed_correction").abs() < 3.0);
    let (factor, reactive) =
        (site.number("multi_genset_power_factor"), site.number("multi_genset_reactive_power"));
    assert!((factor - total / total.hypot(reactive)).abs() < 0.06);
    site.press(crate::site::AUTO);
    site.walk_to(0);
    assert!(load(&site) > 60.0);
    assert_eq!(site.number("multi_genset_active_power"), 0.0);
}
