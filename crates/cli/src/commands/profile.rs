//! `busbar profile`: the profiles, listed, shown, checked.

use busbar_profile::{
    OverRead, Profile, builtins,
    page::scale,
    show::{ProfileShow, ProfileSummary},
};
use serde::Serialize;

use crate::{
    args,
    failure::Failure,
    people, profiles,
    table::{Align, Cell, Table},
    terminal::{self, Style},
};

pub(crate) fn run(args: &args::Profile, json: bool) -> Result<(), Failure> {
    match args {
        args::Profile::List => list(json),
        args::Profile::Show { key } => show(key, json),
        args::Profile::Check { file } => check(file, json),
    }
}

fn list(json: bool) -> Result<(), Failure> {
    let profiles: Vec<ProfileSummary<'_>> = builtins().iter().map(ProfileSummary::new).collect();
    if json {
        return Ok(terminal::print_json(&profiles)?);
    }
    let mut table = Table::new([
        ("KEY", Align::Left),
        ("VENDOR", Align::Left),
        ("MODELS", Align::Left),
        ("KIND", Align::Left),
        ("POINTS", Align::Right),
        ("BITS", Align::Right),
        ("COILS", Align::Right),
        ("COMMANDS", Align::Right),
    ]);
    for profile in profiles {
        table.row([
            profile.key.into(),
            profile.vendor.into(),
            profile.models.join(", ").into(),
            words(profile.kind.as_str()).into(),
            profile.points.to_string().into(),
            profile.bits.to_string().into(),
            profile.coils.to_string().into(),
            profile.commands.to_string().into(),
        ]);
    }
    Ok(terminal::print(&table.render(terminal::style(), terminal::width()))?)
}

fn check(file: &std::path::Path, json: bool) -> Result<(), Failure> {
    #[derive(Serialize)]
    struct Checked<'a> {
        file: String,
        ok: bool,
        profile: Option<ProfileSummary<'a>>,
        findings: Vec<Found<'a>>,
    }
    #[derive(Serialize)]
    struct Found<'a> {
        line: usize,
        column: usize,
        message: &'a str,
        help: &'a str,
    }
    let name = file.display().to_string();
    let text = profiles::read(file, "profile file")?;
    let (profile, findings) = match Profile::parse(&name, &text) {
        Ok(profile) => (Some(profile), None),
        Err(findings) => (None, Some(findings)),
    };
    let summary = profile.as_ref().map(ProfileSummary::new);
    if json {
        let found = findings.iter().flatten().map(|finding| Found {
            line: finding.line,
            column: finding.column,
            message: &finding.message,
            help: &finding.help,
        });
        let ok = findings.is_none();
        terminal::print_json(&Checked {
            file: name.clone(),
            ok,
            profile: summary.clone(),
            findings: found.collect(),
        })?;
    } else if let Some(profile) = &summary {
        terminal::print(&format!(
            "{name}: no mistakes; profile {} with {} points, {} bits, {} coils, {} commands\n",
            profile.key, profile.points, profile.bits, profile.coils, profile.commands
        ))?;
    }
    match findings {
        Some(findings) => Err(Failure::Findings(Box::new(profiles::excerpts(&name, text, &findings)))),
        None => Ok(()),
    }
}

fn show(key: &str, json: bool) -> Result<(), Failure> {
    let profile = profiles::resolve(key)?;
    if json {
        return Ok(terminal::print_json(&ProfileShow::new(&profile))?);
    }
    let style = terminal::style();
    let text =
        [head(&profile, style), points(&profile, style), meanings(&profile, style), orders(&profile, style)];
    Ok(terminal::print(&text.join("\n"))?)
}

/// What the controller is and how it is reached.
fn head(profile: &Profile, style: Style) -> String {
    let wire = &profile.wire;
    let list = |words: Vec<String>| words.join(", ");
    let unit = match wire.unit.default {
        Some(default) => format!("{} to {}, {default} as delivered", wire.unit.min, wire.unit.max),
        None => format!("{} to {}", wire.unit.min, wire.unit.max),
    };
    let long = match wire.over_read {
        OverRead::Truncate => "longer reads are cut",
        OverRead::Refuse => "longer reads are refused",
    };
    let revision =
        profile.manual.revision.as_ref().map(|revision| format!(", {revision}")).unwrap_or_default();
    let readable = wire.readable.iter().map(|(first, last)| format!("{first}-{last}")).collect();
    let mut text = style.title(&format!("{}  {} {}", profile.key, profile.vendor, profile.models.join(", ")));
    text.push('\n');
    for (name, value) in [
        ("kind", words(profile.kind.as_str())),
        ("manual", format!("{}{revision}", profile.manual.title)),
        ("transports", list(wire.transports.iter().map(ToString::to_string).collect())),
        ("unit id", unit),
        ("functions", list(wire.functions.iter().map(u8::to_string).collect())),
        ("registers a read", format!("{} at most, {long}", wire.max_read)),
        ("word order", wire.word_order.to_string()),
        ("spacing", format!("{} ms", wire.spacing_ms)),
        ("answers after", format!("{} ms", wire.answer_delay_ms)),
        (
            "serial",
            format!(
                "{} baud, parity {}, stop bits {}",
                list(wire.serial.baud.iter().map(u32::to_string).collect()),
                list(wire.serial.parity.iter().map(ToString::to_string).collect()),
                list(wire.serial.stop.iter().map(u8::to_string).collect())
            ),
        ),
        ("readable", list(readable)),
    ] {
        text.push_str(&format!("  {name:<16}  {value}\n"));
    }
    text
}

/// Every point under the title of its group.
fn points(profile: &Profile, style: Style) -> String {
    let mut table = Table::new([
        ("ADDRESS", Align::Right),
        ("4XXXX", Align::Right),
        ("NAME", Align::Left),
        ("TYPE", Align::Left),
        ("SCALE", Align::Left),
        ("UNIT", Align::Left),
        ("ACCESS", Align::Left),
        ("POINT", Align::Left),
    ])
    .optional(&["4XXXX", "ACCESS", "NAME"]);
    for group in &profile.groups {
        table.title(group.title.as_str());
        for point in group.points.iter().filter_map(|index| profile.points.get(*index)) {
            let doubt = if point.doubt.is_some() { " ?" } else { "" };
            table.row([
                point.address.to_string().into(),
                Cell::dim(point.plc_number().to_string()),
                format!("{}{doubt}", point.name).into(),
                point.data_type.to_string().into(),
                point.scale.map(scale).unwrap_or_default().into(),
                point.unit.as_deref().map(people::unit).unwrap_or_default().into(),
                point.access.to_string().into(),
                Cell::dim(point.id.as_str()),
            ]);
        }
    }
    let doubts: Vec<&str> =
        profile.points.iter().filter(|point| point.doubt.is_some()).map(|point| point.id.as_str()).collect();
    let note =
        if doubts.is_empty() { "" } else { "\n?  the manual leaves something open here; --json says what\n" };
    table.render(style, terminal::width()) + note
}

/// Codes or bits with their labels, and the points that share them.
struct Meanings<'a> {
    labels: Vec<(String, &'a str)>,
    points: Vec<&'a str>,
}

/// Codes and bits, one list for all points that share it.
fn meanings(profile: &Profile, style: Style) -> String {
    let mut lists: Vec<Meanings<'_>> = Vec::new();
    for point in &profile.points {
        let choices = point.choices.iter().map(|choice| (choice.value.to_string(), choice.label.as_str()));
        let bits = point.bits.iter().map(|bit| (format!("bit {}", bit.bit), bit.label.as_str()));
        let labels: Vec<(String, &str)> = choices.chain(bits).collect();
        if labels.is_empty() {
            continue;
        }
        match lists.iter_mut().find(|list| list.labels == labels) {
            Some(list) => list.points.push(&point.id),
            None => lists.push(Meanings { labels, points: vec![&point.id] }),
        }
    }
    let mut text = String::new();
    for Meanings { labels, points } in lists {
        if !text.is_empty() {
            text.push('\n');
        }
        text.push_str(&style.title(&points.join(", ")));
        text.push('\n');
        for (code, label) in labels {
            text.push_str(&format!("  {code:>7}  {label}\n"));
        }
    }
    text
}

/// Coils and commands.
fn orders(profile: &Profile, style: Style) -> String {
    let mut text = String::new();
    if !profile.coils.is_empty() {
        let mut table = Table::new([("COIL", Align::Right), ("NAME", Align::Left), ("ID", Align::Left)]);
        for coil in &profile.coils {
            table.row([
                coil.address.to_string().into(),
                coil.name.as_str().into(),
                Cell::dim(coil.id.as_str()),
            ]);
        }
        text.push_str(&table.render(style, terminal::width()));
        text.push('\n');
    }
    if !profile.commands.is_empty() {
        let mut table =
            Table::new([("COMMAND", Align::Left), ("NAME", Align::Left), ("ARGUMENTS", Align::Left)]);
        for command in ProfileShow::new(profile).commands {
            let arguments: Vec<String> = command
                .args
                .iter()
                .map(|arg| match (arg.min, arg.max) {
                    (Some(min), Some(max)) => format!("{}={min}..{max}", arg.name),
                    _ => format!("{}={}", arg.name, arg.choices.join("|")),
                })
                .collect();
            table.row([command.id.into(), command.name.into(), arguments.join(" ").into()]);
        }
        text.push_str(&table.render(style, terminal::width()));
    }
    text
}

/// A word of a closed list, for people.
fn words(word: &str) -> String {
    word.replace('_', " ")
}
