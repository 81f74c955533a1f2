//! The shape of the single-line diagram: what is connected, and by which breakers.

use serde::Serialize;
use utoipa::ToSchema;

use crate::site::{self, Connection, Diagram, Node};

/// How the site is connected; empty where its file draws nothing.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, ToSchema)]
pub struct DiagramView {
    /// What is connected, in the order of the site file.
    pub nodes: Vec<NodeView>,
    /// Lines between nodes, in the order of the site file.
    pub connections: Vec<ConnectionView>,
}

/// One thing that is connected to others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct NodeView {
    /// Its id in the site file.
    #[schema(examples("bus1"))]
    pub id: String,
    /// What it is.
    pub kind: NodeKind,
    /// Its name in the site file.
    #[schema(examples("Emergency bus"))]
    pub name: String,
    /// Id of the device that measures it; null where none does.
    #[schema(required, examples("gen1"))]
    pub device: Option<String>,
    /// Which object of that device's signals describes it; null where none does.
    #[schema(required, examples("mains"))]
    pub signals: Option<String>,
}

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize, ToSchema)]
pub struct ConnectionView {
    /// Id of the node at one end, the one nearer to the source.
    #[schema(examples("utility"))]
    pub from: String,
    /// Id of the node at the other end.
    #[schema(examples("bus1"))]
    pub to: String,
    /// Id of the device that tells the position of its breaker; null where none does.
    #[schema(required, examples("gen1"))]
    pub device: Option<String>,
    /// The signal by which it does; null for a line without a breaker.
    #[schema(required, examples("breaker.mains.closed"))]
    pub breaker: Option<String>,
}

impl From<&Diagram> for DiagramView {
    fn from(diagram: &Diagram) -> Self {
        Self {
            nodes: diagram.nodes.iter().map(NodeView::from).collect(),
            connections: diagram.connections.iter().map(ConnectionView::from).collect(),
        }
    }
}

impl From<&Node> for NodeView {
    fn from(node: &Node) -> Self {
        let Node { id, kind, name, device, signals } = node.clone();
        Self { id, kind: kind.into(), name, device, signals }
    }
}

impl From<site::NodeKind> for NodeKind {
    fn from(kind: site::NodeKind) -> Self {
        match kind {
            site::NodeKind::Mains => Self::Mains,
            site::NodeKind::Genset => Self::Genset,
            site::NodeKind::Bus => Self::Bus,
            site::NodeKind::Load => Self::Load,
            site::NodeKind::Compressor => Self::Compressor,
        }
    }
}

impl From<&Connection> for ConnectionView {
    fn from(connection: &Connection) -> Self {
        let Connection { from, to, device, breaker } = connection.clone();
        Self { from, to, device, breaker }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::site::Site;

    #[test]
    fn a_diagram_is_sent_as_the_file_has_it() {
        let text = r#"
            site.name = "S"
            wires = [{ id = "w", endpoint = "tcp://192.0.2.20" }]
            devices = [{ id = "g", profile = "datakom-d", wire = "w", unit = 1 }]
            nodes = [{ id = "utility", kind = "mains", name = "<b>Grid</b>", device = "g" }, { id = "b", kind = "bus" },
                     { id = "l", kind = "load" }, { id = "air", kind = "compressor" }, { id = "n", kind = "genset" }]
            connections = [{ from = "utility", to = "b", device = "g", breaker = "breaker.mains.closed" },
                           { from = "b", to = "l" }]
        "#;
        let diagram = DiagramView::from(&Site::parse("site.toml", text).unwrap().diagram);
        assert_eq!(
            serde_json::to_value(&diagram).unwrap(),
            json!({
                "nodes": [
                    { "id": "utility", "kind": "mains", "name": "<b>Grid</b>", "device": "g", "signals": "mains" },
                    { "id": "b", "kind": "bus", "name": "b", "device": null, "signals": null },
                    { "id": "l", "kind": "load", "name": "l", "device": null, "signals": null },
                    { "id": "air", "kind": "compressor", "name": "air", "device": null, "signals": null },
                    { "id": "n", "kind": "genset", "name": "n", "device": null, "signals": null },
                ],
                "connections": [
                    { "from": "utility", "to": "b", "device": "g", "breaker": "breaker.mains.closed" },
                    { "from": "b", "to": "l", "device": null, "breaker": null },
                ],
            })
        );
    }
}
