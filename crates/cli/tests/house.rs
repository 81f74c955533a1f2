//! ARCHITECTURE.md against the code: every crate it names exists, none is missing, none imports upwards.

// Helpers of tests may fail as tests do; clippy's exception for tests stops at functions marked as such.
#![allow(clippy::unwrap_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// What each crate may use, as the table in ARCHITECTURE.md says.
fn documented() -> BTreeMap<String, BTreeSet<String>> {
    let page = page();
    let rows: Vec<Vec<&str>> = page
        .lines()
        .filter(|line| line.starts_with("| `crates/"))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    let names: Vec<String> = rows.iter().map(|row| row[1].replace("crates/", "").replace('`', "")).collect();
    rows.iter()
        .zip(&names)
        .map(|(row, name)| {
            let uses = match row[3] {
                "nothing" => BTreeSet::new(),
                "all" => names.iter().filter(|other| *other != name).cloned().collect(),
                list => list.split(',').map(|part| part.trim().replace('`', "")).collect(),
            };
            (name.clone(), uses)
        })
        .collect()
}

/// What each crate under `crates/` depends on among the others, tests included.
fn built() -> BTreeMap<String, BTreeSet<String>> {
    fs::read_dir(root().join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|folder| {
            let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
            let uses = manifest
                .lines()
                .filter_map(|line| line.strip_prefix("busbar-"))
                .map(|line| line.split(['.', ' ', '=']).next().unwrap_or_default().to_owned())
                .collect();
            (folder.file_name().unwrap().to_string_lossy().into_owned(), uses)
        })
        .collect()
}

fn page() -> String {
    fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_page_names_every_crate_and_no_other() {
    assert_eq!(documented().keys().collect::<Vec<_>>(), built().keys().collect::<Vec<_>>());
}

#[test]
fn no_crate_uses_what_the_page_does_not_allow() {
    let allowed = documented();
    for (name, uses) in built() {
        let forbidden: Vec<_> = uses.difference(&allowed[&name]).collect();
        assert!(forbidden.is_empty(), "{name} uses {forbidden:?}, which ARCHITECTURE.md does not allow");
    }
}

#[test]
fn arrows_never_lead_back() {
    let allowed = documented();
    for start in allowed.keys() {
        let mut open = vec![start];
        let mut seen = BTreeSet::new();
        while let Some(name) = open.pop() {
            for used in &allowed[name] {
                assert_ne!(used, start, "a circle through {name}");
                if seen.insert(used) {
                    open.push(used);
                }
            }
        }
    }
}

#[test]
fn folders_and_files_that_the_page_names_exist() {
    for name in page().split('`').skip(1).step_by(2) {
        let is_path = ["crates/", "profiles/profile", "web/src"].iter().any(|start| name.starts_with(start));
        if is_path || (name.ends_with('/') && !name.contains(' ')) {
            assert!(root().join(name).exists(), "ARCHITECTURE.md names {name}, which does not exist");
        }
    }
}

#[test]
fn modules_that_the_page_names_exist() {
    let crates = built();
    let page = page();
    let named = page.split('`').skip(1).step_by(2).filter_map(|name| name.split_once("::"));
    let mut count = 0;
    for (room, rest) in named.filter(|(room, _)| crates.contains_key(*room)) {
        let module = rest.split("::").next().unwrap_or_default();
        if module.chars().all(|letter| letter.is_lowercase() || letter == '_') {
            let folder = root().join("crates").join(room).join("src");
            let exists = folder.join(format!("{module}.rs")).exists() || folder.join(module).is_dir();
            assert!(exists, "ARCHITECTURE.md names {room}::{rest}, which does not exist");
            count += 1;
        }
    }
    assert!(count > 2, "the page names the modules on a reading's way");
}

#[test]
fn banned_crates_stay_out() {
    let lock = fs::read_to_string(root().join("Cargo.lock")).unwrap();
    for banned in ["openssl-sys", "native-tls", "aws-lc-sys", "rodbus"] {
        assert!(
            !lock.contains(&format!("name = \"{banned}\"")),
            "{banned} is in Cargo.lock: deny.toml says why not"
        );
    }
}
