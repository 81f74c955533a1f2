//! A scenario file as a whole: its head, then its steps.

use std::time::Duration;

use busbar_profile::text::shown;
use busbar_profile::{DateTime, Findings, builtins};
use toml::de::{DeTable, DeValue};

use super::step::Stage;
use super::{Scenario, Step};
use crate::config::Config;
use crate::device::Device;
use crate::notes::{self, Entry, Notes, Place, entries};

const FILE: [&str; 2] = ["scenario", "steps"];
const TWICE: &str = "leave one of them; what happens twice takes two steps";
const HEAD: [&str; 8] = ["title", "about", "controller", "model", "seed", "clock", "lasts", "settings"];

const USUAL: Duration = Duration::from_secs(3600);
/// A fortnight.
const LONGEST: Duration = Duration::from_secs(14 * 86_400);
const SHORTEST: Duration = Duration::from_secs(1);

pub(super) fn scenario(file: &str, text: &str) -> Result<Scenario, Findings> {
    let scenario = notes::read(file, text, TWICE, |root, notes| read(file, root, notes))?;
    // Without a finding there is a scenario; an empty one plays to its end at once.
    Ok(scenario.unwrap_or_else(|| nothing(file)))
}

fn read(file: &str, root: &DeTable<'_>, notes: &mut Notes<'_>) -> Option<Scenario> {
    let (mut head, mut steps) = (None, None);
    for entry in entries(root) {
        match entry.key.as_str() {
            "scenario" => head = Some(entry),
            "steps" => steps = Some(entry),
            _ => notes.unknown_key(&entry, "a scenario file", &FILE),
        }
    }
    let Some(head) = head else {
        let help = "begin the file with [scenario], title = \"Mains failure\" and controller = \"datakom-d\"";
        notes.add(0..0, "there is no [scenario]", help);
        return None;
    };
    let (mut scenario, probe) = self::head(file, &head, notes)?;
    let none = |entry: &Entry<'_, '_>| entry.value.get_ref().as_array().is_some_and(|steps| steps.is_empty());
    let Some(steps) = steps.filter(|steps| !none(steps)) else {
        let help = "add [[steps]] with at = \"10s\" and what happens then, such as mains = \"failed\"";
        notes.add(head.span, "this scenario has no steps", help);
        return None;
    };
    scenario.steps = self::steps(&scenario, probe, &steps, notes);
    Some(scenario)
}

/// The head, and a device of its kind to hold the steps against.
fn head(file: &str, head: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<(Scenario, Device)> {
    let mut scenario = nothing(file);
    let (mut controller, mut model, mut settings) = (None, None, None);
    let mut titled = false;
    let Some(table) = head.value.get_ref().as_table() else {
        return notes.wrong_type(head, "[scenario] above its keys, once");
    };
    for entry in entries(table) {
        match entry.key.as_str() {
            "title" => {
                titled = true;
                scenario.title = notes.line(&entry, 100).unwrap_or_default();
            }
            "about" => scenario.about = notes.text(&entry),
            "controller" => controller = Some(entry),
            "model" => model = Some(entry),
            "seed" => scenario.seed = notes.whole(&entry).unwrap_or_default(),
            "clock" => scenario.clock = clock(&entry, notes).unwrap_or(scenario.clock),
            "lasts" => scenario.lasts = notes.duration(&entry, SHORTEST..=LONGEST).unwrap_or(USUAL),
            "settings" => settings = Some(entry),
            _ => notes.unknown_key(&entry, "[scenario]", &HEAD),
        }
    }
    if !titled {
        notes.missing(head.span.clone(), "[scenario]", "title", "\"Mains failure\"");
    }
    let Some(controller) = controller else {
        notes.missing(head.span.clone(), "[scenario]", "controller", "\"datakom-d\"");
        return None;
    };
    scenario.profile = notes.profile(&controller)?;
    scenario.place = notes.place(controller.value.span().start);
    if let Some(entry) = &model {
        scenario.model = Some(notes.text(entry)?);
    }
    let mut probe = match Device::new(&scenario.stage()) {
        Ok(probe) => probe,
        Err(error) => {
            notes.add_error(model.as_ref().unwrap_or(&controller).value.span(), &error);
            return None;
        }
    };
    for entry in settings.and_then(|settings| notes.table(&settings)).unwrap_or_default() {
        if let Some(value) = notes.setting(&mut probe, &entry) {
            scenario.settings.push((entry.key, value));
        }
    }
    Some((scenario, probe))
}

fn clock(entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<DateTime> {
    let text = match entry.value.get_ref() {
        // A date of TOML itself is as good.
        DeValue::Datetime(date) => date.to_string(),
        _ => notes.text(entry)?,
    };
    let clock = text.parse().ok();
    if clock.is_none() {
        let help = "write a local time, such as \"2026-01-05T10:00:00\"";
        notes.add(entry.value.span(), format!("`{}` is no date with a time", shown(&text)), help);
    }
    clock
}

fn steps(scenario: &Scenario, probe: Device, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Vec<Step> {
    let Some(tables) = entry.value.get_ref().as_array() else {
        notes.wrong_type::<()>(entry, "a list of tables, each headed [[steps]]");
        return Vec::new();
    };
    let mut stage = Stage::new(scenario.profile, probe, scenario.clock, scenario.lasts);
    let mut steps = Vec::new();
    for item in tables.iter() {
        if notes.is_full() {
            break;
        }
        match item.get_ref().as_table() {
            Some(table) => steps.extend(stage.step(table, item.span(), notes)),
            None => {
                let entry = Entry { key: entry.key.clone(), span: item.span(), value: item };
                notes.wrong_type::<()>(&entry, "a list of tables, each headed [[steps]]");
            }
        }
    }
    steps
}

/// A scenario before anything is known of it.
fn nothing(file: &str) -> Scenario {
    let Config { seed, epoch, .. } = Config::default();
    Scenario {
        file: file.to_owned(),
        place: Place { line: 1, column: 1 },
        title: String::new(),
        about: None,
        profile: &builtins()[0],
        model: None,
        seed,
        clock: epoch,
        settings: Vec::new(),
        lasts: USUAL,
        steps: Vec::new(),
    }
}
