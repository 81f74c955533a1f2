//! Every point of the profile, in every situation: decodes, and says something a person would believe.

use std::ops::RangeInclusive;

use busbar_emulator::Config;
use busbar_profile::{DataType, Point, Quality, Value};

use crate::site::{AUTO, CHANNEL_SELECT, RUN, STOP, Site, TEST, believe};

/// No second set of temperature senders is fitted.
const ABSENT: [&str; 4] =
    ["engine_temperature_2", "oil_temperature_2", "canopy_temperature_2", "ambient_temperature_2"];

#[test]
fn every_point_is_good_and_plausible() {
    let mut site = Site::new(&Config { story: true, ..Config::default() });
    judge(&site, "power-on");
    site.pass_seconds(14);
    judge(&site, "at rest");
    site.walk_to(5);
    site.pass_seconds(1);
    judge(&site, "cranking");
    site.walk_to(13);
    site.write(CHANNEL_SELECT, 19);
    site.pass_seconds(30);
    judge(&site, "on load");
    site.walk_to(22);
    judge(&site, "cooling down");
    for keys in [STOP, RUN, AUTO, TEST] {
        site.press(keys);
        site.pass_seconds(25);
        judge(&site, "in every mode");
    }
    assert_eq!(site.device.misfits(), 0);
}

fn judge(site: &Site, situation: &str) {
    for point in site.device.profile().points.iter().filter(|point| point.access.is_readable()) {
        let decoded = site.decode(&point.id);
        if ABSENT.contains(&point.id.as_str()) {
            assert_eq!(decoded.quality, Quality::Invalid, "{situation}: {}", point.id);
            continue;
        }
        match &decoded.value {
            Some(Value::Bytes(bytes)) => {
                assert!(bytes.iter().any(|byte| *byte != 0), "{situation}: {}", point.id);
            }
            Some(Value::Trace(samples)) => {
                assert!(samples.iter().all(|sample| sample.abs() < 6000), "{situation}: {}", point.id);
            }
            Some(Value::Codes(codes)) => assert_eq!(point.data_type, DataType::Bits2, "{codes:?}"),
            _ => {
                believe(point, decoded, plausible, situation);
                continue;
            }
        }
        assert_eq!(decoded.quality, Quality::Good, "{situation}: {}", point.id);
    }
}

/// What a person at this site would believe; a new point needs a line here.
fn plausible(point: &Point) -> RangeInclusive<f64> {
    let id = point.id.as_str();
    match (id, point.unit.as_deref()) {
        ("mains_frequency", _) => 49.8..=50.2,
        ("genset_frequency", _) => 0.0..=52.0,
        ("engine_speed" | "pickup_speed", _) => 0.0..=1560.0,
        ("oil_pressure" | "oil_pressure_2", _) => 0.0..=6.0,
        ("engine_temperature" | "oil_temperature", _) => 25.0..=110.0,
        ("canopy_temperature" | "ambient_temperature", _) => 5.0..=60.0,
        ("fuel_level", _) => 10.0..=100.0,
        ("fuel_level_2", _) => 0.0..=0.0,
        ("governor_output" | "avr_output", _) => 0.0..=100.0,
        ("flowmeter", _) => 0.0..=30.0,
        ("operation_timer", _) => 0.0..=30.0,
        ("ethernet_packets" | "ethernet_resets", _) => 0.0..=65_535.0,
        ("hardware_version" | "software_version", _) => 1.0..=4096.0,
        ("latitude", _) => -9_000_000.0..=9_000_000.0,
        ("longitude", _) => -18_000_000.0..=18_000_000.0,
        ("altitude", _) => -400.0..=9000.0,
        ("genset_runs" | "genset_cranks" | "genset_loadings", _) => 100.0..=2000.0,
        ("export_active_energy", _) => 0.0..=0.0,
        (id, Some("V")) if id.contains("charge_input") => 0.0..=29.0,
        (id, Some("V")) if id.starts_with("battery") => 18.0..=29.0,
        (id, Some("V")) if id.starts_with("mains_l") && id.matches("_l").count() == 2 => 380.0..=420.0,
        (id, Some("V")) if id.starts_with("mains") => 220.0..=242.0,
        (id, Some("V")) if id.starts_with("genset") => 0.0..=410.0,
        (id, Some("A")) if id.starts_with("battery") => 0.0..=15.0,
        (_, Some("A")) => 0.0..=110.0,
        (_, Some("kW" | "kvar" | "kVA")) => 0.0..=70.0,
        (id, None) if id.ends_with("power_factor") => 0.0..=1.0,
        (id, Some("%")) if id.starts_with("channel") => 0.0..=100.0,
        (id, Some("%")) if id.starts_with("multi_genset") => 0.0..=100.0,
        (_, Some("kWh" | "kvarh")) => 0.0..=200_000.0,
        (_, Some("L")) => 1000.0..=40_000.0,
        (_, Some("h")) => 0.0..=3000.0,
        (_, Some("d")) => 0.0..=800.0,
        (_, Some("ohm")) => 5.0..=1000.0,
        ("analog_input_7" | "analog_input_8", None) => 0.0..=0.0,
        other => panic!("nobody said what is plausible for {other:?}"),
    }
}

#[test]
fn the_identity_is_that_of_no_real_unit() {
    let site = Site::quiet();
    let bytes = |id: &str| match site.decode(id).value {
        Some(Value::Bytes(bytes)) => bytes,
        other => panic!("{id}: {other:?}"),
    };
    assert_eq!(bytes("mac_address")[0] & 0x03, 0x02, "locally administered, one station");
    let imei = bytes("modem_imei");
    assert!(imei.starts_with(b"001010") && imei[15] == 0);
    let sum: u32 = imei[..15]
        .iter()
        .rev()
        .enumerate()
        .map(|(place, digit)| {
            let digit = u32::from(digit - b'0') * (1 + place as u32 % 2);
            digit / 10 + digit % 10
        })
        .sum();
    assert_eq!(sum % 10, 0, "the check digit holds");
    assert_eq!(bytes("gprs_ip")[0], 10, "a private network");
}

#[test]
fn the_display_shows_the_state_in_letters() {
    let mut site = Site::quiet();
    let lit = |site: &Site| match site.decode("lcd").value {
        Some(Value::Bytes(bytes)) => bytes,
        other => panic!("{other:?}"),
    };
    let rest = lit(&site);
    let pixels: u32 = rest.iter().map(|byte| byte.count_ones()).sum();
    assert!((800..4000).contains(&pixels), "{pixels}");
    site.press(STOP);
    // The top line of text is in the last page: 64 registers of two bytes.
    let stopped = lit(&site);
    assert_ne!(rest[896..], stopped[896..], "AUTO became STOP");
}
