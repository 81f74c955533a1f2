//! Every setting at both ends of its range: the unit goes on, and comes home when it is set back.

use super::{LOAD_DUMP, SHUTDOWN, alarms, closed, pull, set};
use crate::site::{AUTO, STOP, Site, TENTH};

/// What joins genset and mains on purpose.
const JOINING: [&str; 3] = ["no_break_transfer", "peak_lopping", "power_export"];

/// A blackout of two minutes and two minutes after it.
fn blackout(site: &mut Site, apart: bool, place: &str) {
    for word in ["failed", "normal"] {
        pull(site, "mains", word);
        for _ in 0..1200 {
            site.pass(TENTH);
            assert!(!apart || closed(site) != (true, true), "{place}");
        }
    }
}

#[test]
fn no_end_of_a_range_leaves_the_unit_astray() {
    for setting in &busbar_profile::builtin("datakom-d").unwrap().settings {
        for value in [setting.min, setting.max].map(|value| value.to_string()) {
            let place = format!("{} = {value}", setting.id);
            let mut site = set(&[(setting.id.as_str(), value.as_str())]);
            site.pass_seconds(20);
            blackout(&mut site, !JOINING.contains(&setting.id.as_str()), &place);

            site.device.set(&setting.id, &setting.value.to_string()).unwrap();
            // Twice, for a timer that runs goes on as it was set.
            site.press(STOP);
            site.press(STOP);
            site.pass_seconds(150);
            site.press(STOP);
            site.press(AUTO);
            site.pass_seconds(2);
            assert_eq!((site.code("operation_status"), closed(&site)), (0, (false, true)), "{place}");
            assert!(alarms(&site, SHUTDOWN).is_empty() && alarms(&site, LOAD_DUMP).is_empty(), "{place}");
            assert_eq!(site.device.misfits(), 0, "{place}");
        }
    }
}

#[test]
fn short_cranks_in_the_dark_leave_a_good_battery_good() {
    let mut site = set(&[("crank_time", "6")]);
    pull(&mut site, "ignition", "never");
    pull(&mut site, "mains", "failed");
    site.walk_to(25);
    site.pass_seconds(60);
    assert!(alarms(&site, super::WARNING).is_empty(), "{:?}", alarms(&site, super::WARNING));
    assert!(site.number("battery_voltage") > 24.5);
}
