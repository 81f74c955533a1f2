//! `docs/adding-a-controller.md`, followed to the letter: its files written, its commands run, its output compared.

use std::{fs, path::Path, process::Output};

use busbar_profile::Number;
use serde_json::Value;

use crate::support::{call, command};

const GUIDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/adding-a-controller.md");

/// `UPDATE=1 cargo test -p busbar guide` writes what the commands print into the page.
#[test]
fn the_guide_can_be_followed_to_the_letter() {
    let folder = tempfile::tempdir().unwrap();
    let guide = fs::read_to_string(GUIDE).unwrap();
    let followed = follow(&guide, folder.path());
    if std::env::var_os("UPDATE").is_some() {
        fs::write(GUIDE, &followed).unwrap();
    }
    let guide = fs::read_to_string(GUIDE).unwrap();
    let line = guide.lines().zip(followed.lines()).position(|(guide, followed)| guide != followed);
    assert!(
        guide == followed,
        "docs/adding-a-controller.md is wrong in line {}; this is what happens:\n{followed}",
        line.unwrap_or_default() + 1
    );
    golden_cases_hold(folder.path());
}

/// The page as it must read: every file block is written, every command is run in `folder`.
fn follow(guide: &str, folder: &Path) -> String {
    let mut followed = String::new();
    let mut lines = guide.lines();
    let mut done = 0;
    while let Some(line) = lines.next() {
        followed.push_str(line);
        followed.push('\n');
        let Some(info) = line.strip_prefix("```") else { continue };
        let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
        let words: Vec<&str> = info.split_whitespace().collect();
        match words.as_slice() {
            ["console", rest @ ..] => followed.push_str(&run(&block, rest == ["fails"], folder)),
            [language, rest @ ..] => {
                match (*language, rest) {
                    ("toml", [file]) => append(&folder.join(file), &block),
                    ("diff", [file]) => change(&folder.join(file), &block),
                    ("rust" | "sh", []) => {}
                    _ => panic!("what is to be done with ```{info}?"),
                }
                for line in block {
                    followed.push_str(line);
                    followed.push('\n');
                }
            }
            [] => panic!("a block without a language"),
        }
        followed.push_str("```\n");
        done += 1;
    }
    assert!(done > 10, "the page has but {done} blocks");
    followed
}

/// Makes the file, or adds to its end behind an empty line.
fn append(file: &Path, block: &[&str]) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    let before = fs::read_to_string(file).map(|text| text + "\n").unwrap_or_default();
    fs::write(file, before + &block.join("\n") + "\n").unwrap();
}

/// Puts the lines with a plus in place of the lines with a minus, which must stand there once.
fn change(file: &Path, block: &[&str]) {
    let side = |sign| {
        let lines: Vec<&str> = block.iter().filter_map(|line| line.strip_prefix(sign)).collect();
        lines.join("\n") + "\n"
    };
    let text = fs::read_to_string(file).unwrap();
    assert_eq!(text.matches(&side('-')).count(), 1, "{block:?}");
    fs::write(file, text.replace(&side('-'), &side('+'))).unwrap();
}

/// The block with what the commands in it print, each behind an empty line but the first.
fn run(block: &[&str], fails: bool, folder: &Path) -> String {
    let mut printed = String::new();
    for line in block.iter().filter_map(|line| line.strip_prefix("$ ")) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let ["busbar", arguments @ ..] = words.as_slice() else { panic!("{line} is no call of busbar") };
        let Output { status, stdout, stderr } =
            command().args(arguments).current_dir(folder).output().unwrap();
        let text = String::from_utf8(stdout).unwrap() + &String::from_utf8(stderr).unwrap();
        assert_eq!(status.success(), !fails, "{line}\n{text}");
        if !printed.is_empty() {
            printed.push('\n');
        }
        printed.push_str(&format!("$ {line}\n{text}"));
    }
    printed
}

/// What `golden.toml` expects is what `busbar decode` prints.
fn golden_cases_hold(folder: &Path) {
    let profile = folder.join("pond-p1/profile.toml").display().to_string();
    let golden: toml::Table =
        fs::read_to_string(folder.join("pond-p1/golden.toml")).unwrap().parse().unwrap();
    let cases = golden["case"].as_array().unwrap();
    assert!(cases.len() >= 5);
    for case in cases {
        let registers = case["registers"].as_array().unwrap();
        let registers = registers.iter().map(|register| format!("{:04X}", register.as_integer().unwrap()));
        let mut arguments = vec!["decode".to_owned(), profile.clone(), case["address"].to_string()];
        arguments.extend(registers.chain(["--json".to_owned()]));
        let readings = call(&arguments).ok().silently().json();
        let reading =
            |id: &str| readings.as_array().unwrap().iter().find(|reading| reading["id"] == id).unwrap();
        let table = |key: &str| case.get(key).and_then(toml::Value::as_table).cloned().unwrap_or_default();
        for (key, name) in [("expect", "value"), ("code", "code"), ("set", "set")] {
            for (id, expected) in table(key) {
                let got = &reading(&id)[name];
                assert!(same(got, &expected), "{}: {id} is {got}, not {expected}", case["name"]);
            }
        }
        for id in case.get("invalid").and_then(toml::Value::as_array).into_iter().flatten() {
            assert_eq!(reading(id.as_str().unwrap())["quality"], "invalid", "{}", case["name"]);
        }
    }
}

/// Numbers by value, everything else literally.
fn same(got: &Value, expected: &toml::Value) -> bool {
    let number = |text: String| text.parse::<Number>().ok();
    match (got, expected) {
        (Value::Number(got), toml::Value::Integer(_) | toml::Value::Float(_)) => {
            number(got.to_string()) == number(expected.to_string())
        }
        (Value::String(got), toml::Value::String(expected)) => got == expected,
        (Value::Array(got), toml::Value::Array(expected)) => {
            got.len() == expected.len() && got.iter().zip(expected).all(|(got, expected)| same(got, expected))
        }
        _ => false,
    }
}

/// The line for `builtin.rs` has the form that those of the built-in profiles have.
#[test]
fn the_line_for_the_built_in_profiles_is_the_one_they_have() {
    let guide = fs::read_to_string(GUIDE).unwrap();
    let line = guide.lines().find(|line| line.contains("include_str!")).unwrap();
    let source = include_str!("../../../profile/src/builtin.rs");
    // A long entry stands on several lines, with a comma behind its last part.
    let bare = |text: &str| text.split_whitespace().collect::<String>().replace(",)", ")");
    for profile in busbar_profile::builtins() {
        let own = line.replace("pond-p1", &profile.key);
        assert!(bare(source).contains(&bare(&own)), "builtin.rs has no {own}");
    }
}
