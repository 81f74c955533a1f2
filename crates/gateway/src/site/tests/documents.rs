//! What people read of the site file: the sample, its page, and the README's ten lines.

use std::collections::{BTreeMap, BTreeSet};

use toml::{Table, Value};

use super::*;

const SAMPLE: &str = include_str!("../../../../../examples/site.toml");
const PAGE: &str = include_str!("../../../../../docs/site-file.md");
const README: &str = include_str!("../../../../../README.md");

const TABLES: &[(&str, &[&str])] = &[
    ("", keys::FILE),
    ("site", keys::SITE),
    ("server", keys::SERVER),
    ("wires", keys::WIRE),
    ("devices", keys::DEVICE),
    ("devices.poll", keys::POLL),
    ("nodes", keys::NODE),
    ("connections", keys::CONNECTION),
];

/// The keys that a text uses, by the table they stand in.
fn used(name: &str, table: &Table, used_keys: &mut BTreeMap<String, BTreeSet<String>>) {
    let below = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    for (key, value) in table {
        used_keys.entry(name.to_owned()).or_default().insert(key.clone());
        match value {
            Value::Table(table) => used(&below(key), table, used_keys),
            Value::Array(array) => {
                array.iter().filter_map(Value::as_table).for_each(|table| used(&below(key), table, used_keys))
            }
            _ => {}
        }
    }
}

/// The blocks of TOML in a page.
fn blocks(page: &str) -> Vec<&str> {
    page.split("```toml\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect()
}

#[test]
fn the_sample_is_sound() {
    let site = Site::parse("examples/site.toml", SAMPLE).unwrap_or_else(|findings| panic!("{findings}"));
    assert!(site.warnings.is_empty(), "{:?}", site.warnings);
    let on_the_line = site.devices.iter().filter(|device| site.wires[device.wire].id == "line");
    assert_eq!((on_the_line.count(), site.devices.len()), (3, 4));
    let schemes: Vec<&str> = site.wires.iter().map(|wire| wire.endpoint.scheme()).collect();
    assert_eq!(schemes, ["tcp", "rtu"]);
    let profiles: BTreeSet<&str> = site.devices.iter().map(|device| device.profile.key.as_str()).collect();
    assert_eq!(profiles.len(), busbar_profile::builtins().len());
    for kind in NodeKind::ALL {
        assert!(site.diagram.nodes.iter().any(|node| node.kind == *kind), "{kind:?}");
    }
    for device in &site.devices {
        assert!(
            site.diagram.nodes.iter().any(|node| node.device.as_ref() == Some(&device.id)),
            "{}",
            device.id
        );
    }
}

#[test]
fn the_sample_uses_every_key_there_is() {
    let mut found = BTreeMap::new();
    used("", &SAMPLE.parse().unwrap(), &mut found);
    let expected: BTreeMap<String, BTreeSet<String>> = TABLES
        .iter()
        .map(|(name, keys)| ((*name).to_owned(), keys.iter().map(|key| (*key).to_owned()).collect()))
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn the_page_explains_every_key_and_no_other() {
    let rows: BTreeSet<&str> =
        PAGE.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    let sections: BTreeSet<&str> = ["site", "server", "wires", "devices", "nodes", "connections"].into();
    assert_eq!(keys::FILE.iter().copied().collect::<BTreeSet<_>>(), sections);
    for section in &sections {
        let is_explained = PAGE
            .lines()
            .filter(|line| line.starts_with("## "))
            .any(|line| line.contains(&format!("[{section}]")));
        assert!(is_explained, "{section}");
    }
    let keys: BTreeSet<&str> = TABLES[1..].iter().flat_map(|(_, keys)| keys.iter().copied()).collect();
    assert_eq!(rows, keys);
}

#[test]
fn what_the_page_and_the_readme_show_is_right() {
    let [least, drawn] = blocks(PAGE)[..] else { panic!("two blocks of TOML in docs/site-file.md") };
    for (text, warnings) in [(least.to_owned(), 0), (format!("{least}\n{drawn}"), 0)] {
        let site = Site::parse("docs/site-file.md", &text).unwrap_or_else(|findings| panic!("{findings}"));
        assert_eq!(site.warnings.len(), warnings, "{:?}", site.warnings);
    }
    let [readme] = blocks(README)[..] else { panic!("one block of TOML in README.md") };
    let site = Site::parse("README.md", readme).unwrap_or_else(|findings| panic!("{findings}"));
    assert!(site.warnings.is_empty() && site.devices.len() == 1);
    assert!(README.contains("docs/site-file.md") && SAMPLE.contains("docs/site-file.md"));
}

/// Whatever becomes of a file on its way, what is found lies in it, and nothing is taken that leads nowhere.
#[test]
fn a_damaged_sample_is_refused_or_sound() {
    let lines: Vec<&str> = SAMPLE.lines().collect();
    let without = |at: usize| [&lines[..at], &lines[at + 1..]].concat().join("\n");
    let twice = |at: usize| [&lines[..=at], &lines[at..]].concat().join("\n");
    let cut = |at: usize| SAMPLE[..at * SAMPLE.len() / lines.len()].to_owned();
    let mut outcomes = BTreeMap::new();
    for at in 0..lines.len() {
        for text in [without(at), twice(at), cut(at)] {
            let accepted = match Site::parse("site.toml", &text) {
                Ok(site) => {
                    assert!(site.devices.iter().all(|device| device.wire < site.wires.len()));
                    let is_node = |id: &String| site.diagram.nodes.iter().any(|node| node.id == *id);
                    assert!(
                        site.diagram.connections.iter().all(|line| is_node(&line.from) && is_node(&line.to))
                    );
                    true
                }
                Err(findings) => {
                    for finding in &findings {
                        assert!(finding.offset + finding.length <= text.len(), "{finding}");
                        assert!(finding.line >= 1 && finding.column >= 1, "{finding}");
                        assert!(!finding.message.is_empty() && !finding.help.is_empty(), "{finding}");
                    }
                    false
                }
            };
            *outcomes.entry(accepted).or_insert(0) += 1;
        }
    }
    assert!(outcomes[&true] > 50 && outcomes[&false] > 50, "{outcomes:?}");
}
