//! The connections of a diagram.

use std::collections::{HashMap, HashSet};

use busbar_profile::Collector;
use busbar_profile::text::shown;
use busbar_profile::vocabulary::vocabulary;

use super::super::reader::{At, Table};
use super::super::words::{listed, meant, remedy};
use super::super::{keys, profiles};
use super::nodes::Nodes;
use super::{Connection, Defined, Named};

/// The connections of the file.
#[derive(Default)]
pub(super) struct Connections {
    pub(super) connections: Vec<Connection>,
    /// Ids of the nodes that they lead to.
    pub(super) ends: HashSet<String>,
}

pub(super) fn read(
    root: &Table<'_, '_>,
    devices: &Defined,
    nodes: &Nodes,
    findings: &mut Collector<'_>,
    warnings: &mut Collector<'_>,
) -> Connections {
    let mut read = Connections::default();
    let mut seen = HashSet::new();
    let mut breakers: HashMap<(String, String), (String, String)> = HashMap::new();
    for table in root.tables("connections", "[[connections]]", keys::CONNECTION, findings) {
        let from = table
            .required("from", "\"mains\"", findings, |table, key, findings| end(table, key, nodes, findings));
        let to = table
            .required("to", "\"bus\"", findings, |table, key, findings| end(table, key, nodes, findings));
        let device = super::device(&table, devices, findings);
        let breaker = breaker(&table, device.as_ref(), findings, warnings);

        read.ends.extend(from.iter().chain(&to).map(|end| end.value.clone()));
        let (Some(from), Some(to)) = (from, to) else { continue };
        if from.value == to.value {
            findings.add(
                to.span,
                format!("`{}` is connected to itself", to.value),
                "write the node at the other end of the line",
            );
            continue;
        }
        let (one, other) =
            (from.value.clone().min(to.value.clone()), from.value.clone().max(to.value.clone()));
        let position = device.as_ref().map(|device| device.id.value.clone()).zip(breaker.as_ref());
        let position = position.map(|(device, breaker)| (device, breaker.value.clone()));
        if !seen.insert((one, other, position.clone())) {
            findings.add(
                to.span,
                format!("`{}` and `{}` are connected already", from.value, to.value),
                "leave one of the two connections out",
            );
            continue;
        }
        if let (Some(position), Some(breaker)) = (position, &breaker) {
            let here = (from.value.clone(), to.value.clone());
            if let Some((from, to)) = breakers.get(&position) {
                warnings.add(
                    breaker.span.clone(),
                    format!("{} of {} stands between `{from}` and `{to}` already", position.1, position.0),
                    "name the breaker in one connection alone: it is in one place",
                );
            } else {
                breakers.insert(position, here);
            }
        }
        read.connections.push(Connection {
            from: from.value,
            to: to.value,
            device: device.map(|device| device.id.value),
            breaker: breaker.map(|breaker| breaker.value),
        });
    }
    read
}

/// The node at one end.
fn end(table: &Table<'_, '_>, key: &str, nodes: &Nodes, findings: &mut Collector<'_>) -> Option<At<String>> {
    let text = table.string(key, findings)?;
    if nodes.defined.contains_key(&text.value) {
        return Some(text);
    }
    let known = nodes.defined.keys().map(String::as_str);
    let named = shown(&text.value);
    let help = match (nodes.defined.is_empty(), meant(&text.value, known.clone())) {
        (true, _) => format!("define it: [[nodes]] with id = \"{named}\" and its kind"),
        (_, Some(known)) => format!("write `{known}` if you mean that, or define it with [[nodes]]"),
        _ => format!("write one of: {}; or define it with [[nodes]]", listed(known)),
    };
    findings.add(text.span, format!("the node `{named}` is not defined"), help);
    None
}

/// The signal that tells the position of the breaker in the line.
fn breaker(
    table: &Table<'_, '_>,
    device: Option<&Named>,
    findings: &mut Collector<'_>,
    warnings: &mut Collector<'_>,
) -> Option<At<String>> {
    let text = table.string("breaker", findings);
    let Some(device) = device else {
        // A device that does not exist has been reported already.
        if let Some(text) = text.filter(|_| !table.has("device")) {
            findings.add(
                text.span,
                "`breaker` needs a device that reports it",
                "add `device`, or leave `breaker` out",
            );
        }
        return None;
    };
    let Some(text) = text else {
        if !table.has("breaker") {
            warnings.add(
                device.id.span.clone(),
                "`device` stands here without a breaker, so the line shows no position",
                "add `breaker`, or leave `device` out",
            );
        }
        return None;
    };
    let profile = device.profile?;
    let breakers = profiles::breakers(profile);
    if breakers.contains(text.value.as_str()) {
        return Some(text);
    }
    let help = match breakers.is_empty() {
        true => "leave `device` and `breaker` out: this controller reports no breaker".to_owned(),
        // A breaker of other controllers is no slip, and another breaker than it is not meant.
        false if vocabulary().signal(&text.value).is_some() => {
            format!("write one of: {}", listed(breakers.iter().copied()))
        }
        false => remedy(&text.value, breakers.iter().copied()),
    };
    findings.add(
        text.span,
        format!("{} ({}) reports no `{}`", device.id.value, profile.key, shown(&text.value)),
        help,
    );
    None
}
