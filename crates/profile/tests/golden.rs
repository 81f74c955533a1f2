//! Register images and what they must decode to: `golden.toml` of every profile, worked out by hand from the manuals.
#![cfg(test)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use busbar_profile::{Number, Profile, Reading, WordOrder, builtins, decode_window, reading};
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Golden {
    case: Vec<Case>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    address: u16,
    registers: Vec<u16>,
    word_order: Option<WordOrder>,
    #[serde(default)]
    expect: BTreeMap<String, toml::Value>,
    #[serde(default)]
    code: BTreeMap<String, u32>,
    #[serde(default)]
    set: BTreeMap<String, Vec<u16>>,
    #[serde(default)]
    invalid: Vec<String>,
}

#[test]
fn every_profile_decodes_its_golden_images() {
    let mut failures = Vec::new();
    let mut keys = Vec::new();
    for folder in folders() {
        let profile_file = folder.join("profile.toml");
        let text = fs::read_to_string(&profile_file).unwrap();
        let profile = Profile::parse(&profile_file.display().to_string(), &text)
            .unwrap_or_else(|findings| panic!("{findings}"));
        let golden_file = folder.join("golden.toml");
        let text = fs::read_to_string(&golden_file)
            .unwrap_or_else(|error| panic!("{}: {error}", golden_file.display()));
        let golden: Golden =
            toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", golden_file.display()));
        assert!(!golden.case.is_empty(), "{} has no case", golden_file.display());
        for case in &golden.case {
            for failure in check(&profile, case) {
                failures.push(format!("{}: {}: {failure}", profile.key, case.name));
            }
        }
        keys.push(profile.key);
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    let built_in: Vec<_> = builtins().iter().map(|profile| profile.key.clone()).collect();
    assert_eq!(keys, built_in, "every folder of profiles/ is built in");
}

fn folders() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../profiles");
    let mut folders: Vec<_> =
        fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

fn check(profile: &Profile, case: &Case) -> Vec<String> {
    let order = case.word_order.unwrap_or(profile.wire.word_order);
    let decoded = decode_window(profile, case.address, &case.registers, order);
    let readings: BTreeMap<&str, Reading<'_>> = decoded
        .iter()
        .map(|(point, decoded)| {
            let raw = point.within(case.address, &case.registers).unwrap();
            (point.id.as_str(), reading(point, decoded, raw, None))
        })
        .collect();
    let mut failures = Vec::new();
    let mut expect = |id: &str, what: &str, holds: &dyn Fn(&Reading<'_>) -> bool| match readings.get(id) {
        None => failures.push(format!("{id} is not wholly inside the registers")),
        Some(reading) if !holds(reading) => {
            failures.push(format!("{id} is {}, not {what}", serde_json::to_string(reading).unwrap()));
        }
        Some(_) => {}
    };
    for (id, value) in &case.expect {
        expect(id, &value.to_string(), &|reading| {
            let shown = serde_json::to_value(reading).unwrap();
            same(&shown["value"], value) && shown["quality"] == "good"
        });
    }
    for (id, code) in &case.code {
        expect(id, &format!("of code {code}"), &|reading| reading.code == Some(*code));
    }
    for (id, set) in &case.set {
        expect(id, &format!("set {set:?}"), &|reading| reading.set.as_ref() == Some(set));
    }
    for id in &case.invalid {
        expect(id, "invalid", &|reading| {
            let shown = serde_json::to_value(reading).unwrap();
            shown["value"].is_null() && shown["quality"] == "invalid"
        });
    }
    if case.expect.is_empty() && case.code.is_empty() && case.set.is_empty() && case.invalid.is_empty() {
        failures.push("nothing is expected".to_owned());
    }
    failures
}

/// Numbers by value, as their shortest text has it; everything else literally.
fn same(shown: &serde_json::Value, expected: &toml::Value) -> bool {
    match (shown, expected) {
        (serde_json::Value::Number(shown), toml::Value::Integer(_) | toml::Value::Float(_)) => {
            let number = |text: String| text.parse::<Number>().unwrap();
            let expected = match expected {
                toml::Value::Integer(integer) => integer.to_string(),
                toml::Value::Float(float) => float.to_string(),
                _ => return false,
            };
            number(shown.to_string()) == number(expected)
        }
        (serde_json::Value::String(shown), toml::Value::String(expected)) => shown == expected,
        (serde_json::Value::Array(shown), toml::Value::Array(expected)) => {
            shown.len() == expected.len()
                && shown.iter().zip(expected).all(|(shown, expected)| same(shown, expected))
        }
        _ => false,
    }
}
