//! Joined signals out of an image: exact, and never a number out of a part that has none.
#![cfg(test)]

use busbar_profile::{Image, Joined, JoinedReading, Profile, WordOrder, builtin, builtins};

fn sample() -> Profile {
    let text = include_str!("procedures.toml");
    Profile::parse("procedures.toml", text).unwrap_or_else(|findings| panic!("{findings}"))
}

fn joined<'a>(profile: &'a Profile, signal: &str) -> &'a Joined {
    profile.joined().iter().find(|joined| joined.signal == signal).unwrap()
}

fn reading(profile: &Profile, signal: &str, stored: &[(u16, &[u16])]) -> Option<JoinedReading> {
    let mut image = Image::new(profile);
    for (address, registers) in stored {
        image.store(*address, registers, &mut Vec::new());
    }
    joined(profile, signal).reading(profile, &image, WordOrder::LowFirst)
}

/// As it is printed; `unread` where a part was not read.
fn shown(profile: &Profile, signal: &str, stored: &[(u16, &[u16])]) -> String {
    match reading(profile, signal, stored) {
        Some(reading) => serde_json::to_string(&reading).unwrap(),
        None => "unread".to_owned(),
    }
}

#[test]
fn hours_minutes_and_seconds_are_one_number() {
    let profile = sample();
    let hours = |registers: &[u16]| shown(&profile, "engine.hours", &[(20, registers)]);
    assert_eq!(hours(&[1234, 0, 30, 0]), r#"{"value":1234.5,"quality":"good"}"#);
    assert_eq!(hours(&[0, 1, 0, 1]), r#"{"value":65536.0003,"quality":"good"}"#, "two registers of hours");
    assert_eq!(hours(&[7, 0, 0, 0]), r#"{"value":7,"quality":"good"}"#);
    assert_eq!(hours(&[7, 0, 0x7FFE, 0]), r#"{"value":null,"quality":"invalid"}"#, "a sentinel");
    assert_eq!(hours(&[7, 0, 60, 0]), r#"{"value":null,"quality":"invalid"}"#, "no minute of an hour");
    assert_eq!(hours(&[7, 0, 30]), "unread", "no seconds yet");
    let supply = shown(&profile, "src1.supply.hours", &[(24, &[2, 45])]);
    assert_eq!(supply, r#"{"value":2.75,"quality":"good"}"#, "without seconds");
}

#[test]
fn a_clock_is_local_time_without_a_zone() {
    let profile = sample();
    let clock = |registers: &[u16]| shown(&profile, "clock", &[(10, registers)]);
    assert_eq!(
        clock(&[0xFF1A, 11, 23, 5, 19, 51]),
        r#"{"value":"2026-11-23T05:19:51","quality":"good"}"#,
        "the high byte is noise"
    );
    assert_eq!(clock(&[26, 2, 29, 5, 19, 51]), r#"{"value":null,"quality":"invalid"}"#, "no day");
    assert_eq!(clock(&[26, 11, 23, 5, 19]), "unread");
}

#[test]
fn the_controllers_have_theirs() {
    let acc = builtin("smartgen-acc1700").unwrap();
    let hours = shown(acc, "engine.hours", &[(101, &[1200, 20, 6])]);
    assert_eq!(hours, r#"{"value":1200.335,"quality":"good"}"#);
    assert_eq!(
        shown(acc, "engine.hours", &[(101, &[1200, 32767, 6])]),
        r#"{"value":null,"quality":"invalid"}"#
    );
    assert_eq!(
        shown(acc, "service.10.hours_left", &[(187, &[50, 15, 0])]),
        r#"{"value":50.25,"quality":"good"}"#
    );
    let hat = builtin("smartgen-hat821si").unwrap();
    let supply = shown(hat, "load2.supply.total.hours", &[(1162, &[1, 1, 30, 0])]);
    assert_eq!(supply, r#"{"value":65537.5,"quality":"good"}"#);
    // The weekday stands between day and hour.
    let clock = shown(hat, "clock", &[(1100, &[26, 11, 23, 1, 5, 19, 51])]);
    assert_eq!(clock, r#"{"value":"2026-11-23T05:19:51","quality":"good"}"#);
    let dkg = builtin("datakom-dkg705").unwrap();
    let clock = shown(dkg, "clock", &[(0x24, &[0x1A, 0x0B, 0x17, 5, 19, 51])]);
    assert_eq!(clock, r#"{"value":"2026-11-23T05:19:51","quality":"good"}"#);
    let counts: Vec<_> =
        builtins().iter().map(|profile| (profile.key.as_str(), profile.joined().len())).collect();
    let expected =
        [("datakom-d", 0), ("datakom-dkg705", 1), ("smartgen-acc1700", 12), ("smartgen-hat821si", 9)];
    assert_eq!(counts, expected);
}
