//! A fleet file: wires, controllers, and what joins their plants.

use std::ops::Range;

use busbar_link::Endpoint;
use busbar_profile::{Findings, nearest};
use toml::de::DeTable;

use super::{Fleet, Joint, Member};
use crate::config::Config;
use crate::device::Device;
use crate::notes::{self, Entry, Notes, entries};
use crate::server::NEW_PTY;
use busbar_profile::text::shown;

const FILE: [&str; 5] = ["fleet", "wires", "controllers", "supplies", "bus_bars"];
const WIRE: [&str; 2] = ["id", "endpoint"];
const CONTROLLER: [&str; 9] =
    ["id", "name", "profile", "model", "wire", "unit", "seed", "settings", "levers"];
const SUPPLY: [&str; 3] = ["from", "section", "to"];

/// Controllers that a file can have.
const MOST: usize = 100;

pub(super) fn fleet(file: &str, text: &str) -> Result<Fleet, Findings> {
    let fleet = notes::read(file, text, "leave one of them out", read)?;
    // Without a finding there is a fleet.
    Ok(fleet.unwrap_or_else(|| Fleet {
        title: String::new(),
        wires: Vec::new(),
        members: Vec::new(),
        joints: Vec::new(),
    }))
}

/// What is known so far.
#[derive(Default)]
struct Draft {
    wires: Vec<Line>,
    members: Vec<(Member, Device)>,
    joints: Vec<Joint>,
    /// Ids of wires and of controllers that are there, sound or not: what is wrong with them is said where they stand.
    wires_there: Vec<String>,
    members_there: Vec<String>,
    /// Ids of wires on which somebody wants to be.
    wanted: Vec<String>,
    /// There were too many controllers, and it has been said.
    is_full: bool,
}

/// A wire that is sound, and where it stands.
struct Line {
    id: String,
    endpoint: Endpoint,
    span: Range<usize>,
}

fn read(root: &DeTable<'_>, notes: &mut Notes<'_>) -> Option<Fleet> {
    let mut title = None;
    let mut draft = Draft::default();
    let all = entries(root);
    for entry in &all {
        match entry.key.as_str() {
            "fleet" => title = head(entry, notes),
            key if FILE.contains(&key) => {}
            _ => notes.unknown_key(entry, "a fleet file", &FILE),
        }
    }
    // In this order, for each names what those before it are.
    for key in &FILE[1..] {
        let found = all.iter().find(|entry| entry.key == *key);
        for (table, span) in found.map(|entry| notes.tables(entry)).unwrap_or_default() {
            match *key {
                "wires" => draft.wire(table, span, notes),
                "controllers" => draft.controller(table, span, notes),
                "supplies" => draft.supply(table, span, notes),
                _ => draft.bus_bar(table, span, notes),
            };
        }
    }
    if draft.members.is_empty() && !all.iter().any(|entry| entry.key == "controllers") {
        notes.add(0..0, "there are no controllers", "add [[controllers]] with id, profile and wire");
    }
    if !all.iter().any(|entry| entry.key == "fleet") {
        notes.add(0..0, "there is no [fleet]", "begin the file with [fleet] and title = \"Two gensets\"");
    }
    draft.empty_wires(notes);
    let wires = draft.wires.into_iter().map(|wire| wire.endpoint).collect();
    let members = draft.members.into_iter().map(|(member, _)| member).collect();
    Some(Fleet { title: title?, wires, members, joints: draft.joints })
}

fn head(entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<String> {
    let mut title = None;
    let mut titled = false;
    for inner in notes.table(entry)? {
        match inner.key.as_str() {
            "title" => {
                titled = true;
                title = notes.line(&inner, 100);
            }
            _ => notes.unknown_key(&inner, "[fleet]", &["title"]),
        }
    }
    if !titled {
        notes.missing(entry.span.clone(), "[fleet]", "title", "\"Two gensets\"");
    }
    title
}

impl Draft {
    fn wire(&mut self, table: &DeTable<'_>, span: Range<usize>, notes: &mut Notes<'_>) -> Option<()> {
        let (mut id, mut endpoint) = (None, None);
        for entry in entries(table) {
            match entry.key.as_str() {
                "id" => {
                    let text = entry.value.get_ref().as_str();
                    self.wires_there.extend(text.map(str::to_owned));
                    let known = self.wires.iter().any(|known| Some(known.id.as_str()) == text);
                    id = Some(new_id(&entry, known, notes));
                }
                "endpoint" => endpoint = Some(self.endpoint(&entry, notes)),
                _ => notes.unknown_key(&entry, "[[wires]]", &WIRE),
            }
        }
        for (key, there, example) in
            [("id", id.is_some(), "\"line\""), ("endpoint", endpoint.is_some(), "\"tcp://127.0.0.1:1502\"")]
        {
            if !there {
                notes.missing(span.clone(), "[[wires]]", key, example);
            }
        }
        self.wires.push(Line { id: id??, endpoint: endpoint??, span });
        Some(())
    }

    fn endpoint(&self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<Endpoint> {
        let endpoint: Endpoint = match notes.text(entry)?.parse() {
            Ok(endpoint) => endpoint,
            Err(error) => {
                notes.add_error(entry.value.span(), &error);
                return None;
            }
        };
        let place = place(&endpoint);
        if place.is_some() && self.wires.iter().any(|wire| self::place(&wire.endpoint) == place) {
            let help = "give each wire an endpoint of its own, or put its controllers on the other wire";
            notes.add(entry.value.span(), "another wire has this endpoint", help);
        }
        Some(endpoint)
    }

    fn empty_wires(&self, notes: &mut Notes<'_>) {
        let empty = |wire: &&Line| !self.wanted.contains(&wire.id);
        for wire in self.wires.iter().filter(empty).filter(|_| !self.wanted.is_empty()) {
            let help = "put a controller on it, or leave it out";
            notes.add(wire.span.clone(), format!("nobody is on wire `{}`", wire.id), help);
        }
    }

    fn controller(&mut self, table: &DeTable<'_>, span: Range<usize>, notes: &mut Notes<'_>) -> Option<()> {
        let all = entries(table);
        let of = |key: &str| all.iter().find(|entry| entry.key == key);
        for entry in all.iter().filter(|entry| !CONTROLLER.contains(&entry.key.as_str())) {
            notes.unknown_key(entry, "[[controllers]]", &CONTROLLER);
        }
        for (key, example) in [("id", "\"genset-1\""), ("profile", "\"datakom-d\""), ("wire", "\"line\"")] {
            if of(key).is_none() {
                notes.missing(span.clone(), "[[controllers]]", key, example);
            }
        }
        let id = of("id").and_then(|entry| entry.value.get_ref().as_str());
        self.members_there.extend(id.map(str::to_owned));
        if self.members.len() == MOST {
            if !self.is_full {
                let message = format!("these are more than {MOST} controllers");
                notes.add(span, message, "make two fleets of them");
            }
            self.is_full = true;
            return None;
        }
        let id = of("id").and_then(|entry| {
            let text = entry.value.get_ref().as_str();
            let known = self.members.iter().any(|(member, _)| Some(member.id.as_str()) == text);
            new_id(entry, known, notes)
        });
        let name = of("name").map(|entry| notes.line(entry, 100));
        let wire = of("wire").and_then(|entry| self.wire_of(entry, notes));
        let (mut config, mut probe) = self.config(&all, notes)?;
        config.pins = settings(of("settings"), &mut probe, notes);
        let levers = levers(of("levers"), &mut probe, notes);
        let (id, wire) = (id?, wire?);
        if self.members.iter().any(|(other, _)| (other.wire, other.config.unit) == (wire, config.unit)) {
            let place = of("unit").map_or(span, |entry| entry.value.span());
            let message = format!("unit {} is there twice on this wire", config.unit);
            notes.add(place, message, "give each controller of a wire a unit id of its own");
        }
        let name = name.unwrap_or_else(|| Some(id.clone()))?;
        self.members.push((Member { id, name, wire, levers, config }, probe));
        Some(())
    }

    /// What the controller is, and one of its kind to hold the rest against.
    fn config(&self, all: &[Entry<'_, '_>], notes: &mut Notes<'_>) -> Option<(Config, Device)> {
        let of = |key: &str| all.iter().find(|entry| entry.key == key);
        let profile = notes.profile(of("profile")?)?;
        let default = profile.wire.unit.default.unwrap_or(1);
        let unit = match of("unit") {
            Some(entry) => {
                let (number, range) = (notes.whole(entry)?, &profile.wire.unit);
                let unit = u8::try_from(number).ok().filter(|unit| (range.min..=range.max).contains(unit));
                if unit.is_none() {
                    let help = format!("write a number from {} to {}", range.min, range.max);
                    notes.add(entry.value.span(), format!("unit {number} is not possible"), help);
                }
                unit?
            }
            None => default,
        };
        // By itself each is another machine.
        let seed = of("seed").map_or(Some(1 + self.members.len() as u64), |entry| notes.whole(entry))?;
        let model = match of("model") {
            Some(entry) => Some(notes.text(entry)?),
            None => None,
        };
        let config = Config { profile: profile.key.clone(), unit, model, seed, ..Config::default() };
        match Device::new(&config) {
            Ok(probe) => Some((config, probe)),
            Err(error) => {
                notes.add_error(of("model").or(of("profile"))?.value.span(), &error);
                None
            }
        }
    }

    fn wire_of(&mut self, entry: &Entry<'_, '_>, notes: &mut Notes<'_>) -> Option<usize> {
        let text = notes.text(entry)?;
        let place = self.wires.iter().position(|wire| wire.id == text);
        if !self.wires_there.contains(&text) {
            unknown("wire", &text, entry.value.span(), self.wires.iter().map(|wire| wire.id.as_str()), notes);
        }
        self.wanted.push(text);
        place
    }

    /// The index of a controller that a text names.
    fn member(&self, text: &str, span: Range<usize>, notes: &mut Notes<'_>) -> Option<usize> {
        let place = self.members.iter().position(|(member, _)| member.id == text);
        if !self.members_there.iter().any(|id| id == text) {
            unknown(
                "controller",
                text,
                span,
                self.members.iter().map(|(member, _)| member.id.as_str()),
                notes,
            );
        }
        place
    }

    fn supply(&mut self, table: &DeTable<'_>, span: Range<usize>, notes: &mut Notes<'_>) -> Option<()> {
        let all = entries(table);
        let of = |key: &str| all.iter().find(|entry| entry.key == key);
        for entry in all.iter().filter(|entry| !SUPPLY.contains(&entry.key.as_str())) {
            notes.unknown_key(entry, "[[supplies]]", &SUPPLY);
        }
        for (key, example) in [("from", "\"switch-1\""), ("section", "1"), ("to", "\"genset-1\"")] {
            if of(key).is_none() {
                notes.missing(span.clone(), "[[supplies]]", key, example);
            }
        }
        let (from, section, to) = (of("from")?, of("section")?, of("to")?);
        let (from_id, to_id) = (notes.text(from)?, notes.text(to)?);
        let number = notes.whole(section)?;
        let switch = self.member(&from_id, from.value.span(), notes)?;
        let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        if self.members[switch].1.section(0).is_none() {
            let message = format!("`{}` has no bus sections", shown(&from_id));
            notes.add(from.value.span(), message, "name a transfer switch");
        } else if index.is_none_or(|index| self.members[switch].1.section(index).is_none()) {
            let message = format!("`{}` has no section {number}", shown(&from_id));
            notes.add(section.value.span(), message, "write 1 or 2");
        }
        let genset = self.genset(&to_id, to.value.span(), notes)?;
        if self.joints.iter().any(|joint| matches!(joint, Joint::Supply { to, .. } if *to == genset)) {
            let message = format!("`{}` is supplied twice", shown(&to_id));
            notes.add(to.value.span(), message, "leave one of the two out: it has one mains");
        }
        self.joints.push(Joint::Supply { from: switch, section: index?, to: genset });
        Some(())
    }

    fn bus_bar(&mut self, table: &DeTable<'_>, span: Range<usize>, notes: &mut Notes<'_>) -> Option<()> {
        let mut listed = None;
        for entry in entries(table) {
            match entry.key.as_str() {
                "gensets" => {
                    let value = entry.value.get_ref();
                    let is_short =
                        value.as_str().is_some() || value.as_array().is_some_and(|list| list.len() < 2);
                    listed = Some((notes.texts(&entry), is_short));
                }
                _ => notes.unknown_key(&entry, "[[bus_bars]]", &["gensets"]),
            }
        }
        let Some((listed, is_short)) = listed else {
            notes.missing(span, "[[bus_bars]]", "gensets", "[\"genset-1\", \"genset-2\"]");
            return None;
        };
        if is_short {
            notes.add(span, "a bus bar needs two gensets to share", "name two or more in `gensets`");
        }
        let mut gensets = Vec::new();
        for (text, place) in listed {
            let Some(genset) = self.genset(&text, place.clone(), notes) else { continue };
            let elsewhere =
                |joint: &Joint| matches!(joint, Joint::BusBar { gensets } if gensets.contains(&genset));
            if gensets.contains(&genset) || self.joints.iter().any(elsewhere) {
                let message = format!("`{}` is on a bus bar already", shown(&text));
                notes.add(place, message, "name each genset once");
            }
            gensets.push(genset);
        }
        self.joints.push(Joint::BusBar { gensets });
        Some(())
    }

    /// The index of a genset that a text names.
    fn genset(&mut self, text: &str, span: Range<usize>, notes: &mut Notes<'_>) -> Option<usize> {
        let index = self.member(text, span.clone(), notes)?;
        let is_genset = self.members[index].1.genset().is_some();
        if !is_genset {
            notes.add(span, format!("`{}` is no genset", shown(text)), "name a genset's controller");
        }
        is_genset.then_some(index)
    }
}

fn settings(
    entry: Option<&Entry<'_, '_>>,
    probe: &mut Device,
    notes: &mut Notes<'_>,
) -> Vec<(String, String)> {
    let all = entry.and_then(|entry| notes.table(entry)).unwrap_or_default();
    all.into_iter().filter_map(|entry| Some((entry.key.clone(), notes.setting(probe, &entry)?))).collect()
}

fn levers(entry: Option<&Entry<'_, '_>>, probe: &mut Device, notes: &mut Notes<'_>) -> Vec<(String, String)> {
    let Some(entry) = entry else { return Vec::new() };
    let Some(table) = entry.value.get_ref().as_table() else {
        notes.wrong_type::<()>(entry, "a table, such as { load = 40 }");
        return Vec::new();
    };
    let mut levers = Vec::new();
    for lever in notes::flat(table, &[]) {
        let Some(position) = notes.plain(&lever) else { continue };
        match probe.pull(&lever.key, &position) {
            Ok(()) => levers.push((lever.key, position)),
            Err(error) => notes.add_error(lever.span.clone(), &error),
        }
    }
    levers
}

/// An id that nothing else of its kind has.
fn new_id(entry: &Entry<'_, '_>, known: bool, notes: &mut Notes<'_>) -> Option<String> {
    let id = notes.text(entry)?;
    let lawful = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_');
    if !(1..=64).contains(&id.len()) || !id.chars().all(lawful) {
        let help = "write 1 to 64 lower-case letters, digits, - and _, such as genset-1";
        notes.add(entry.value.span(), format!("`{}` is no id", shown(&id)), help);
        return None;
    }
    if known {
        notes.add(entry.value.span(), format!("the id `{id}` is there twice"), "give each an id of its own");
    }
    Some(id)
}

/// What of an endpoint only one wire can have; none where the system chooses it.
fn place(endpoint: &Endpoint) -> Option<String> {
    match endpoint {
        Endpoint::Tcp { host, port } | Endpoint::RtuTcp { host, port } => {
            (*port != 0).then(|| format!("{host}:{port}"))
        }
        Endpoint::Rtu { path, .. } => (path != NEW_PTY).then(|| path.clone()),
        _ => None,
    }
}

fn unknown<'k>(
    kind: &str,
    text: &str,
    span: Range<usize>,
    known: impl Iterator<Item = &'k str> + Clone,
    notes: &mut Notes<'_>,
) {
    let help = match nearest(text, known.clone()) {
        Some(known) => format!("did you mean `{known}`?"),
        None if known.clone().next().is_none() => format!("add [[{kind}s]] with this id"),
        None => format!("there is: {}", known.collect::<Vec<_>>().join(", ")),
    };
    notes.add(span, format!("there is no {kind} `{}`", shown(text)), help);
}
