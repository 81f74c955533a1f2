//! What people can make happen at an ACC1700: the levers of its plant, and those of the unit itself.

use std::sync::LazyLock;
use std::time::Duration;

use crate::levers::{Lever, Position, Word};
use crate::plant::COMPRESSOR_LEVERS;

use super::Acc1700;
use super::sequence::Status;

const HOURS: (f64, f64) = (0.0, 65_535.0);
const DONE: &[Word] = &[Word::new("done", "Somebody does the service: the countdown begins anew")];

const fn service(id: &'static str, name: &'static str) -> Lever {
    Lever::of_numbers(id, name, DONE, HOURS, "h")
}

/// In the order in which people are shown them.
pub(super) static LEVERS: LazyLock<Vec<Lever>> = LazyLock::new(|| [COMPRESSOR_LEVERS, &OF_THE_UNIT].concat());

const OF_THE_UNIT: [Lever; 12] = [
    Lever::of_words(
        "input.4",
        "Switch at input 4",
        &[Word::new("open", "The contact is open"), Word::new("closed", "The contact is closed")],
    ),
    Lever::of_words(
        "heating",
        "Manual heating",
        &[
            Word::new("off", "Nobody wants heating"),
            Word::new("on", "Somebody switches heating on at the panel"),
        ],
    ),
    service("maintenance.1", "Maintenance 1, fuel filter"),
    service("maintenance.2", "Maintenance 2, fuel/water separator"),
    service("maintenance.3", "Maintenance 3, air filter"),
    service("maintenance.4", "Maintenance 4, lubricant"),
    service("maintenance.5", "Maintenance 5, engine oil filter"),
    service("maintenance.6", "Maintenance 6, engine fuel filter"),
    service("maintenance.7", "Maintenance 7, engine lubricant"),
    service("maintenance.8", "Maintenance 8, engine air filter"),
    service("maintenance.9", "Maintenance 9"),
    service("maintenance.10", "Maintenance 10"),
];

/// Where one of them stands; none where it is not one of them.
pub(super) fn lever(unit: &Acc1700, id: &str) -> Option<Position> {
    let word = |second: bool, words: [&'static str; 2]| Some(Position::Word(words[usize::from(second)]));
    match id {
        "input.4" => word(unit.switch_closed, ["open", "closed"]),
        "heating" => word(unit.is_heating(), ["off", "on"]),
        _ => match numbered(id) {
            Some(service) => {
                let left = unit.services.left(unit.running_seconds());
                // To the hundredth of an hour, as people would write it.
                left.get(service).map(|seconds| Position::Number((*seconds as f64 / 36.0).round() / 100.0))
            }
            None => unit.plant.lever(id),
        },
    }
}

/// Pulls one of them.
pub(super) fn pull(unit: &mut Acc1700, id: &str, to: Position) {
    let is = |word: &'static str| to == Position::Word(word);
    match id {
        "input.4" => unit.switch_closed = is("closed"),
        // A menu that only a unit at rest offers.
        "heating" => {
            let on = is("on") && unit.sequence.status() == Status::Standby;
            unit.heating_left = if on { unit.setup.heating } else { Duration::ZERO };
        }
        _ => {
            let Some(service) = numbered(id) else { return unit.plant.pull(id, to) };
            let seconds = match to {
                Position::Number(hours) => Some((hours * 3600.0) as u64),
                Position::Word(_) => None,
            };
            let total = unit.running_seconds();
            unit.services.set(service, seconds, total);
        }
    }
}

/// `maintenance.1` as 0.
fn numbered(id: &str) -> Option<usize> {
    id.strip_prefix("maintenance.")?.parse::<usize>().ok()?.checked_sub(1)
}
