//! The levers of a genset's plant.

use crate::levers::{Lever, Position, Word};

use super::Plant;

/// In the order in which people are shown them.
pub(crate) const LEVERS: &[Lever] = &[Lever::of_words(
    "mains",
    "Mains",
    &[Word::new("normal", "All phases are there"), Word::new("failed", "No voltage on any phase")],
)];

impl Plant {
    /// Where a lever stands; none where there is no such lever.
    pub(crate) fn lever(&self, id: &str) -> Option<Position> {
        match id {
            "mains" => Some(Position::Word(if self.utility.failed { "failed" } else { "normal" })),
            _ => None,
        }
    }

    /// Pulls one of [`LEVERS`] to a position that it has.
    pub(crate) fn pull(&mut self, id: &str, to: Position) {
        if let ("mains", Position::Word(word)) = (id, to) {
            self.fail_mains(word == "failed");
        }
    }
}
