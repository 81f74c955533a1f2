//! What can be made to happen at a site with this unit: the levers of its plant, the J1939 cable, and the service.

use std::sync::LazyLock;

use crate::levers::{Lever, Position, Word};
use crate::plant;

use super::DatakomDkg705;

const OWN: [Lever; 4] = [
    Lever::of_words(
        "ecu",
        "J1939 cable",
        &[
            Word::new("connected", "The engine's controller is heard"),
            Word::new("cut", "Nothing comes from the engine's controller"),
        ],
    ),
    Lever::of_words(
        "genset.wiring",
        "Wires of the genset's voltages",
        &[
            Word::new("normal", "Each phase is where it belongs"),
            Word::new("swapped", "Two phases have changed places at the unit"),
        ],
    ),
    Lever::of_numbers("service.hours", "Engine hours since the service", &[], (0.0, 5000.0), "h"),
    Lever::of_numbers("service.days", "Days since the service", &[], (0.0, 1000.0), "d"),
];

static ALL: LazyLock<Vec<Lever>> = LazyLock::new(|| plant::LEVERS.iter().chain(&OWN).copied().collect());

/// In the order in which people are shown them.
pub(super) fn all() -> &'static [Lever] {
    &ALL
}

impl DatakomDkg705 {
    /// Where a lever stands that is not the plant's.
    pub(super) fn own_lever(&self, id: &str) -> Option<Position> {
        match id {
            "ecu" => Some(Position::Word(if self.ecu.cut { "cut" } else { "connected" })),
            "genset.wiring" => Some(Position::Word(if self.genset_swapped { "swapped" } else { "normal" })),
            "service.hours" => Some(number(self.plant.engine.hours - self.service.hours)),
            "service.days" => Some(number(self.days() - self.service.days)),
            _ => None,
        }
    }

    /// Pulls a lever that is not the plant's.
    pub(super) fn pull_own(&mut self, id: &str, to: Position) {
        match (id, to) {
            ("ecu", Position::Word(word)) => self.ecu.cut = word == "cut",
            ("genset.wiring", Position::Word(word)) => self.genset_swapped = word == "swapped",
            ("service.hours", Position::Number(hours)) => {
                self.service.hours = self.plant.engine.hours - hours;
            }
            ("service.days", Position::Number(days)) => self.service.days = self.days() - days,
            _ => {}
        }
    }
}

/// In tenths.
fn number(value: f64) -> Position {
    Position::Number((10.0 * value).round() / 10.0)
}
