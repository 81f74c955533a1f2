//! Register images and what they must decode to: `golden.toml` of every profile, worked out by hand from the manuals.
#![cfg(test)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use busbar_profile::{Number, Point, Profile, Reading, WordOrder, builtins, decode_window, reading};
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
    /// Labels of the codes from 0 on, where a value prints codes alone.
    #[serde(default)]
    labels: BTreeMap<String, Vec<String>>,
    #[serde(default)]
    invalid: Vec<String>,
}

/// One label of one point: of a code, on a model if it depends on that, or of a bit.
type Label<'p> = (&'p str, u32, Option<&'p str>);

#[test]
fn every_profile_decodes_its_golden_images() {
    let mut failures = Vec::new();
    let mut keys = Vec::new();
    for (profile, golden) in all() {
        assert!(!golden.case.is_empty(), "{} has no case", profile.key);
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

/// Two labels that change places would pass every test that looks at codes and bit numbers only.
#[test]
fn every_label_stands_in_a_golden_image() {
    let mut missing = Vec::new();
    for (profile, golden) in all() {
        let seen: BTreeSet<Label<'_>> = golden.case.iter().flat_map(|case| seen(&profile, case)).collect();
        for point in &profile.points {
            for (_, number, model) in labels(point).filter(|label| !seen.contains(label)) {
                let model = model.map(|model| format!(" on a {model}")).unwrap_or_default();
                missing.push(format!("{}: {} {number}{model}", profile.key, point.id));
            }
        }
    }
    assert!(missing.is_empty(), "no case expects the label of\n{}", missing.join("\n"));
}

/// Every profile with its golden images, in the order of their keys.
fn all() -> Vec<(Profile, Golden)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../profiles");
    let mut folders: Vec<_> =
        fs::read_dir(root).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders.iter().map(|folder| load(folder)).collect()
}

fn load(folder: &Path) -> (Profile, Golden) {
    let profile_file = folder.join("profile.toml");
    let text = fs::read_to_string(&profile_file).unwrap();
    let profile = Profile::parse(&profile_file.display().to_string(), &text)
        .unwrap_or_else(|findings| panic!("{findings}"));
    let golden_file = folder.join("golden.toml");
    let text =
        fs::read_to_string(&golden_file).unwrap_or_else(|error| panic!("{}: {error}", golden_file.display()));
    let golden = toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", golden_file.display()));
    (profile, golden)
}

/// The readings of a case, labelled for the model that its own registers name, as the command line does it.
fn readings<'a>(profile: &'a Profile, case: &'a Case) -> BTreeMap<&'a str, Reading<'a>> {
    let order = case.word_order.unwrap_or(profile.wire.word_order);
    let model = model(profile, case);
    decode_window(profile, case.address, &case.registers, order)
        .iter()
        .map(|(point, decoded)| {
            let raw = point.within(case.address, &case.registers).unwrap();
            (point.id.as_str(), reading(point, decoded, raw, model))
        })
        .collect()
}

fn model<'a>(profile: &'a Profile, case: &Case) -> Option<&'a str> {
    let identity = &profile.points[profile.identity.as_ref()?.point];
    let registers = identity.within(case.address, &case.registers)?;
    let code = identity.raw_code(registers, profile.wire.word_order)?;
    profile.model(u16::try_from(code).ok()?)
}

/// Every label that a point has.
fn labels(point: &Point) -> impl Iterator<Item = Label<'_>> {
    let id = point.id.as_str();
    let choices = point.choices.iter().flat_map(move |choice| {
        let models = choice.by_model.iter().map(|(model, _)| Some(model.as_str()));
        [None].into_iter().chain(models).map(move |model| (id, choice.value, model))
    });
    choices.chain(point.bits.iter().map(move |bit| (id, u32::from(bit.bit), None)))
}

/// The labels that a case expects literally.
fn seen<'p>(profile: &'p Profile, case: &Case) -> Vec<Label<'p>> {
    let readings = readings(profile, case);
    let model = model(profile, case);
    let mut seen = Vec::new();
    for (id, reading) in readings.iter().filter(|(id, _)| case.expect.contains_key(**id)) {
        let point = profile.point(id).unwrap();
        let bits = reading.set.iter().flatten().map(|bit| (point.id.as_str(), u32::from(*bit), None));
        seen.extend(bits);
        if let Some(code) = reading.code {
            let by_model = point.choice(code).map(|choice| choice.by_model.as_slice()).unwrap_or_default();
            let own = by_model.iter().map(|(own, _)| own.as_str()).find(|own| Some(*own) == model);
            seen.push((&point.id, code, own));
        }
    }
    for (id, labels) in &case.labels {
        if let Some(point) = profile.point(id) {
            seen.extend((0..labels.len()).map(|code| (point.id.as_str(), code as u32, None)));
        }
    }
    seen
}

fn check(profile: &Profile, case: &Case) -> Vec<String> {
    let readings = readings(profile, case);
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
    for (id, labels) in &case.labels {
        expect(id, &format!("labelled {labels:?}"), &|_| {
            let point = profile.point(id).unwrap();
            (0..).zip(labels).all(|(code, label)| point.label(code, None) == *label)
        });
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
