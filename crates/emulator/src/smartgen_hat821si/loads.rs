//! The load switches of one bus section: they fall without voltage, come back one after the other by their priority, are
//! taken off when their source carries too much, and have to move when they are told to.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::settings::Settings;

use super::alarms::{Alarm, Board};
use super::inputs::Heard;
use super::switches::{Drive, FEEDERS};
use super::timer::Countdown;

/// Delays and priorities as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    /// Between two load switches that come back.
    pace: Duration,
    /// How long an output drives one until it has failed.
    moving: Duration,
    /// Somebody has to confirm in manual mode that they may come back.
    asks: bool,
    /// By side: 1 comes back first and is taken off last, 0 neither by itself.
    priorities: [[u8; FEEDERS]; 2],
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        let priority = |side: usize, feeder: usize| {
            settings.number(&format!("load_{}_{}_priority", side + 1, feeder + 1)) as u8
        };
        Self {
            pace: settings.seconds("load_interval"),
            moving: settings.seconds("load_switch_time"),
            asks: settings.is_on("stepwise_confirmation"),
            priorities: [0, 1].map(|side| std::array::from_fn(|feeder| priority(side, feeder))),
        }
    }

    /// Between two load switches that move by themselves.
    pub(super) fn pace(&self) -> Duration {
        self.pace
    }
}

/// What the controller does with one load switch.
#[derive(Clone, Copy, Debug, Default)]
struct Handling {
    /// As it was heard last.
    closed: bool,
    driven: Option<(Drive, Countdown)>,
    /// It fell with the voltage and is to come back.
    fallen: bool,
    /// The source, 0 or 1, that could not carry it.
    unloaded: Option<usize>,
    /// It comes back after it had been taken off.
    recovers: bool,
}

impl Handling {
    fn drive(&mut self, drive: Drive, limits: &Limits) {
        self.driven = Some((drive, Countdown::of(limits.moving)));
    }
}

/// What a section's load switches act upon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around<'a> {
    pub(super) heard: Heard,
    /// The section has voltage.
    pub(super) alive: bool,
    /// The controller brings the fallen ones back by itself.
    pub(super) auto: bool,
    /// The source that feeds the section can carry no more: 0 or 1.
    pub(super) full: Option<usize>,
    pub(super) limits: &'a Limits,
}

/// A section's load switches and what the controller does with them.
#[derive(Clone, Debug)]
pub(super) struct Loads {
    /// 0 for section 1, 1 for section 2.
    side: usize,
    switches: [Handling; FEEDERS],
    dead_for: Duration,
    until_next: Countdown,
    /// Somebody has said that the fallen ones may come back.
    confirmed: bool,
    /// The window asks whether they may.
    asks: bool,
    /// Number of the load switch that moves, or moved last.
    acted: u16,
    /// Number of the load switch that tripped last.
    trip_number: u16,
    /// Number of the load switch that did not move last.
    failure_number: u16,
}

impl Loads {
    /// All of them closed.
    pub(super) fn new(side: usize) -> Self {
        Self {
            side,
            switches: [Handling { closed: true, ..Handling::default() }; FEEDERS],
            dead_for: Duration::ZERO,
            until_next: Countdown::default(),
            confirmed: false,
            asks: false,
            acted: 0,
            trip_number: 0,
            failure_number: 0,
        }
    }

    pub(super) fn step(&mut self, dt: Duration, around: Around<'_>, board: &mut Board) {
        // One that falls in the moment in which the voltage comes back has fallen too.
        let dead = !around.alive || !self.dead_for.is_zero();
        self.dead_for = if around.alive { Duration::ZERO } else { self.dead_for + dt };
        for feeder in 0..FEEDERS {
            self.take_trip(feeder, around, board);
            self.hear(feeder, dead, around);
            self.supervise(feeder, dt, board);
        }
        self.until_next.step(dt);
        if !around.alive {
            self.give_up_closing();
            self.until_next = Countdown::of(around.limits.pace);
            (self.asks, self.confirmed) = (false, false);
            return;
        }
        let waiting = self.switches.iter().any(|switch| switch.fallen);
        if !waiting {
            self.confirmed = false;
        }
        self.asks = waiting && !around.auto && around.limits.asks && !self.confirmed;
        if waiting && !self.asks && self.until_next.is_over() {
            self.bring_back(around, board);
        }
    }

    /// The protection of one has opened it, or somebody says so.
    fn take_trip(&mut self, feeder: usize, around: Around<'_>, board: &mut Board) {
        let alarm = Alarm::feeder_tripped(self.side, feeder);
        let new = !board.has(alarm);
        if around.heard.tripped[feeder] {
            board.latch(alarm);
        }
        if !board.has(alarm) {
            return;
        }
        let number = feeder as u16 + 1;
        let switch = &mut self.switches[feeder];
        (switch.fallen, switch.unloaded, switch.recovers) = (false, None, false);
        if new || self.trip_number == 0 {
            self.trip_number = number;
        }
        if around.heard.closed[feeder] {
            let opens = matches!(switch.driven, Some((Drive::Open, _)));
            if !opens && !board.feeder_sticks(self.side, feeder) {
                switch.drive(Drive::Open, around.limits);
                self.acted = number;
            }
        } else {
            switch.driven = None;
        }
    }

    /// `dead` says that the section has no voltage, or had none a moment ago.
    fn hear(&mut self, feeder: usize, dead: bool, around: Around<'_>) {
        let switch = &mut self.switches[feeder];
        let (was, is) = (switch.closed, around.heard.closed[feeder]);
        switch.closed = is;
        let opened_by_us = matches!(switch.driven, Some((Drive::Open, _)));
        if was && !is && !opened_by_us {
            switch.driven = None;
            switch.fallen = dead && around.heard.in_work[feeder] && !around.heard.tripped[feeder];
        }
        if is {
            switch.fallen = false;
        }
        if switch.driven.is_some_and(|(drive, _)| drive.closes() == is) {
            switch.driven = None;
            switch.recovers = false;
            if is {
                switch.unloaded = None;
            }
        }
    }

    fn supervise(&mut self, feeder: usize, dt: Duration, board: &mut Board) {
        let switch = &mut self.switches[feeder];
        if let Some((drive, left)) = &mut switch.driven {
            left.step(dt);
            if left.is_over() {
                board.latch(Alarm::feeder_stuck(self.side, feeder, *drive));
                self.failure_number = feeder as u16 + 1;
                (switch.driven, switch.recovers) = (None, false);
            }
        }
    }

    /// Without voltage none closes: it waits with those that fell.
    fn give_up_closing(&mut self) {
        for switch in &mut self.switches {
            if matches!(switch.driven, Some((Drive::Close, _))) {
                switch.driven = None;
                switch.fallen = switch.unloaded.is_none();
                switch.recovers = false;
            }
        }
    }

    fn bring_back(&mut self, around: Around<'_>, board: &Board) {
        let priorities = &around.limits.priorities[self.side];
        for (switch, priority) in self.switches.iter_mut().zip(priorities) {
            switch.fallen &= *priority > 0;
        }
        let sticks = |feeder: usize| board.feeder_sticks(self.side, feeder);
        for feeder in 0..FEEDERS {
            if sticks(feeder) {
                self.switches[feeder].fallen = false;
            }
        }
        if let Some(source) = around.full {
            // What there is no room for waits until there is.
            for switch in self.switches.iter_mut().filter(|switch| switch.fallen) {
                (switch.fallen, switch.unloaded) = (false, Some(source));
            }
            return;
        }
        let fallen = (0..FEEDERS).filter(|feeder| self.switches[*feeder].fallen);
        if let Some(feeder) = fallen.min_by_key(|feeder| priorities[*feeder]) {
            self.switches[feeder].fallen = false;
            self.switches[feeder].drive(Drive::Close, around.limits);
            self.acted = feeder as u16 + 1;
            self.until_next = Countdown::of(around.limits.pace);
        }
    }

    /// Drives one load switch, 0 to 11. One that tripped, did not move or has no voltage does not close.
    pub(super) fn drive(&mut self, index: usize, drive: Drive, limits: &Limits, board: &Board) {
        let dead = !self.dead_for.is_zero();
        let tripped = board.has(Alarm::feeder_tripped(self.side, index));
        let sticks = board.feeder_sticks(self.side, index);
        let Some(switch) = self.switches.get_mut(index) else { return };
        if sticks || drive.closes() && (dead || tripped) {
            return;
        }
        (switch.fallen, switch.unloaded, switch.recovers) = (false, None, false);
        switch.driven = None;
        if switch.closed != drive.closes() {
            switch.drive(drive, limits);
            self.acted = index as u16 + 1;
        }
    }

    /// The load switch to take off next, with its priority: the least important one that carries.
    pub(super) fn least_important(&self, around: Around<'_>, board: &Board) -> Option<(u8, usize)> {
        let carries = |feeder: &usize| {
            let switch = &self.switches[*feeder];
            switch.closed
                && switch.driven.is_none()
                && around.heard.in_work[*feeder]
                && !board.feeder_sticks(self.side, *feeder)
        };
        let with_priority = |feeder: usize| (around.limits.priorities[self.side][feeder], feeder);
        (0..FEEDERS).filter(carries).map(with_priority).filter(|(priority, _)| *priority > 0).max()
    }

    /// The load switch to bring back next after it had been taken off, with its priority.
    pub(super) fn most_important(&self, around: Around<'_>, board: &Board) -> Option<(u8, usize)> {
        let waits = |feeder: &usize| {
            let switch = &self.switches[*feeder];
            switch.unloaded.is_some() && switch.driven.is_none() && !board.feeder_sticks(self.side, *feeder)
        };
        let with_priority = |feeder: usize| (around.limits.priorities[self.side][feeder], feeder);
        (0..FEEDERS).filter(waits).map(with_priority).min()
    }

    /// Takes one off that its source cannot carry.
    pub(super) fn unload(&mut self, index: usize, source: usize, limits: &Limits) {
        if let Some(switch) = self.switches.get_mut(index) {
            switch.unloaded = Some(source);
            switch.drive(Drive::Open, limits);
            self.acted = index as u16 + 1;
        }
    }

    /// Brings one back that had been taken off.
    pub(super) fn recover(&mut self, index: usize, limits: &Limits) {
        if let Some(switch) = self.switches.get_mut(index) {
            switch.recovers = true;
            switch.drive(Drive::Close, limits);
            self.acted = index as u16 + 1;
        }
    }

    /// One moves at this moment.
    pub(super) fn moves(&self) -> bool {
        self.switches.iter().any(|switch| switch.driven.is_some())
    }

    /// Forgets what has been reset; what is open stays open.
    pub(super) fn acknowledge(&mut self) {
        (self.trip_number, self.failure_number) = (0, 0);
    }

    /// The answer to the window: the fallen ones come back, or stay open.
    pub(super) fn answer(&mut self, confirm: bool) {
        if !self.asks {
            return;
        }
        self.asks = false;
        self.confirmed = confirm;
        if !confirm {
            for switch in &mut self.switches {
                switch.fallen = false;
            }
        }
    }

    pub(super) fn asks(&self) -> bool {
        self.asks
    }

    /// Load switches open or close one after the other.
    pub(super) fn steps(&self) -> Option<Drive> {
        let driven = |drive| !self.driven(drive).is_empty();
        let comes_back =
            !self.asks && self.dead_for.is_zero() && self.switches.iter().any(|switch| switch.fallen);
        if driven(Drive::Open) {
            Some(Drive::Open)
        } else {
            (driven(Drive::Close) || comes_back).then_some(Drive::Close)
        }
    }

    /// What the outputs do.
    pub(super) fn drives(&self) -> [Option<Drive>; FEEDERS] {
        self.switches.map(|switch| switch.driven.map(|(drive, _)| drive))
    }

    pub(super) fn acted(&self) -> u16 {
        self.acted
    }

    pub(super) fn trip_number(&self) -> u16 {
        self.trip_number
    }

    pub(super) fn failure_number(&self) -> u16 {
        self.failure_number
    }

    /// Whose closing or opening output is on.
    pub(super) fn driven(&self, drive: Drive) -> BitSet {
        self.those(|switch| switch.driven.is_some_and(|(driven, _)| driven == drive))
    }

    /// Those that a source, or any, could not carry.
    pub(super) fn unloaded(&self, by: Option<usize>) -> BitSet {
        self.those(|switch| switch.unloaded.is_some_and(|source| by.is_none_or(|by| by == source)))
    }

    /// Those of them that come back now.
    pub(super) fn recovering(&self, by: Option<usize>) -> BitSet {
        let taken_off = self.unloaded(by);
        self.those(|switch| switch.recovers).intersection(&taken_off)
    }

    fn those(&self, which: impl Fn(&Handling) -> bool) -> BitSet {
        (0..).zip(&self.switches).filter(|(_, switch)| which(switch)).map(|(bit, _)| bit).collect()
    }
}

#[cfg(test)]
mod tests;
