//! The ways of a state machine: what its code asserts, what its page in `docs/imitation/` draws.

/// One way from a state to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<S: 'static> {
    pub(super) from: S,
    pub(super) to: S,
    /// What leads there.
    pub(super) cause: &'static str,
}

impl<S: Copy + PartialEq> Edge<S> {
    pub(super) const fn new(from: S, to: S, cause: &'static str) -> Self {
        Self { from, to, cause }
    }

    /// What leads from one state to another; none where nothing does.
    pub(super) fn cause(edges: &[Self], from: S, to: S) -> Option<&'static str> {
        edges.iter().find(|edge| edge.from == from && edge.to == to).map(|edge| edge.cause)
    }
}
