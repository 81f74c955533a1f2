//! The nodes of a diagram.

use std::collections::BTreeMap;
use std::ops::Range;

use busbar_profile::Collector;
use busbar_profile::text::shown;

use super::super::reader::Table;
use super::super::words::{listed, remedy};
use super::super::{keys, profiles, text};
use super::{Defined, Named, Node, NodeKind};

/// The nodes of the file, and how to find them.
#[derive(Default)]
pub(super) struct Nodes {
    pub(super) nodes: Vec<Node>,
    /// Where the ids stand in the text, those of nodes of which something else is wrong too.
    pub(super) defined: BTreeMap<String, Range<usize>>,
}

pub(super) fn read(root: &Table<'_, '_>, devices: &Defined, findings: &mut Collector<'_>) -> Nodes {
    let mut nodes = Nodes::default();
    for table in root.tables("nodes", "[[nodes]]", keys::NODE, findings) {
        let id = text::id(&table, "node", |id| nodes.defined.contains_key(id), findings);
        let kind = table.required("kind", "\"bus\"", findings, kind);
        let name = text::name(&table, "name", findings);
        let device = super::device(&table, devices, findings);
        let signals = signals(&table, kind, device.as_ref(), findings);

        let Some(id) = id else { continue };
        nodes.defined.insert(id.value.clone(), id.span);
        let Some(kind) = kind else { continue };
        nodes.nodes.push(Node {
            name: name.unwrap_or_else(|| id.value.clone()),
            id: id.value,
            kind,
            device: device.map(|device| device.id.value),
            signals,
        });
    }
    nodes
}

fn kind(table: &Table<'_, '_>, key: &str, findings: &mut Collector<'_>) -> Option<NodeKind> {
    let text = table.string(key, findings)?;
    let kind = NodeKind::ALL.iter().copied().find(|kind| kind.as_str() == text.value);
    if kind.is_none() {
        let known = NodeKind::ALL.iter().map(|kind| kind.as_str());
        findings.add(
            text.span,
            format!("`{}` is no kind of node", shown(&text.value)),
            remedy(&text.value, known),
        );
    }
    kind
}

/// Which object of the device's signals describes the node: the one that is named, or that of its kind.
fn signals(
    table: &Table<'_, '_>,
    kind: Option<NodeKind>,
    device: Option<&Named>,
    findings: &mut Collector<'_>,
) -> Option<String> {
    let named = table.string("signals", findings);
    let Some(device) = device else {
        // A device that does not exist has been reported already.
        if let Some(named) = named.filter(|_| !table.has("device")) {
            findings.add(
                named.span,
                "`signals` needs a device that measures them",
                "add `device`, or leave `signals` out",
            );
        }
        return None;
    };
    let profile = device.profile?;
    let objects = profiles::objects(profile);
    let known = objects.iter().copied();
    match named {
        Some(named) if objects.contains(named.value.as_str()) => Some(named.value),
        Some(named) => {
            findings.add(
                named.span,
                format!("{} ({}) has no signals of `{}`", device.id.value, profile.key, shown(&named.value)),
                remedy(&named.value, known),
            );
            None
        }
        // Of the wrong type, and reported.
        None if table.has("signals") => None,
        None => {
            let object = kind?.object()?;
            if !objects.contains(object) {
                findings.add(
                    device.id.span.clone(),
                    format!("{} ({}) has no signals of `{object}`", device.id.value, profile.key),
                    format!("add `signals` with one of: {}; or leave `device` out", listed(known)),
                );
                return None;
            }
            Some(object.to_owned())
        }
    }
}
