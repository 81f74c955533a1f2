//! What the meters tell: traces that lag as the power factor says, a position that wanders, load to add and to take.

use std::f64::consts::TAU;

use busbar_profile::Value;

use super::{pull, set, until};
use crate::site::{CHANNEL_SELECT, Site, TEST};

/// Degrees at which the fundamental of a channel's trace begins.
fn angle(site: &mut Site, channel: u16) -> f64 {
    site.write(CHANNEL_SELECT, channel);
    let Some(Value::Trace(trace)) = site.decode("scope").value else { panic!("no trace") };
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (sample, value) in trace.iter().enumerate() {
        let turned = TAU * sample as f64 / trace.len() as f64;
        sine += f64::from(*value) * turned.sin();
        cosine += f64::from(*value) * turned.cos();
    }
    cosine.atan2(sine).to_degrees()
}

/// Degrees by which one channel lags behind another, 0 to 360.
fn lag(site: &mut Site, channel: u16, behind: u16) -> f64 {
    (angle(site, behind) - angle(site, channel)).rem_euclid(360.0)
}

#[test]
fn a_current_lags_by_its_power_factor_and_is_turned_round_by_an_export() {
    let mut site = set(&[("power_export", "1"), ("export_power", "60")]);
    pull(&mut site, "load", "20");
    pull(&mut site, "load.power_factor", "0.5");
    site.pass_seconds(10);
    let found = lag(&mut site, 12, 0);
    assert!((found - 60.0).abs() < 2.0, "{found}");
    pull(&mut site, "load.power_factor", "1");
    site.pass_seconds(10);
    let found = (lag(&mut site, 12, 0) + 180.0) % 360.0;
    assert!((found - 180.0).abs() < 2.0, "{found}");
    pull(&mut site, "remote_start", "on");
    site.walk_to(15);
    site.pass_seconds(30);
    let found = lag(&mut site, 12, 0);
    assert!((120.0..240.0).contains(&found), "{found}");
}

#[test]
fn phases_follow_each_other_in_their_order() {
    let mut site = Site::quiet();
    for (word, second, third) in [("normal", 120.0, 240.0), ("reversed", 240.0, 120.0)] {
        pull(&mut site, "mains", word);
        site.pass_seconds(1);
        let found = [lag(&mut site, 1, 0), lag(&mut site, 2, 0), lag(&mut site, 7, 6)];
        for (found, expected) in found.into_iter().zip([second, third, second]) {
            assert!((found - expected).abs() < 1.0, "{word}: {found}");
        }
    }
}

#[test]
fn the_position_wanders_by_metres() {
    let mut site = Site::quiet();
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..60 {
        site.pass_seconds(10);
        let fix = ["latitude", "longitude", "altitude"].map(|id| site.number(id) as i64);
        assert!(
            (fix[0] - 4_821_000).abs() < 10 && (fix[1] - 1_637_200).abs() < 10 && (fix[2] - 186).abs() < 15
        );
        seen.insert(fix);
    }
    assert!(seen.len() > 10, "{seen:?}");
}

#[test]
fn consumers_are_shed_and_added_by_the_load_of_the_genset() {
    let mut site = Site::quiet();
    assert!(![33, 34, 35].into_iter().any(|flag| site.flag(flag)), "its breaker is open");
    pull(&mut site, "load", "76");
    site.press(TEST);
    site.walk_to(13);
    site.pass_seconds(10);
    assert_eq!([33, 34, 35].map(|flag| site.flag(flag)), [true, false, true]);
    pull(&mut site, "load", "65");
    site.pass_seconds(10);
    assert_eq!([33, 34, 35].map(|flag| site.flag(flag)), [true, false, false]);
    pull(&mut site, "load", "40");
    site.pass_seconds(10);
    assert_eq!([33, 34, 35].map(|flag| site.flag(flag)), [false, true, false]);
    site.press(crate::site::AUTO);
    until(&mut site, 60, |site| site.code("operation_status") == 22);
    assert!(!site.flag(34));
}
