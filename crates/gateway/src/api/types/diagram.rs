//! How a site is connected, as the site file has it.

use serde::Serialize;
use utoipa::ToSchema;

/// How the site is connected: what there is, and what joins it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub struct DiagramView {
    /// Sources, buses and loads, in the order of the site file.
    pub nodes: Vec<NodeView>,
    /// What joins them, in the order of the site file.
    pub connections: Vec<ConnectionView>,
}

/// A source, a bus or a load.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct NodeView {
    /// Its id.
    #[schema(examples("utility"))]
    pub id: String,
    /// What it is: `mains`, `genset`, `bus`, `load` or `compressor`.
    #[schema(examples("mains"))]
    pub kind: String,
    /// Its name.
    #[schema(examples("Utility feed"))]
    pub name: String,
    /// Id of the device whose signals describe it; null when none does.
    #[schema(required, examples("gen1"))]
    pub device: Option<String>,
    /// Which object of that device's signals it is; null when no device describes it.
    #[schema(required, examples("mains"))]
    pub signals: Option<String>,
}

/// A line between two nodes, with a breaker in it or without.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ConnectionView {
    /// Id of the node nearer to the source.
    #[schema(examples("utility"))]
    pub from: String,
    /// Id of the other node.
    #[schema(examples("bus"))]
    pub to: String,
    /// Id of the device that knows the breaker; null for a plain line.
    #[schema(required, examples("gen1"))]
    pub device: Option<String>,
    /// The signal that says whether the breaker is closed; null for a plain line.
    #[schema(required, examples("breaker.mains.closed"))]
    pub breaker: Option<String>,
}
