//! How a site is connected: sources, buses and loads, and the breakers between them.

mod connections;
mod nodes;

use std::collections::BTreeMap;

use busbar_profile::text::shown;
use busbar_profile::{Collector, Profile};

use super::reader::{At, Table};
use super::words::remedy;

/// The single-line diagram of a site; empty where the file draws none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Diagram {
    /// What is connected, in the order of the file; ids are unique.
    pub nodes: Vec<Node>,
    /// Lines between nodes, in the order of the file.
    pub connections: Vec<Connection>,
}

/// One thing that is connected to others.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Node {
    /// Its id.
    pub id: String,
    /// What it is.
    pub kind: NodeKind,
    /// Its name; the id where the file gives none.
    pub name: String,
    /// Id of the device that measures it.
    pub device: Option<String>,
    /// Which object of that device's signals describes it, such as `mains` or `src1`.
    pub signals: Option<String>,
}

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeKind {
    /// A supply from outside.
    Mains,
    /// A genset.
    Genset,
    /// A bus: what joins several lines.
    Bus,
    /// What is supplied.
    Load,
    /// An engine-driven compressor.
    Compressor,
}

/// A line between two nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Connection {
    /// Id of the node at one end, the one nearer to the source.
    pub from: String,
    /// Id of the node at the other end.
    pub to: String,
    /// Id of the device that tells the position of its breaker.
    pub device: Option<String>,
    /// The signal by which it does; none: there is no breaker in it that anybody reports.
    pub breaker: Option<String>,
}

impl NodeKind {
    /// Every kind.
    pub const ALL: &'static [Self] = &[Self::Mains, Self::Genset, Self::Bus, Self::Load, Self::Compressor];

    /// The word of the site file.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Mains => "mains",
            Self::Genset => "genset",
            Self::Bus => "bus",
            Self::Load => "load",
            Self::Compressor => "compressor",
        }
    }

    /// The object of the vocabulary that describes such a node unless the file says otherwise.
    const fn object(self) -> Option<&'static str> {
        match self {
            Self::Mains | Self::Genset | Self::Compressor => Some(self.as_str()),
            Self::Bus | Self::Load => None,
        }
    }
}

/// The devices that a diagram may refer to; none: of which the profile is not known.
type Defined = BTreeMap<String, Option<&'static Profile>>;

/// A device that a node or connection names.
struct Named {
    id: At<String>,
    profile: Option<&'static Profile>,
}

pub(super) fn read(
    root: &Table<'_, '_>,
    devices: &Defined,
    findings: &mut Collector<'_>,
    warnings: &mut Collector<'_>,
) -> Diagram {
    let nodes = nodes::read(root, devices, findings);
    let connections = connections::read(root, devices, &nodes, findings, warnings);
    for (id, node) in nodes.defined.iter().filter(|(id, _)| !connections.ends.contains(*id)) {
        warnings.add(
            node.clone(),
            format!("nothing connects the node `{id}`"),
            "add a [[connections]] with it in `from` or `to`, or leave it out",
        );
    }
    Diagram { nodes: nodes.nodes, connections: connections.connections }
}

/// The device that a table names, if the file has it.
fn device(table: &Table<'_, '_>, devices: &Defined, findings: &mut Collector<'_>) -> Option<Named> {
    let id = table.string("device", findings)?;
    let profile = devices.get(&id.value).copied();
    if profile.is_none() {
        let remedy = match devices.is_empty() {
            true => "define it: [[devices]] with that id".to_owned(),
            false => remedy(&id.value, devices.keys().map(String::as_str)),
        };
        findings.add(id.span.clone(), format!("there is no device `{}`", shown(&id.value)), remedy);
    }
    profile.map(|profile| Named { id, profile })
}
