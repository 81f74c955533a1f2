//! The switchgear: two 10 kV sources, three switches between two bus sections, and what the sections feed.
//!
//! QS1 puts source 1 on section 1, QS2 source 2 on section 2, QTIE joins the sections. Behind source 2 stands a
//! genset that takes over its terminals while its mains are dead.

use std::f64::consts::TAU;

use crate::plant::{Energy, Feed};
use crate::random::{Drift, Random, approach};

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
        for (index, source) in self.sources.iter_mut().enumerate() {
            source.step(dt, genset && index == 1, &mut self.random);
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
    frequency: Drift,
    /// Part of its voltage that each phase has now.
    parts: [f64; 3],
}

impl Source {
    fn new(random: &mut Random) -> Self {
        let active = random.between(2.0e6, 9.0e6);
        Self {
            feed: Feed::default(),
            angle: random.between(0.0, 360.0),
            energy: Energy { active, inductive: active * 0.41, ..Energy::default() },
            trouble: Trouble::Nothing,
            level: Drift::new(25.0, 180.0, random),
            phases: std::array::from_fn(|_| Drift::new(9.0, 15.0, random)),
            frequency: Drift::new(0.012, 8.0, random),
            parts: [1.0; 3],
        }
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

    /// Degrees of each phase's current, 0 to 360.
    pub(super) fn current_angles(&self) -> [f64; 3] {
        let angles = self.angles();
        std::array::from_fn(|phase| {
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

    fn step(&mut self, dt: f64, genset: bool, random: &mut Random) {
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
        // A genset gives way under load, the grid does not.
        let droop = if from_genset { 0.25 - 0.0002 * self.feed.total_active() } else { 0.0 };
        let frequency = RATED_FREQUENCY + self.frequency.step(dt, random) + droop;
        self.feed.frequency = if self.is_present() { frequency } else { 0.0 };
        self.angle = (self.angle + 360.0 * (frequency - RATED_FREQUENCY) * dt).rem_euclid(360.0);
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

/// kW and kvar of each phase that a section takes at full voltage.
#[derive(Clone, Copy, Debug)]
struct Demand {
    active: [f64; 3],
    reactive: [f64; 3],
}

/// What hangs on one bus section.
#[derive(Clone, Debug)]
struct Section {
    /// kW of each load switch.
    feeders: [f64; FEEDERS],
    level: Drift,
    power_factor: Drift,
    shares: [Drift; 3],
}

impl Section {
    fn new(random: &mut Random) -> Self {
        Self {
            feeders: std::array::from_fn(|_| random.between(110.0, 260.0)),
            level: Drift::new(0.03, 60.0, random),
            power_factor: Drift::new(0.008, 60.0, random),
            shares: std::array::from_fn(|_| Drift::new(0.004, 45.0, random)),
        }
    }

    fn step(&mut self, dt: f64, closed: &[bool; FEEDERS], random: &mut Random) -> Demand {
        let level = 1.0 + self.level.step(dt, random);
        let power_factor = 0.92 + self.power_factor.step(dt, random);
        let reactive_part = (1.0 - power_factor * power_factor).sqrt() / power_factor;
        let connected = self.feeders.iter().zip(closed).filter(|(_, closed)| **closed);
        let total = level * connected.map(|(kw, _)| kw).sum::<f64>();

        let mut shares = [0.337, 0.333, 0.330];
        for (share, drift) in shares.iter_mut().zip(&mut self.shares) {
            *share += drift.step(dt, random);
        }
        let whole: f64 = shares.iter().sum();
        let active = shares.map(|share| total * share / whole);
        Demand { active, reactive: active.map(|kw| kw * reactive_part) }
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
        source.feed = Feed { voltage: [5800.0; 3], frequency: 50.0, active, reactive };
        assert!(source.residual().0 < 1e-6);
        source.feed.active[1] = 0.0;
        source.feed.reactive[1] = 0.0;
        assert!((source.residual().0 - source.feed.current()[0]).abs() < 1e-6);
    }
}
