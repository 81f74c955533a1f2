//! Every key with a wrong type and a wrong spelling, and every limit from both sides.

use super::*;

/// A file in which every table stands, with nothing wrong.
const SOUND: &str = r#"
[site]
name = "S"
time_zone = "UTC"
[server]
listen = "127.0.0.1:1"
hosts = ["a"]
[[wires]]
id = "w"
endpoint = "tcp://h"
timeout = "1s"
spacing = "1s"
trace = true
[[devices]]
id = "g"
name = "G"
profile = "datakom-d"
model = "D-500"
wire = "w"
unit = 1
word_order = "low-first"
desired_mode = "auto"
nameplate_kw = 1
tank_litres = 1
battery_volts = 24
[devices.poll]
fast = "1s"
slow = "10s"
[[nodes]]
id = "n"
kind = "mains"
name = "N"
device = "g"
signals = "mains"
[[nodes]]
id = "m"
kind = "bus"
[[connections]]
from = "n"
to = "m"
device = "g"
breaker = "breaker.mains.closed"
"#;

const TABLES: &[(&str, &str, &[&str])] = &[
    ("[site]", "[site]", keys::SITE),
    ("[server]", "[server]", keys::SERVER),
    ("[[wires]]", "[[wires]]", keys::WIRE),
    ("[[devices]]", "[[devices]]", keys::DEVICE),
    ("[devices.poll]", "poll", keys::POLL),
    ("[[nodes]]", "[[nodes]]", keys::NODE),
    ("[[connections]]", "[[connections]]", keys::CONNECTION),
];

/// The first table under that heading with one line replaced, and the number of that line.
fn replaced(heading: &str, key: &str, line: &str) -> (String, usize) {
    let mut lines: Vec<&str> = SOUND.lines().collect();
    let start = lines.iter().position(|line| *line == heading).unwrap();
    let starts = |line: &&str| line.starts_with(&format!("{key} = "));
    let at = start + lines[start..].iter().position(starts).unwrap_or_else(|| panic!("{heading} {key}"));
    lines[at] = line;
    (lines.join("\n"), at + 1)
}

#[test]
fn every_key_wants_its_type() {
    assert_eq!(warned(SOUND), [""; 0]);
    let text = "write a text in quotes";
    let duration = "write a duration in quotes, such as \"1s\"";
    let number = "write a number without quotes";
    for (heading, _, keys) in TABLES {
        for key in keys.iter().filter(|key| **key != "poll") {
            let (wrong, found, remedy) = match *key {
                "timeout" | "spacing" | "fast" | "slow" => ("5", "integer", duration),
                "unit" => ("1.0", "float", "write a whole number without quotes"),
                "nameplate_kw" | "tank_litres" | "battery_volts" => ("\"24\"", "string", number),
                "hosts" => ("\"a\"", "string", "write a list of texts in quotes, in square brackets"),
                "trace" => ("\"true\"", "string", "write true or false without quotes"),
                _ => ("true", "boolean", text),
            };
            let (text, line) = replaced(heading, key, &format!("{key} = {wrong}"));
            let column = key.len() + 4;
            let expected =
                format!("site.toml:{line}:{column}: `{key}` has the wrong type ({found}); {remedy}");
            let found = mistakes(&text);
            assert_eq!(found[0], expected, "{heading} {key}");
            // Nothing but what cannot be defined without it is found beside it.
            assert!(found.len() == 1 || *key == "id", "{found:#?}");
        }
    }
}

#[test]
fn every_table_knows_its_keys() {
    for (heading, name, keys) in TABLES {
        for key in *keys {
            let slip = format!("{key}e");
            let lines: Vec<&str> = SOUND.lines().collect();
            let at = lines.iter().position(|line| line == heading).unwrap();
            let text = format!("{}\n{slip} = 1\n{}", lines[..=at].join("\n"), lines[at + 1..].join("\n"));
            let expected =
                format!("site.toml:{}:1: unknown key `{slip}` in {name}; did you mean `{key}`?", at + 2);
            assert_eq!(mistakes(&text), [expected]);
        }
        let far = SOUND.replacen(heading, &format!("{heading}\ncolour = 1"), 1);
        let found = mistakes(&far);
        assert!(
            found[0].ends_with(&format!("`colour` in {name}; write one of: {}", keys.join(", "))),
            "{found:?}"
        );
    }
    for key in keys::FILE {
        let found = mistakes(&format!("{key}s = 1\n{SOUND}"));
        assert_eq!(
            found,
            [format!("site.toml:1:1: unknown key `{key}s` in a site file; did you mean `{key}`?")]
        );
        let found = mistakes(&format!("{key} = 1\nsite.name = \"S\"").replace("site = 1\n", "site = 1\n#"));
        assert!(found[0].contains(&format!("`{key}` has the wrong type (integer); write a")), "{found:?}");
    }
    for key in ["wires", "devices", "nodes", "connections"] {
        assert_eq!(
            mistakes(&with(&format!("{key} = [1]"))),
            [format!("site.toml:2:{}: `{key}` has the wrong type (integer); write a table", key.len() + 5)]
        );
    }
}

#[test]
fn every_limit_has_two_sides() {
    let duration = |range: &str| format!("write a duration from {range}");
    let kw = "write a number of kW above 0, up to 100000";
    let litres = "write a number of litres above 0, up to 1000000";
    let volts = "write a number of volts from 6 to 250, such as 12 or 24";
    for (heading, key, within, without, remedy) in [
        (
            "[[wires]]",
            "timeout",
            ["\"10ms\"", "\"1min\""],
            ["\"9ms\"", "\"60001ms\""],
            &*duration("10ms to 1min"),
        ),
        ("[[wires]]", "spacing", ["\"0s\"", "\"10s\""], ["\"10001ms\"", "\"1h\""], &duration("0s to 10s")),
        (
            "[devices.poll]",
            "fast",
            ["\"10ms\"", "\"10s\""],
            ["\"9ms\"", "\"61min\""],
            &duration("10ms to 1h"),
        ),
        ("[devices.poll]", "slow", ["\"1s\"", "\"1h\""], ["\"9ms\"", "\"61min\""], &duration("10ms to 1h")),
        ("[[devices]]", "nameplate_kw", ["0.001", "100_000"], ["0", "100_000.1"], kw),
        ("[[devices]]", "nameplate_kw", ["1e5", "0x10"], ["-0.0", "99999999999999999999"], kw),
        ("[[devices]]", "nameplate_kw", ["1", "1.5"], ["nan", "inf"], kw),
        ("[[devices]]", "nameplate_kw", ["+1", "1e-3"], ["-inf", "-nan"], kw),
        ("[[devices]]", "tank_litres", ["0.5", "1_000_000"], ["0.0", "1_000_001"], litres),
        ("[[devices]]", "tank_litres", ["1", "2"], ["nan", "-5"], litres),
        ("[[devices]]", "battery_volts", ["6", "250.0"], ["5.9", "251"], volts),
        ("[[devices]]", "battery_volts", ["12", "24"], ["nan", "inf"], volts),
    ] {
        for value in within {
            let (text, _) = replaced(heading, key, &format!("{key} = {value}"));
            assert_eq!(warned(&text), [""; 0]);
        }
        for value in without {
            let (text, line) = replaced(heading, key, &format!("{key} = {value}"));
            let value = value.trim_matches('"').replace('_', "");
            let column = key.len() + 4;
            assert_eq!(mistakes(&text), [format!("site.toml:{line}:{column}: `{key}` is {value}; {remedy}")]);
        }
    }
}

#[test]
fn every_profile_has_its_units() {
    for profile in busbar_profile::builtins() {
        let (min, max) = (profile.wire.unit.min, profile.wire.unit.max);
        let unit =
            |unit: i64| device_with("unit", &format!("unit = {unit}")).replace("datakom-d", &profile.key);
        for within in [min, max] {
            assert_eq!(Site::parse("site.toml", &unit(within.into())).unwrap().devices[0].unit, within);
        }
        for without in [i64::from(min) - 1, i64::from(max) + 1, -1, 256, 257] {
            assert_eq!(
                mistakes(&unit(without)),
                [format!(
                    "site.toml:9:8: {} knows no unit {without}; write a number from {min} to {max}",
                    profile.key
                )]
            );
        }
    }
}
