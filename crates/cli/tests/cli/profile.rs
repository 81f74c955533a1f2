//! `busbar profile`, and profile files with mistakes in them.

use serde_json::{Value, json};

use crate::support::{busbar, call, without_folder, write};

/// A whole profile in few lines.
const SMALL: &str = r#"format = 1
key = "small"
vendor = "Datakom"
models = ["S-1"]
kind = "genset"

[manual]
title = "A manual"

[wire]
transports = ["tcp"]
unit = { min = 1, max = 9, default = 3 }
functions = [3]
max_read = 16
over_read = "refuse"
spacing_ms = 0
answer_delay_ms = 4.3
timeout_ms = 500
word_order = "low-first"
serial = { baud = [9600], parity = ["none"], stop = [1] }
readable = [[100, 103]]

[[groups]]
id = "all"
title = "All"
rate = "fast"
points = [
  { at = 100, id = "frequency", type = "u16", coeff = 100, unit = "Hz", name = "Frequency" },
  { at = 102, id = "energy", type = "u32", coeff = 10, unit = "kWh", name = "Energy" },
]
"#;

#[test]
fn list_has_the_contracts_keys() {
    let list = busbar("profile list --json").ok().silently().json();
    let datakom = list.as_array().unwrap().iter().find(|profile| profile["key"] == "datakom-d").unwrap();
    let keys: Vec<&String> = datakom.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["bits", "coils", "commands", "key", "kind", "models", "points", "vendor"]);
    assert_eq!(datakom["models"], json!(["D-300", "D-500", "D-700"]));
    insta::assert_snapshot!(busbar("profile list").ok().silently().out());
}

#[test]
fn show_has_the_contracts_example_in_it() {
    let shown = busbar("profile show datakom-d --json").ok().silently().json();
    for (key, expected) in [
        ("key", json!("datakom-d")),
        ("vendor", json!("Datakom")),
        ("models", json!(["D-300", "D-500", "D-700"])),
        ("kind", json!("genset")),
        ("coils", json!([])),
    ] {
        assert_eq!(shown[key], expected, "{key}");
    }
    let wire = &shown["wire"];
    assert_eq!(wire["readable"][0], json!([10240, 10551]));
    let mut rest = wire.clone();
    rest["readable"] = json!([[10240, 10551]]);
    assert_eq!(
        rest,
        json!({ "transports": ["rtu", "tcp"], "unit": { "min": 1, "max": 240, "default": 1 }, "functions": [3, 6, 16],
            "max_read": 16, "over_read": "truncate", "spacing_ms": 0, "answer_delay_ms": 0, "word_order": "low-first",
            "serial": { "baud": [2400, 4800, 9600, 19200, 38400, 57600, 115200], "parity": ["none"], "stop": [1] },
            "readable": [[10240, 10551]] })
    );
    assert_eq!(
        *named(&shown["points"], "genset_l1_voltage"),
        json!({ "id": "genset_l1_voltage", "name": "Genset phase L1 voltage", "address": 10246, "registers": 2,
            "access": "r", "type": "u32", "unit": "V", "scale": { "num": 1, "den": 10, "offset": 0 },
            "signal": "genset.l1.voltage", "choices": [], "bits": [], "sentinels": [], "doubt": null })
    );
    let auto = named(&shown["commands"], "auto");
    assert_eq!(auto["name"], json!("Auto mode"));
    assert!(auto["args"].is_array());
    let alarm = &named(&shown["points"], "shutdown_alarms")["bits"][0];
    assert_eq!(alarm.as_object().unwrap().keys().collect::<Vec<_>>(), ["bit", "class", "id", "label"]);
    assert_eq!(alarm["class"], json!("shutdown"));
    let choice = &named(&shown["points"], "operation_status")["choices"][0];
    assert_eq!(*choice, json!({ "value": 0, "label": "Genset at rest" }));
}

fn named<'a>(list: &'a Value, id: &str) -> &'a Value {
    list.as_array().unwrap().iter().find(|item| item["id"] == id).unwrap()
}

#[test]
fn show_is_readable() {
    let text = busbar("profile show datakom-d").ok().silently().out();
    for part in [
        "datakom-d  Datakom D-300, D-500, D-700\n",
        "  unit id           1 to 240, 1 as delivered\n",
        "  10246  410247  Genset phase L1 voltage ",
        "shutdown_alarms, load_dump_alarms, warning_alarms\n",
        "   bit 48  Genset low frequency\n",
    ] {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
    assert!(text.lines().all(|line| line.trim_end() == line), "blanks at the end of a line");
}

#[test]
fn a_file_is_a_profile_too() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "small.toml", SMALL);
    let shown = call(["profile", "show", &file, "--json"]).ok().json();
    assert_eq!(shown["wire"]["unit"]["default"], json!(3));
    call(["decode", &file, "100", "1388", "--json"]).ok().prints(
        "[{\"id\":\"frequency\",\"address\":100,\"value\":50,\"unit\":\"Hz\",\"quality\":\"good\",\"raw\":[5000]}]\n",
    );
    let checked = call(["profile", "check", &file]).ok().silently().out();
    insta::assert_snapshot!(without_folder(&checked, folder.path()));
    insta::assert_snapshot!(call(["profile", "show", &file]).ok().silently().out());
}

#[test]
fn check_says_what_is_right_and_what_is_wrong_in_json() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "small.toml", SMALL);
    let right = call(["profile", "check", &file, "--json"]).ok().json();
    assert_eq!(
        (&right["ok"], &right["profile"]["points"], &right["findings"]),
        (&json!(true), &json!(2), &json!([]))
    );

    let file = write(folder.path(), "wrong.toml", &SMALL.replace("max_read = 16", "max_read = \"16\""));
    let wrong = call(["profile", "check", &file, "--json"]).fails().json();
    assert_eq!((&wrong["ok"], &wrong["profile"]), (&json!(false), &json!(null)));
    assert_eq!((&wrong["findings"][0]["line"], &wrong["findings"][0]["column"]), (&json!(14), &json!(12)));
}

#[test]
fn mistakes_are_shown_where_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    for (name, from, to) in [
        ("unknown_key", "max_read = 16", "max_reed = 16"),
        ("unknown_key_of_a_point", "unit = \"Hz\"", "units = \"Hz\""),
        ("wrong_type", "max_read = 16", "max_read = \"16\""),
        ("outside_the_map", "at = 102", "at = 103"),
        ("no_toml", "key = \"small\"", "key = small"),
        ("unknown_type", "type = \"u16\"", "type = \"word\""),
    ] {
        assert!(SMALL.contains(from));
        let file = write(folder.path(), "profile.toml", &SMALL.replace(from, to));
        let check = call(["profile", "check", &file]).fails().prints("");
        insta::assert_snapshot!(format!("mistake_{name}"), without_folder(&check.err(), folder.path()));
        // Every command that takes a KEY refuses it in the same words, and does nothing else.
        for arguments in [&["profile", "show"][..], &["decode"]] {
            let mut arguments: Vec<&str> = arguments.to_vec();
            arguments.push(&file);
            if arguments[0] == "decode" {
                arguments.extend(["100", "0000"]);
            }
            assert_eq!(call(arguments).fails().prints("").err(), check.err());
        }
    }
}

#[test]
fn several_mistakes_are_shown_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let text =
        SMALL.replace("kind = \"genset\"", "kind = \"boiler\"").replace("unit = \"kWh\"", "units = \"kWh\"");
    let file = write(folder.path(), "profile.toml", &text);
    call(["profile", "check", &file]).fails().mentions("profile.toml:5:8").mentions("profile.toml:29:56");
}

#[test]
fn a_file_that_cannot_be_read_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.toml").display().to_string();
    call(["profile", "check", &missing])
        .fails()
        .prints("")
        .says_in_one_sentence("cannot be read: there is no such file");
    call(["profile", "show", &missing])
        .fails()
        .prints("")
        .says_in_one_sentence("cannot be read: there is no such file");
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [0xFF, 0xFE, 0x00]).unwrap();
    call(["profile", "check", &binary.display().to_string()])
        .fails()
        .prints("")
        .says_in_one_sentence("binary.toml is not UTF-8 text: line 1 has other bytes; save it as UTF-8");
    std::fs::write(&binary, b"format = 1\nkey = \"\xE9\"\n").unwrap();
    call(["profile", "check", &binary.display().to_string()])
        .fails()
        .prints("")
        .says_in_one_sentence("binary.toml is not UTF-8 text: line 2 has other bytes");
}
