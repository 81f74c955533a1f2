//! The plant as a panel meets it: its life, its faults, its levers, and what holds whatever happens.

mod faults;
mod life;
mod page;
mod parallel;
mod properties;

use crate::levers::{Lever, Position};

use super::{Controls, Feed, LEVERS, Plant, Synchronism};

const DT: f64 = 0.1;

/// Every word of a lever, and both ends of its range.
pub(super) fn positions(lever: &Lever) -> Vec<Position> {
    let ends = lever.numbers.map(|numbers| [numbers.min, numbers.max].map(Position::Number));
    let words = lever.words.iter().map(|word| Position::Word(word.id));
    words.chain(ends.into_iter().flatten()).collect()
}

/// Ids are distinct and words are written as all are.
pub(super) fn are_lawful(levers: &[Lever]) {
    for (number, lever) in levers.iter().enumerate() {
        assert!(levers[..number].iter().all(|other| other.id != lever.id), "{}", lever.id);
        for word in lever.words {
            let lawful = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
            assert!(word.id.chars().all(lawful), "{} {}", lever.id, word.id);
        }
    }
}

fn run(plant: &mut Plant, controls: &Controls, seconds: f64) {
    for _ in 0..(seconds / DT).round() as u32 {
        plant.step(DT, controls);
    }
}

fn pull(plant: &mut Plant, id: &str, to: &str) {
    let lever = LEVERS.iter().find(|lever| lever.id == id).unwrap();
    plant.pull(id, lever.position(to).unwrap());
}

/// Good enough to feed the load.
fn mains_healthy(plant: &Plant) -> bool {
    let mains = &plant.mains;
    is_healthy(mains) && !mains.phase_order_wrong
}

fn genset_healthy(plant: &Plant) -> bool {
    is_healthy(&plant.genset)
}

fn is_healthy(feed: &Feed) -> bool {
    feed.voltage.iter().all(|volts| (200.0..260.0).contains(volts)) && (47.0..53.0).contains(&feed.frequency)
}

fn on_mains() -> Controls {
    Controls { mains_breaker: true, ..Controls::default() }
}

/// Starts the engine beside the mains.
fn start(plant: &mut Plant) -> Controls {
    let mut controls = Controls { fuel: true, starter: true, ..on_mains() };
    run(plant, &controls, 5.0);
    controls.starter = false;
    run(plant, &controls, 10.0);
    controls
}

/// A genset that carries the load of the site alone.
fn on_load(seed: u64) -> (Plant, Controls) {
    let mut plant = Plant::new(seed);
    let mut controls = start(&mut plant);
    controls.mains_breaker = false;
    run(&mut plant, &controls, 1.0);
    controls.genset_breaker = true;
    run(&mut plant, &controls, 5.0);
    (plant, controls)
}
