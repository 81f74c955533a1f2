//! The switchgear: two 10 kV sources, three switches between two bus sections, and what the sections feed.
//!
//! QS1 puts source 1 on section 1, QS2 source 2 on section 2, QTIE joins the sections. Both sources come from one grid,
//! so that they keep their angle to each other. Behind each source there may be a genset that takes over its terminals
//! while its mains are ill, or when it is to carry load. Each switch has a protection relay of its own.

mod engine;
mod mechanism;
mod section;
mod source;

use crate::plant::Supply;
use crate::random::{Drift, Random};

use super::switches::{Drive, FEEDERS, Positions, Switch};

pub(super) use engine::{Engine, Health};
pub(super) use mechanism::{Condition, Mechanism};
pub(super) use section::Section;
pub(super) use source::{Mains, Meter, Source};

use section::Demand;
use source::Surroundings;

/// 10 kV between phases, V.
pub(super) const PHASE_VOLTAGE: f64 = 5774.0;
const RATED_FREQUENCY: f64 = 50.0;
/// Seconds that QS1, QTIE and QS2 take, and the load switches.
const SWITCH_SECONDS: f64 = 0.3;
const FEEDER_SECONDS: f64 = 0.4;
/// A section with less than this part of its voltage holds no load switch closed.
const HOLDING: f64 = 0.5;
/// Seconds without voltage after which its load switches fall.
const RELEASE: f64 = 1.0;
/// kW that one source pushes into the other at a right angle between them, and kvar for the whole voltage between them.
const TRANSFER_REACTANCE: f64 = 10_000.0;
/// Closed on each other farther apart than this, the relays separate the sources: degrees, part of the voltage, Hz.
const SURGE: (f64, f64, f64) = (30.0, 0.15, 1.5);

/// What the controller's outputs do.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outputs {
    /// QS1, QTIE and QS2.
    pub(super) switches: [Option<Drive>; 3],
    pub(super) loads: [[Option<Drive>; FEEDERS]; 2],
    /// The start signals of the gensets behind source 1 and source 2.
    pub(super) start: [bool; 2],
    /// What is started is to carry load even while its mains are there.
    pub(super) on_load: bool,
    /// How many steps of non-essential consumers are off.
    pub(super) shed: u16,
}

/// All of it; the panel reads the fields.
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub(super) sources: [Source; 2],
    /// QS1, QTIE and QS2.
    pub(super) switches: [Mechanism; 3],
    /// Load switches by section.
    pub(super) feeders: [[Mechanism; FEEDERS]; 2],
    pub(super) sections: [Section; 2],
    pub(super) engines: [Engine; 2],
    /// The relays of QS1, QTIE and QS2 that have operated and were not reset.
    pub(super) relays: [bool; 3],
    /// What both sources come from.
    pub(super) grid: Grid,
    dead_for: [f64; 2],
    random: Random,
}

impl Plant {
    /// A plant whose switches stand like this, with every load switch closed.
    pub(super) fn new(seed: u64, positions: Positions) -> Self {
        let mut random = Random::new(seed ^ 0x0821);
        let [first, second] = [0; 2].map(|_| random.between(90.0, 210.0) as u32);
        let mechanism =
            |switch, closings| Mechanism::new(positions.is_closed(switch), closings, SWITCH_SECONDS);
        let mut plant = Self {
            sources: [Source::new(&mut random), Source::new(&mut random)],
            // The tie has closed for each of the times that a source was lost.
            switches: [
                mechanism(Switch::Qs1, first),
                mechanism(Switch::Qtie, first + second),
                mechanism(Switch::Qs2, second),
            ],
            feeders: [0; 2].map(|_| std::array::from_fn(|_| Mechanism::new(true, 0, FEEDER_SECONDS))),
            sections: [Section::new(&mut random), Section::new(&mut random)],
            engines: [Engine::new(), Engine::new()],
            relays: [false; 3],
            dead_for: [0.0; 2],
            grid: Grid::new(&mut random),
            random,
        };
        // Two steps fill the meters, so that the first image is a whole one.
        (0..2).for_each(|_| plant.carry(0.1, &Outputs::default()));
        plant
    }

    /// Lets `dt` seconds pass under these outputs: the switchgear first, so that the words tell of switches that have
    /// moved in the same image.
    pub(super) fn step(&mut self, dt: f64, outputs: &Outputs) {
        let before = self.conducting();
        for (switch, drive) in self.switches.iter_mut().zip(outputs.switches) {
            switch.step(dt, drive);
        }
        self.protect(before);
        self.move_feeders(dt, outputs);
        self.carry(dt, outputs);
    }

    /// Which of the three switches are closed, as their contacts tell.
    pub(super) fn positions(&self) -> Positions {
        Positions::by(|switch| self.switches[switch as usize].is_closed())
    }

    fn conducting(&self) -> Positions {
        Positions::by(|switch| self.switches[switch as usize].conducts())
    }

    fn is_live(&self, source: usize) -> bool {
        self.sources[source].average_part() > HOLDING
    }

    /// Which sources are connected to each section, whether or not they have voltage.
    pub(super) fn feeds(&self) -> [[bool; 2]; 2] {
        self.conducting().feeds()
    }

    /// Whether each section has voltage enough to hold its load switches.
    pub(super) fn alive(&self) -> [bool; 2] {
        let feeds = self.feeds();
        std::array::from_fn(|section| {
            !self.sections[section].short_circuit
                && (0..2).any(|source| feeds[section][source] && self.is_live(source))
        })
    }

    /// What a section gives to whatever hangs on it.
    pub(super) fn supply(&self, section: usize) -> Supply {
        let none = Supply { parts: [0.0; 3], frequency: 0.0, reversed: false };
        if self.sections[section].short_circuit {
            return none;
        }
        let feeding =
            (0..2).filter(|source| self.feeds()[section][*source]).map(|source| &self.sources[source]);
        let best = feeding.max_by(|a, b| a.average_part().total_cmp(&b.average_part()));
        best.map_or(none, Source::supply)
    }

    /// Both sources are there and joined.
    pub(super) fn is_parallel(&self) -> bool {
        self.conducting() == Positions::ALL_CLOSED && self.is_live(0) && self.is_live(1)
    }

    /// The relays: a short circuit opens what feeds it, sources that meet too far apart are separated again.
    fn protect(&mut self, before: Positions) {
        for section in 0..2 {
            if !self.sections[section].short_circuit {
                continue;
            }
            let other = 1 - section;
            let now = self.conducting();
            let own = Switch::OF_SOURCES[section];
            if now.is_closed(own) && self.is_live(section) {
                self.operate(own);
            }
            let over_the_tie = now.is_closed(Switch::Qtie) && now.is_closed(Switch::OF_SOURCES[other]);
            if over_the_tie && self.is_live(other) {
                self.operate(Switch::Qtie);
            }
        }
        if self.is_surging() {
            let closed_now = Switch::ALL.into_iter().find(|switch| !before.is_closed(*switch));
            // Where that one jams, another one parts them.
            for switch in closed_now.into_iter().chain([Switch::Qtie, Switch::Qs1, Switch::Qs2]) {
                if self.is_parallel() {
                    self.operate(switch);
                }
            }
        }
    }

    /// Sources are joined that are too far apart.
    pub(super) fn is_surging(&self) -> bool {
        let [first, second] = &self.sources;
        let volts = (first.average_part() - second.average_part()).abs();
        let hertz = (first.frequency() - second.frequency()).abs();
        let apart = self.angle_between().abs() > SURGE.0 || volts > SURGE.1 || hertz > SURGE.2;
        self.is_parallel() && apart
    }

    /// Degrees that source 1 leads source 2, -180 to 180; half a turn where their phases follow differently.
    fn angle_between(&self) -> f64 {
        let [first, second] = self.sources.each_ref().map(Source::angles);
        let apart = |phase: usize| (first[phase] - second[phase] + 180.0).rem_euclid(360.0) - 180.0;
        let farthest = apart(1);
        if (apart(0) - farthest).abs() > 1.0 { 180.0 } else { apart(0) }
    }

    fn operate(&mut self, switch: Switch) {
        self.switches[switch as usize].release();
        self.relays[switch as usize] = true;
    }

    fn move_feeders(&mut self, dt: f64, outputs: &Outputs) {
        for (section, alive) in self.alive().into_iter().enumerate() {
            let dead_for = &mut self.dead_for[section];
            *dead_for = if alive { 0.0 } else { *dead_for + dt };
            let falls = *dead_for > RELEASE - dt / 2.0;
            for (feeder, drive) in self.feeders[section].iter_mut().zip(outputs.loads[section]) {
                feeder.step(dt, drive);
                // On the test bench its coil has another supply.
                if falls && feeder.is_in_work() {
                    feeder.release();
                }
            }
        }
    }

    /// Lets `dt` seconds of electricity flow into the load switches that are closed.
    fn carry(&mut self, dt: f64, outputs: &Outputs) {
        self.grid.step(dt, &mut self.random);
        let (parallel, feeds) = (self.is_parallel(), self.feeds());
        let shorted = self.sections.each_ref().map(|section| section.short_circuit);
        let hertz = self.sources.each_ref().map(Source::frequency);
        for (index, source) in self.sources.iter_mut().enumerate() {
            let engine = &mut self.engines[index];
            engine.step(dt, outputs.start[index], source.holds());
            let around = Surroundings {
                genset: engine.has_voltage(),
                on_load: outputs.on_load,
                tied: parallel.then_some(hertz[1 - index]),
                shorted: (0..2).any(|section| shorted[section] && feeds[section][index]),
            };
            source.step(dt, around, &self.grid, &mut self.random);
        }
        for (section, alive) in self.alive().into_iter().enumerate() {
            self.sections[section].notice(dt, alive);
        }
        let demands: [Demand; 2] = std::array::from_fn(|index| {
            let carrying = self.feeders[index].each_ref().map(Mechanism::conducts);
            self.sections[index].step(dt, &carrying, outputs.shed, &mut self.random)
        });
        let shares = self.shares(demands);
        for (source, share) in self.sources.iter_mut().zip(&shares) {
            source.load(dt, share);
        }
    }

    /// What each source takes over: its sections, half of them where the other one helps, and in parallel what flows
    /// from one source into the other.
    fn shares(&self, demands: [Demand; 2]) -> [Demand; 2] {
        let feeds = self.feeds();
        let live = [0, 1].map(|source| self.is_live(source));
        let mut shares = [Demand::default(); 2];
        for (demand, feeds) in demands.iter().zip(feeds) {
            let both = feeds[0] && feeds[1] && live[0] == live[1];
            let part = if both { 0.5 } else { 1.0 };
            for (source, share) in shares.iter_mut().enumerate() {
                if feeds[source] && (both || !feeds[1 - source] || live[source]) {
                    share.add(demand, part);
                }
            }
        }
        if self.is_parallel() {
            let [first, second] = &self.sources;
            let active = TRANSFER_REACTANCE * self.angle_between().to_radians().sin();
            let reactive = TRANSFER_REACTANCE * (first.average_part() - second.average_part());
            let across =
                Demand { active: [active / 3.0; 3], reactive: [reactive / 3.0; 3], ..Demand::default() };
            shares[0].add(&across, 1.0);
            shares[1].add(&across, -1.0);
        }
        shares
    }
}

/// What both mains hang on.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// It gives nothing to either of them.
    pub(super) failed: bool,
    /// Hz.
    frequency: f64,
    /// Degrees against a clock of exactly 50 Hz.
    angle: f64,
    drift: Drift,
}

impl Grid {
    fn new(random: &mut Random) -> Self {
        Self {
            failed: false,
            frequency: RATED_FREQUENCY,
            angle: random.between(0.0, 360.0),
            drift: Drift::new(0.012, 8.0, random),
        }
    }

    fn step(&mut self, dt: f64, random: &mut Random) {
        self.frequency = RATED_FREQUENCY + self.drift.step(dt, random);
        self.angle = turned(self.angle, self.frequency, dt);
    }
}

/// Where an angle against a clock of exactly 50 Hz stands after `dt` seconds of another frequency.
fn turned(angle: f64, frequency: f64, dt: f64) -> f64 {
    (angle + 360.0 * (frequency - RATED_FREQUENCY) * dt).rem_euclid(360.0)
}

#[cfg(test)]
mod tests;
