//! When a source carries too much: non-essential consumers go in up to three steps over NEL1 to NEL3, then load switches
//! one after the other, the least important first; and how both come back.

use std::time::Duration;

use crate::settings::Settings;

use super::alarms::Board;
use super::loads::{Around, Loads};
use super::switches::Drive;
use super::timer::Lasting;

/// Part of what a source can carry that a load switch takes at most.
const ROOM: f64 = 0.05;

/// Levels as parts of what a source can carry, and delays, as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    /// kW of source 1 and source 2 while they are mains, and of a genset.
    capacity: [f64; 2],
    genset: f64,
    steps: u16,
    step_level: f64,
    step_delay: Duration,
    /// Steps come back by themselves.
    steps_return: bool,
    step_return_level: f64,
    step_return_delay: Duration,
    unloads: bool,
    unload_level: f64,
    unload_delay: Duration,
    recover_level: f64,
    recover_delay: Duration,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        let part = |id| settings.number(id) / 100.0;
        Self {
            capacity: [settings.number("source_1_capacity"), settings.number("source_2_capacity")],
            genset: settings.number("genset_capacity"),
            steps: settings.number("nel_count") as u16,
            step_level: part("nel_level"),
            step_delay: settings.seconds("nel_delay"),
            steps_return: settings.is_on("nel_return"),
            step_return_level: part("nel_return_level"),
            step_return_delay: settings.seconds("nel_return_delay"),
            unloads: settings.is_on("smart_unloading"),
            unload_level: part("unload_level"),
            unload_delay: settings.seconds("unload_delay"),
            recover_level: part("recover_level"),
            recover_delay: settings.seconds("recover_delay"),
        }
    }

    /// kW that a source, 0 or 1, can carry.
    pub(super) fn capacity(&self, source: usize, on_genset: bool) -> f64 {
        if on_genset { self.genset } else { self.capacity[source] }
    }

    /// The source that feeds a section, where it carries so much that nothing more is to be closed on it.
    pub(super) fn full(&self, section: usize, burden: Burden) -> Option<usize> {
        let source = burden.feeder(section)?;
        (self.unloads && burden.parts[source] > self.unload_level - ROOM).then_some(source)
    }
}

/// What the sources carry and whom they feed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Burden {
    /// Of each source, as a part of what it can carry.
    pub(super) parts: [f64; 2],
    /// By section, then by source.
    pub(super) feeds: [[bool; 2]; 2],
}

impl Burden {
    /// The source that feeds a section; in parallel the one with more to carry.
    fn feeder(&self, section: usize) -> Option<usize> {
        match self.feeds[section] {
            [true, false] => Some(0),
            [false, true] => Some(1),
            [true, true] => Some(usize::from(self.parts[1] > self.parts[0])),
            [false, false] => None,
        }
    }
}

/// The steps that are off, and the times that matter.
#[derive(Clone, Debug, Default)]
pub(super) struct Shedding {
    steps: u16,
    too_much: Lasting,
    little: Lasting,
    unload: [Lasting; 2],
    recover: [Lasting; 2],
    /// Load switches follow each other at their pace once the first one has moved.
    follows: [bool; 2],
}

impl Shedding {
    pub(super) fn step(&mut self, dt: Duration, burden: Burden, limits: &Limits) {
        let most = burden.parts[0].max(burden.parts[1]);
        if self.too_much.step(dt, most > limits.step_level, limits.step_delay) && self.steps < limits.steps {
            self.steps += 1;
            self.too_much.restart();
        }
        let little = limits.steps_return && most < limits.step_return_level;
        if self.little.step(dt, little, limits.step_return_delay) && self.steps > 0 {
            self.steps -= 1;
            self.little.restart();
        }
        self.steps = self.steps.min(limits.steps);
    }

    /// Takes load switches off that a source cannot carry, and brings them back when it can.
    pub(super) fn unload(&mut self, dt: Duration, loads: &mut [Loads; 2], scene: Scene<'_>) {
        for source in 0..2 {
            let moves = loads.iter().any(Loads::moves);
            let Some(wish) = self.wish(dt, source, moves, scene) else { continue };
            let Some((side, feeder)) = choose(wish, source, loads, scene) else { continue };
            let limits = scene.around[side].limits;
            match wish {
                Drive::Open => loads[side].unload(feeder, source, limits),
                Drive::Close => loads[side].recover(feeder, limits),
            }
            self.follows[source] = true;
            self.unload[source].restart();
            self.recover[source].restart();
        }
    }

    /// Whether a source has carried too much for long enough, or so little that it can carry more.
    fn wish(&mut self, dt: Duration, source: usize, moves: bool, scene: Scene<'_>) -> Option<Drive> {
        let limits = scene.limits;
        let part = scene.burden.parts[source];
        let too_much = limits.unloads && part > limits.unload_level;
        let room = !limits.unloads || part < limits.recover_level;
        self.follows[source] &= too_much || room;
        let pace = scene.around[0].limits.pace();
        let delay = |first| if self.follows[source] { pace } else { first };
        let (unload_delay, recover_delay) = (delay(limits.unload_delay), delay(limits.recover_delay));
        let unloads = self.unload[source].step(dt, too_much && !moves, unload_delay);
        let recovers = self.recover[source].step(dt, room && !moves, recover_delay);
        if unloads { Some(Drive::Open) } else { recovers.then_some(Drive::Close) }
    }

    /// How many of NEL1 to NEL3 are on.
    pub(super) fn steps(&self) -> u16 {
        self.steps
    }
}

/// What load switches are chosen by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub(super) burden: Burden,
    pub(super) around: [Around<'a>; 2],
    pub(super) limits: &'a Limits,
    pub(super) board: &'a Board,
}

/// Section and load switch that move next, of the sections that a source feeds.
fn choose(wish: Drive, source: usize, loads: &[Loads; 2], scene: Scene<'_>) -> Option<(usize, usize)> {
    let fed = |side: &usize| scene.burden.feeder(*side) == Some(source) && scene.around[*side].alive;
    let candidate = |side: usize| {
        let (priority, feeder) = match wish {
            Drive::Open => loads[side].least_important(scene.around[side], scene.board),
            Drive::Close => loads[side].most_important(scene.around[side], scene.board),
        }?;
        // Of two alike the guest goes first and comes back last.
        Some((priority, side != source, feeder, side))
    };
    let candidates = (0..2).filter(fed).filter_map(candidate);
    let (_, _, feeder, side) = match wish {
        Drive::Open => candidates.max(),
        Drive::Close => candidates.min(),
    }?;
    Some((side, feeder))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(set: &[(&str, &str)]) -> Limits {
        let mut settings = super::super::tests::settings();
        set.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
        Limits::of(&settings)
    }

    fn run(shedding: &mut Shedding, parts: [f64; 2], seconds: u32, limits: &Limits) -> u16 {
        let burden = Burden { parts, feeds: [[true, false], [false, true]] };
        (0..10 * seconds).for_each(|_| shedding.step(Duration::from_millis(100), burden, limits));
        shedding.steps()
    }

    #[test]
    fn non_essential_consumers_go_step_by_step_and_come_back() {
        let limits_with = limits(&[]);
        let mut shedding = Shedding::default();
        assert_eq!(run(&mut shedding, [0.89, 0.5], 60, &limits_with), 0);
        assert_eq!(run(&mut shedding, [0.5, 0.95], 4, &limits_with), 0);
        assert_eq!(run(&mut shedding, [0.5, 0.95], 2, &limits_with), 1);
        assert_eq!(run(&mut shedding, [0.5, 0.95], 60, &limits_with), 3);
        assert_eq!(run(&mut shedding, [0.8, 0.8], 60, &limits_with), 3, "neither too much nor little");
        assert_eq!(run(&mut shedding, [0.6, 0.6], 11, &limits_with), 2);
        assert_eq!(run(&mut shedding, [0.6, 0.6], 60, &limits_with), 0);

        let without = limits(&[("nel_return", "0"), ("nel_count", "2")]);
        let mut shedding = Shedding::default();
        assert_eq!(run(&mut shedding, [1.5, 0.0], 60, &without), 2);
        assert_eq!(run(&mut shedding, [0.1, 0.1], 60, &without), 2, "they stay off");
    }

    #[test]
    fn a_genset_carries_less_than_mains() {
        let limits = limits(&[("genset_capacity", "2000"), ("source_2_capacity", "5000")]);
        assert_eq!((limits.capacity(1, true), limits.capacity(1, false)), (2000.0, 5000.0));
    }
}
