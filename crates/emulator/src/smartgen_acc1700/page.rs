//! The page about this imitation, `docs/imitation/smartgen-acc1700.md`, held against the code.

use std::path::Path;

use busbar_profile::{Profile, Setting};

use super::PROFILE;
use super::levers::LEVERS;
use super::sequence::{Cause, Status, TRANSITIONS};
use super::setup::Setup;

const DIAGRAM: [&str; 2] = ["```mermaid\n", "```\n"];
const LEVERS_LIST: [&str; 2] = ["<!-- levers -->\n", "<!-- end of levers -->\n"];
const SETTINGS: [&str; 2] = ["<!-- settings -->\n", "<!-- end of settings -->\n"];

/// Statuses in the order of their codes, and the ways between them.
fn diagram(profile: &Profile) -> String {
    let point = profile.point("engine_running_status").unwrap();
    let setup = Setup::with(&[]);
    let mut lines = vec!["stateDiagram-v2".to_owned(), "    [*] --> standby".to_owned()];
    let id = |status: Status| point.choice(status as u32).unwrap().id.as_str();
    for status in statuses() {
        let delay = setup.delay(status).as_secs();
        let delay = if delay == 0 { String::new() } else { format!(", {delay} s") };
        let label = &point.choice(status as u32).unwrap().label;
        lines.push(format!("    state \"{} {label}{delay}\" as {}", status as u8, id(status)));
    }
    for (from, cause, to) in TRANSITIONS {
        lines.push(format!("    {} --> {}: {}", id(*from), id(*to), words(*cause)));
    }
    lines.join("\n") + "\n"
}

fn statuses() -> Vec<Status> {
    let mut statuses: Vec<_> = TRANSITIONS.iter().map(|(from, _, _)| *from).collect();
    statuses.dedup();
    statuses
}

fn words(cause: Cause) -> &'static str {
    match cause {
        Cause::StartKey => "start key",
        Cause::StopKey => "stop key",
        Cause::LoadKey => "load key",
        Cause::Shutdown => "shutdown",
        Cause::DelayOver => "delay over",
        Cause::EngineRuns => "engine runs",
        Cause::AttemptsOver => "attempts used up",
        Cause::EngineStands => "engine stands",
    }
}

/// A row a lever.
fn levers() -> String {
    let mut lines = vec!["| lever | what it is | positions |".to_owned(), "| --- | --- | --- |".to_owned()];
    for lever in LEVERS.iter() {
        let words = lever.words.iter().map(|word| format!("`{}`", word.id));
        let numbers = lever.numbers.map(|numbers| {
            format!("{} to {} {}", numbers.min, numbers.max, numbers.unit).trim_end().to_owned()
        });
        let positions: Vec<_> = words.chain(numbers).collect();
        lines.push(format!("| `{}` | {} | {} |", lever.id, lever.name, positions.join(", ")));
    }
    lines.join("\n") + "\n"
}

/// A row a setting; those that are there once a number are one.
fn settings(profile: &Profile) -> String {
    let mut rows: Vec<(String, &Setting, Vec<String>)> = Vec::new();
    for setting in &profile.settings {
        let (id, value) = (numberless(&setting.id), setting.value.to_string());
        match rows.iter_mut().find(|(known, _, _)| *known == id) {
            Some((_, _, values)) => values.push(value),
            None => rows.push((id, setting, vec![value])),
        }
    }
    let mut lines = vec![
        "| setting | what it is | value | from | to | unit |".to_owned(),
        "| --- | --- | --- | --- | --- | --- |".to_owned(),
    ];
    for (id, setting, values) in rows {
        let numbers = if values.len() > 1 { format!(", N 1 to {}", values.len()) } else { String::new() };
        lines.push(format!(
            "| `{id}`{numbers} | {} | {} | {} | {} | {} |",
            // The number behind what it is about, not a code.
            if values.len() > 1 { setting.name.replacen(" 1", " N", 1) } else { setting.name.clone() },
            values.join(", "),
            setting.min,
            setting.max,
            setting.unit.as_deref().unwrap_or_default(),
        ));
    }
    lines.join("\n") + "\n"
}

/// `input_3_delay` as `input_N_delay`.
fn numberless(id: &str) -> String {
    let parts = id.split('_').map(|part| if part.parse::<u8>().is_ok() { "N" } else { part });
    parts.collect::<Vec<_>>().join("_")
}

/// Puts a text between two marks.
fn replaced(page: &str, [begin, end]: [&str; 2], text: &str) -> String {
    let (before, rest) = page.split_once(begin).unwrap_or_else(|| panic!("the page has no {begin}"));
    let (_, after) = rest.split_once(end).unwrap_or_else(|| panic!("the page has no {end} behind {begin}"));
    format!("{before}{begin}{text}{end}{after}")
}

#[test]
fn the_page_draws_the_table_of_transitions_and_lists_levers_and_settings() {
    let profile = busbar_profile::builtin(PROFILE).unwrap();
    assert_eq!(statuses().len(), 16);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/imitation/smartgen-acc1700.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let wanted = replaced(&page, DIAGRAM, &diagram(profile));
    let wanted = replaced(&wanted, LEVERS_LIST, &levers());
    let wanted = replaced(&wanted, SETTINGS, &settings(profile));
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, wanted).unwrap();
        return;
    }
    assert!(
        page == wanted,
        "docs/imitation/smartgen-acc1700.md has drifted from the code: \
         UPDATE=1 cargo test -p busbar-emulator the_page_draws"
    );
}
