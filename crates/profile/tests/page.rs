//! The committed pages of `docs/profiles/` are what the profiles say, and no page stands there without a profile.
#![cfg(test)]

use std::fs;
use std::path::{Path, PathBuf};

use busbar_profile::page::{index, markdown};
use busbar_profile::{Profile, builtins};

const AGAIN: &str = "run again with UPDATE=1";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/profiles")
}

fn sample() -> Profile {
    let text = include_str!("sound.toml");
    Profile::parse("sound.toml", text).unwrap_or_else(|findings| panic!("{findings}"))
}

/// `UPDATE=1 cargo test -p busbar-profile --test page` writes the pages anew.
#[test]
fn the_committed_pages_are_current() {
    let pages = builtins().iter().map(|profile| (format!("{}.md", profile.key), markdown(profile)));
    let pages: Vec<_> = pages.chain([("README.md".to_owned(), index(builtins()))]).collect();
    for (name, page) in &pages {
        let path = folder().join(name);
        if std::env::var_os("UPDATE").is_some() {
            fs::create_dir_all(folder()).unwrap();
            fs::write(&path, page).unwrap();
        }
        let committed = fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == *page, "docs/profiles/{name} has drifted; {AGAIN}");
    }
    for entry in fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let known = pages.iter().any(|(page, _)| *page == name);
        assert!(known, "docs/profiles/{name} has no profile; delete it");
    }
}

#[test]
fn a_page_says_all_that_a_profile_says() {
    let page = markdown(&sample());
    for line in [
        "# Maker A, B",
        "Profile `sample`: genset, 24 points, 4 bits, 2 coils, 3 commands. Manual: A manual.",
        "| Registers a read | 16 at most; longer reads are refused |",
        "| Exception 10 | write protection |",
        "| Model | by `model_code`: 000Ah A |",
        "| 300 (012Ch) | 1100 (044Ch) | 801 |",
        "Read often, page 11.",
        "| 0 (0000h) | 40001 | 1 | `voltage` | Voltage | u16 | / 10 | V | r | `genset.l1.voltage` | 11 |  |",
        "| 4 (0004h) | 40005 | 1 | `coolant` | Coolant temperature | u8 | - 40 | degC | r |  | 11 | no value: FEh, FFh |",
        "| `model` | Model | u8, bits 15 to 8 |",
        "| 32 (0020h) | 40033 | 1 | `phase` | Phase angle | sm16 | 1 | deg | r |  | 11 | in doubt: unit |",
        "[codes](#codes-of-status); delay in `delay`",
        "### Codes of status",
        "| 0 | `rest` | At rest | stopped | shows no delay |",
        "| 1 | `run` | Running | running | A: Runs |",
        "| 4 to 7 |  | reserved |  |  |",
        "### Bits of alarms",
        "| 0 | `common` | Common alarm | status |",
        "| 3 | `breaker` | Breaker closed | `breaker.genset.closed` |",
        "| 3 (0003h) | `load_key` | Load key |",
        "| `load` | Load |  | stops supply | operator | `alarms` bit 15 (Low oil pressure) is 0; nothing is sent where \
         `options` bit 3 (Breaker closed) is 1 | function 5, 3 (0003h): FF00h | `options` bit 3 (Breaker closed) \
         changes within 10 s |",
        "`press`: short (0000h), long (4000h), else short; `channel`: 0 to 19 | none | admin, typed confirmation |",
        "function 6, 9000 (2328h): 0004h with `press` | none: nothing shows it |",
        "by `model_code` 0002h where it is 000Ah with `channel`",
        "`delay` is `channel` within 5 s, then `status` is 1 (Running) to 3 within 5 s, then the device is silent, \
         then back within 60 s |",
    ] {
        assert!(page.contains(line), "no {line:?} in\n{page}");
    }
}

#[test]
fn links_lead_to_titles() {
    for profile in builtins().iter().chain([&sample()]) {
        let page = markdown(profile);
        let titles: Vec<String> = page
            .lines()
            .filter_map(|line| line.strip_prefix("### "))
            .map(|title| title.to_lowercase().replace(',', "").replace(' ', "-"))
            .collect();
        let links: Vec<&str> = page.split("](#").skip(1).filter_map(|rest| rest.split(')').next()).collect();
        assert!(!links.is_empty());
        for link in links {
            assert_eq!(titles.iter().filter(|title| *title == link).count(), 1, "{}: {link}", profile.key);
        }
    }
}

#[test]
fn tables_are_whole() {
    for profile in builtins().iter().chain([&sample()]) {
        let page = markdown(profile);
        let mut columns = None;
        for line in page.lines() {
            let bars = line.replace("\\|", "").matches('|').count();
            assert!(columns.is_none_or(|columns| bars == 0 || bars == columns), "{}: {line}", profile.key);
            columns = (bars > 0).then_some(bars);
        }
        for point in &profile.points {
            assert!(page.contains(&format!("| `{}` |", point.id)), "{}: {}", profile.key, point.id);
        }
    }
}

#[test]
fn text_of_a_profile_cannot_break_a_table() {
    let text = include_str!("sound.toml").replace("name = \"Brand\"", "name = \"Brand | <b> [x] *y*\"");
    let profile = Profile::parse("sound.toml", &text).unwrap_or_else(|findings| panic!("{findings}"));
    assert!(markdown(&profile).contains("| Brand \\| \\<b\\> \\[x\\] \\*y\\* |"));
}
