//! The switchgear: two 10 kV sources, three switches between two bus sections, and what the sections feed.
//!
//! QS1 puts source 1 on section 1, QS2 source 2 on section 2, QTIE joins the sections. Both sources come from one grid,
//! so that they keep their angle to each other. Behind source 2 stands a genset that takes over its terminals while its
//! mains are dead.

use std::f64::consts::TAU;
use std::time::Duration;

use crate::plant::{Energy, Feed};
use crate::random::{Drift, Random, approach};

use super::section::{Demand, Section};

/// Load switches of a section.
pub(super) const FEEDERS: usize = 12;
/// 10 kV between phases, V.
pub(super) const PHASE_VOLTAGE: f64 = 5774.0;
/// Primary rating of the current transformers, A.
pub(super) const RATED_CURRENT: f64 = 400.0;
const RATED_FREQUENCY: f64 = 50.0;
/// Seconds a switch takes from its output to its position.
const SWITCH_SECONDS: f64 = 0.3;
/// A section with less than this part of its voltage holds no load switch closed.
const HOLDING: f64 = 0.5;

/// The three switches, in the order of the digits of a transfer command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Switch {
    Qs1,
    Qtie,
    Qs2,
}

impl Switch {
    pub(super) const ALL: [Self; 3] = [Self::Qs1, Self::Qtie, Self::Qs2];
}

/// A position of all three switches: which of them are closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Positions([bool; 3]);

impl Positions {
    pub(super) const OPEN: Self = Self::of(0, 0, 0);

    /// By the digits of a transfer command, QS1, QTIE and QS2.
    pub(super) const fn of(qs1: u8, qtie: u8, qs2: u8) -> Self {
        Self([qs1 == 1, qtie == 1, qs2 == 1])
    }

    pub(super) fn is_closed(self, switch: Switch) -> bool {
        self.0[switch as usize]
    }

    pub(super) fn digits(self) -> [u8; 3] {
        self.0.map(u8::from)
    }
}

/// What the controller's outputs do to a switch; without either it stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Drive {
    Close,
    Open,
}

/// What is wrong with the mains behind a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trouble {
    Nothing,
    Blackout,
    Sag,
    PhaseLost,
}

impl Trouble {
    /// Part of the voltage that each phase keeps.
    fn remains(self) -> [f64; 3] {
        match self {
            Self::Nothing => [1.0; 3],
            Self::Blackout => [0.0; 3],
            Self::Sag => [0.68; 3],
            Self::PhaseLost => [1.0, 0.0, 1.0],
        }
    }
}

/// All of it; the panel reads the fields.
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub(super) sources: [Source; 2],
    /// QS1, QTIE and QS2.
    pub(super) switches: [Mechanism; 3],
    sections: [Section; 2],
    grid: Grid,
    random: Random,
}

impl Plant {
    /// A plant whose switches stand like this.
    pub(super) fn new(seed: u64, positions: Positions) -> Self {
        let mut random = Random::new(seed ^ 0x0821);
        let [first, second] = [0; 2].map(|_| random.between(90.0, 210.0) as u32);
        let mechanism = |switch, closings| Mechanism::new(positions.is_closed(switch), closings);
        let mut plant = Self {
            sources: [Source::new(&mut random), Source::new(&mut random)],
            // The tie has closed for each of the times that a source was lost.
            switches: [
                mechanism(Switch::Qs1, first),
                mechanism(Switch::Qtie, first + second),
                mechanism(Switch::Qs2, second),
            ],
            sections: [Section::new(&mut random), Section::new(&mut random)],
            grid: Grid::new(&mut random),
            random,
        };
        // One step fills the meters, so that the first image is a whole one.
        plant.carry(0.1, [[true; FEEDERS]; 2], false);
        plant
    }

    pub(super) fn positions(&self) -> Positions {
        Positions([0, 1, 2].map(|index: usize| self.switches[index].closed))
    }

    /// Lets the controller's outputs move the switches.
    pub(super) fn switch(&mut self, dt: f64, drives: [Option<Drive>; 3]) {
        for (switch, drive) in self.switches.iter_mut().zip(drives) {
            switch.step(dt, drive);
        }
    }

    /// Which source feeds each section.
    pub(super) fn feeding(&self) -> [Option<usize>; 2] {
        match self.positions().digits() {
            [1, 0, 1] => [Some(0), Some(1)],
            [1, 1, _] => [Some(0), Some(0)],
            [0, 1, 1] => [Some(1), Some(1)],
            [1, 0, 0] => [Some(0), None],
            [0, 0, 1] => [None, Some(1)],
            _ => [None, None],
        }
    }

    /// Whether each section has voltage enough to hold its load switches.
    pub(super) fn alive(&self) -> [bool; 2] {
        self.feeding().map(|source| source.is_some_and(|index| self.sources[index].average_part() > HOLDING))
    }

    /// Lets `dt` seconds of electricity flow into the load switches that are closed.
    pub(super) fn carry(&mut self, dt: f64, closed: [[bool; FEEDERS]; 2], genset: bool) {
        self.grid.step(dt, &mut self.random);
        for (index, source) in self.sources.iter_mut().enumerate() {
            source.step(dt, genset && index == 1, &self.grid, &mut self.random);
        }
        let demands: [Demand; 2] =
            std::array::from_fn(|index| self.sections[index].step(dt, &closed[index], &mut self.random));
        let feeding = self.feeding();
        for (index, source) in self.sources.iter_mut().enumerate() {
            let own = feeding.iter().zip(demands).filter(|(from, _)| **from == Some(index));
            source.load(dt, own.map(|(_, demand)| demand));
        }
    }
}

/// A circuit breaker with stored energy: it moves while an output drives it, and stays where it is otherwise.
#[derive(Clone, Debug)]
pub(super) struct Mechanism {
    pub(super) closed: bool,
    pub(super) closings: u32,
    /// It does not follow its outputs.
    pub(super) jammed: bool,
    moving: f64,
}

impl Mechanism {
    fn new(closed: bool, closings: u32) -> Self {
        Self { closed, closings, jammed: false, moving: 0.0 }
    }

    fn step(&mut self, dt: f64, drive: Option<Drive>) {
        let wanted = drive.map_or(self.closed, |drive| drive == Drive::Close);
        if wanted == self.closed || self.jammed {
            self.moving = 0.0;
            return;
        }
        self.moving += dt;
        // Steps of a tenth do not add up to a round number.
        if self.moving > SWITCH_SECONDS - dt / 2.0 {
            self.closed = wanted;
            self.closings += u32::from(wanted);
            self.moving = 0.0;
        }
    }
}

/// What both mains hang on.
#[derive(Clone, Debug)]
struct Grid {
    /// Hz.
    frequency: f64,
    /// Degrees against a clock of exactly 50 Hz.
    angle: f64,
    drift: Drift,
}

impl Grid {
    fn new(random: &mut Random) -> Self {
        Self {
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

/// One source as its voltage and current transformers see it.
#[derive(Clone, Debug)]
pub(super) struct Source {
    pub(super) feed: Feed,
    /// Degrees of phase A against a clock of exactly 50 Hz.
    angle: f64,
    pub(super) energy: Energy,
    pub(super) trouble: Trouble,
    level: Drift,
    phases: [Drift; 3],
    /// Degrees that its feeder leads the grid.
    lead: f64,
    swing: Drift,
    governor: Drift,
    /// Part of its voltage that each phase has now.
    parts: [f64; 3],
}

impl Source {
    fn new(random: &mut Random) -> Self {
        Self {
            feed: Feed::default(),
            angle: 0.0,
            energy: Energy::default(),
            trouble: Trouble::Nothing,
            level: Drift::new(25.0, 180.0, random),
            phases: std::array::from_fn(|_| Drift::new(9.0, 15.0, random)),
            lead: random.between(-6.0, 6.0),
            swing: Drift::new(0.4, 30.0, random),
            governor: Drift::new(0.03, 4.0, random),
            parts: [1.0; 3],
        }
    }

    /// Counts what it has delivered in its time: on the average less than it carries now.
    pub(super) fn has_served(&mut self, time: Duration, part: f64) {
        let hours = part * time.as_secs_f64() / 3600.0;
        self.energy.active = hours * self.feed.total_active();
        self.energy.inductive = hours * self.feed.total_reactive();
    }

    /// Whether any phase has a voltage that a frequency and an angle can be measured from.
    pub(super) fn is_present(&self) -> bool {
        (0..3).any(|phase| self.has_phase(phase))
    }

    /// Whether that phase, 0 to 2, has one.
    pub(super) fn has_phase(&self, phase: usize) -> bool {
        self.parts[phase] > 0.1
    }

    /// Degrees of each phase, 0 to 360.
    pub(super) fn angles(&self) -> [f64; 3] {
        [0.0, 240.0, 120.0].map(|behind| (self.angle + behind).rem_euclid(360.0))
    }

    /// Degrees of each phase's current, 0 to 360; 0 where none flows.
    pub(super) fn current_angles(&self) -> [f64; 3] {
        let angles = self.angles();
        std::array::from_fn(|phase| {
            if self.feed.active[phase] == 0.0 {
                return 0.0;
            }
            let lag = self.feed.reactive[phase].atan2(self.feed.active[phase]).to_degrees();
            (angles[phase] - lag).rem_euclid(360.0)
        })
    }

    /// A and degrees of what the three currents leave over.
    pub(super) fn residual(&self) -> (f64, f64) {
        let (mut across, mut along) = (0.0, 0.0);
        for (current, angle) in self.feed.current().into_iter().zip(self.current_angles()) {
            across += current * (angle / 360.0 * TAU).sin();
            along += current * (angle / 360.0 * TAU).cos();
        }
        (across.hypot(along), across.atan2(along).to_degrees().rem_euclid(360.0))
    }

    fn average_part(&self) -> f64 {
        self.parts.iter().sum::<f64>() / 3.0
    }

    fn step(&mut self, dt: f64, genset: bool, grid: &Grid, random: &mut Random) {
        let from_genset = genset && self.trouble == Trouble::Blackout;
        let remains = if from_genset { [1.0; 3] } else { self.trouble.remains() };
        for (part, target) in self.parts.iter_mut().zip(remains) {
            approach(part, target, 0.08, dt);
            // A meter shows no voltage that only the arithmetic keeps.
            if target == 0.0 && *part < 0.02 {
                *part = 0.0;
            }
        }
        // The sources sag a little under what they carried the moment before.
        let sag = 0.012 * self.feed.total_active();
        let level = PHASE_VOLTAGE + 40.0 + self.level.step(dt, random) - sag;
        for (phase, part) in self.parts.into_iter().enumerate() {
            self.feed.voltage[phase] = part * (level + self.phases[phase].step(dt, random));
        }
        let (swing, governor) = (self.swing.step(dt, random), self.governor.step(dt, random));
        let frequency = if from_genset {
            // A genset gives way under load, the grid does not.
            let frequency = RATED_FREQUENCY + 0.25 - 0.0002 * self.feed.total_active() + governor;
            self.angle = turned(self.angle, frequency, dt);
            frequency
        } else {
            self.angle = (grid.angle + self.lead + swing).rem_euclid(360.0);
            // What one meter differs from the other.
            grid.frequency + 0.1 * governor
        };
        self.feed.frequency = if self.is_present() { frequency } else { 0.0 };
    }

    /// Takes the sections that it feeds. Whole kW and kvar: totals are then the exact sums of what is shown.
    fn load(&mut self, dt: f64, demands: impl Iterator<Item = Demand>) {
        (self.feed.active, self.feed.reactive) = ([0.0; 3], [0.0; 3]);
        for demand in demands {
            for phase in 0..3 {
                let part = (self.feed.voltage[phase] / PHASE_VOLTAGE).powi(2);
                self.feed.active[phase] += (demand.active[phase] * part).round();
                self.feed.reactive[phase] += (demand.reactive[phase] * part).round();
            }
        }
        self.energy.add(&self.feed, dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.1;
    const ALL: [[bool; FEEDERS]; 2] = [[true; FEEDERS]; 2];

    fn carry(plant: &mut Plant, seconds: f64, genset: bool) {
        for _ in 0..(seconds / DT) as u32 {
            plant.carry(DT, ALL, genset);
        }
    }

    #[test]
    fn the_load_follows_the_switches() {
        let both = Plant::new(1, Positions::of(1, 0, 1));
        let [own_1, own_2] = both.sources.each_ref().map(|source| source.feed.total_active());
        assert!(own_1 > 1400.0 && own_2 > 1400.0, "{own_1} {own_2}");
        for (digits, expected) in [
            ((1, 1, 0), [own_1 + own_2, 0.0]),
            ((0, 1, 1), [0.0, own_1 + own_2]),
            ((1, 0, 0), [own_1, 0.0]),
            ((0, 0, 1), [0.0, own_2]),
            ((0, 1, 0), [0.0, 0.0]),
            ((0, 0, 0), [0.0, 0.0]),
        ] {
            let plant = Plant::new(1, Positions::of(digits.0, digits.1, digits.2));
            for (source, expected) in plant.sources.iter().zip(expected) {
                let active = source.feed.total_active();
                assert!((active - expected).abs() <= 0.02 * expected, "{digits:?}: {active} {expected}");
            }
        }
    }

    #[test]
    fn a_dead_source_shows_nothing_and_comes_back() {
        let mut plant = Plant::new(2, Positions::of(1, 0, 1));
        plant.sources[0].trouble = Trouble::Blackout;
        carry(&mut plant, 1.0, false);
        let source = &plant.sources[0];
        assert_eq!((source.feed.voltage, source.feed.frequency), ([0.0; 3], 0.0));
        assert_eq!((source.feed.current(), source.feed.total_active()), ([0.0; 3], 0.0));
        assert_eq!((source.is_present(), plant.alive()), (false, [false, true]));
        plant.sources[0].trouble = Trouble::Nothing;
        carry(&mut plant, 1.0, false);
        assert_eq!(plant.alive(), [true, true]);
    }

    #[test]
    fn the_genset_stands_in_for_dead_mains_of_source_2_only() {
        let mut plant = Plant::new(3, Positions::of(0, 1, 1));
        plant.sources[0].trouble = Trouble::Blackout;
        plant.sources[1].trouble = Trouble::Blackout;
        carry(&mut plant, 2.0, false);
        assert_eq!(plant.alive(), [false, false]);
        carry(&mut plant, 2.0, true);
        assert_eq!(plant.alive(), [true, true]);
        assert!(!plant.sources[0].is_present());
        assert!((49.0..49.9).contains(&plant.sources[1].feed.frequency), "{:?}", plant.sources[1].feed);
    }

    #[test]
    fn sources_of_one_grid_keep_their_angle_and_the_genset_does_not() {
        let between = |plant: &Plant| {
            let [first, second] = plant.sources.each_ref().map(|source| source.angles()[0]);
            (first - second + 180.0).rem_euclid(360.0) - 180.0
        };
        let mut plant = Plant::new(5, Positions::of(1, 0, 1));
        for _ in 0..600 {
            carry(&mut plant, 1.0, false);
            assert!(between(&plant).abs() < 15.0, "{}", between(&plant));
            let [first, second] = plant.sources.each_ref().map(|source| source.feed.frequency);
            assert!((first - second).abs() < 0.02 && (first - 50.0).abs() < 0.1, "{first} {second}");
        }
        plant.sources[1].trouble = Trouble::Blackout;
        let mut farthest = 0.0_f64;
        for _ in 0..60 {
            carry(&mut plant, 1.0, true);
            farthest = farthest.max(between(&plant).abs());
        }
        assert!(farthest > 90.0, "{farthest}");
    }

    #[test]
    fn what_was_delivered_fits_the_time() {
        let mut source = Plant::new(4, Positions::of(1, 0, 1)).sources[0].clone();
        source.has_served(Duration::from_secs(3600 * 100), 0.5);
        assert!((source.energy.active - 50.0 * source.feed.total_active()).abs() < 1e-6);
        assert!(source.energy.inductive < source.energy.active);
    }

    #[test]
    fn a_switch_takes_its_time_and_counts_its_closings() {
        let mut switch = Mechanism::new(false, 7);
        switch.step(DT, Some(Drive::Close));
        switch.step(DT, Some(Drive::Close));
        assert!(!switch.closed);
        switch.step(DT, None);
        for _ in 0..3 {
            switch.step(DT, Some(Drive::Close));
        }
        assert_eq!((switch.closed, switch.closings), (true, 8));
        for _ in 0..3 {
            switch.step(DT, Some(Drive::Open));
        }
        assert_eq!((switch.closed, switch.closings), (false, 8));
        switch.jammed = true;
        for _ in 0..20 {
            switch.step(DT, Some(Drive::Close));
        }
        assert_eq!((switch.closed, switch.closings), (false, 8));
    }

    #[test]
    fn the_residual_is_what_the_phases_leave_over() {
        let mut source = Plant::new(4, Positions::of(1, 0, 1)).sources[0].clone();
        let (active, reactive) = ([800.0; 3], [300.0; 3]);
        source.feed = Feed { voltage: [5800.0; 3], frequency: 50.0, active, reactive, ..Feed::default() };
        assert!(source.residual().0 < 1e-6);
        source.feed.active[1] = 0.0;
        source.feed.reactive[1] = 0.0;
        assert!((source.residual().0 - source.feed.current()[0]).abs() < 1e-6);
    }
}
