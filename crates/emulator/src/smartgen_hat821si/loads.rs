//! The load switches of one bus section: they fall without voltage, and come back one after the other.

use std::time::Duration;

use busbar_profile::BitSet;

use super::plant::{Drive, FEEDERS};

/// How long an output drives a load switch until it has moved.
const MOVING: Duration = Duration::from_millis(400);
/// Without voltage for this long a load switch falls.
const RELEASE: Duration = Duration::from_secs(1);
/// Between two load switches that come back.
const PACE: Duration = Duration::from_secs(1);

/// One load switch.
#[derive(Clone, Copy, Debug)]
struct LoadSwitch {
    closed: bool,
    /// Where its output drives it, and how long it still takes.
    driven: Option<(bool, Duration)>,
    /// Its protection opened it; latched.
    tripped: bool,
    /// It fell with the voltage and is to come back.
    fallen: bool,
}

/// A section's load switches and what the controller does with them.
#[derive(Clone, Debug)]
pub(super) struct Loads {
    switches: [LoadSwitch; FEEDERS],
    dead_for: Duration,
    until_next: Duration,
    /// Somebody has said that the fallen ones may come back.
    confirmed: bool,
    /// The window asks whether they may.
    asks: bool,
    /// Number of the load switch that moves, or moved last.
    acted: u16,
    /// Number of the load switch that tripped last; 0 after a reset.
    trip_number: u16,
}

impl Loads {
    /// All of them closed.
    pub(super) fn new() -> Self {
        let closed = LoadSwitch { closed: true, driven: None, tripped: false, fallen: false };
        Self {
            switches: [closed; FEEDERS],
            dead_for: Duration::ZERO,
            until_next: Duration::ZERO,
            confirmed: false,
            asks: false,
            acted: 0,
            trip_number: 0,
        }
    }

    /// `alive`: the section has voltage. `auto`: the controller brings the fallen ones back by itself.
    pub(super) fn step(&mut self, dt: Duration, alive: bool, auto: bool) {
        self.move_switches(dt);
        if !alive {
            self.dead_for += dt;
            self.until_next = PACE;
            self.asks = false;
            if self.dead_for >= RELEASE {
                self.fall();
            }
            return;
        }
        self.dead_for = Duration::ZERO;
        let waiting = self.switches.iter().any(|switch| switch.fallen);
        if !waiting {
            self.confirmed = false;
        }
        self.asks = waiting && !auto && !self.confirmed;
        self.until_next = self.until_next.saturating_sub(dt);
        if waiting && !self.asks && self.until_next.is_zero() {
            self.bring_back();
        }
    }

    fn move_switches(&mut self, dt: Duration) {
        for switch in &mut self.switches {
            let Some((closed, left)) = &mut switch.driven else { continue };
            *left = left.saturating_sub(dt);
            if left.is_zero() {
                switch.closed = *closed;
                switch.driven = None;
            }
        }
    }

    fn fall(&mut self) {
        self.confirmed = false;
        for switch in &mut self.switches {
            switch.fallen |= switch.closed;
            switch.closed = false;
            switch.driven = None;
        }
    }

    fn bring_back(&mut self) {
        if let Some((number, switch)) = (1..).zip(&mut self.switches).find(|(_, switch)| switch.fallen) {
            switch.fallen = false;
            switch.driven = Some((true, MOVING));
            self.acted = number;
            self.until_next = PACE;
        }
    }

    /// Drives one load switch, 0 to 11. One that tripped, or has no voltage, does not close.
    pub(super) fn drive(&mut self, index: usize, close: bool) {
        let dead = !self.dead_for.is_zero();
        let Some(switch) = self.switches.get_mut(index) else { return };
        if close && (dead || switch.tripped) {
            return;
        }
        switch.fallen = false;
        switch.driven = (switch.closed != close).then_some((close, MOVING));
        if switch.driven.is_some() {
            self.acted = index as u16 + 1;
        }
    }

    /// The protection of one opens it.
    pub(super) fn trip(&mut self, index: usize) {
        let Some(switch) = self.switches.get_mut(index) else { return };
        *switch = LoadSwitch { closed: false, driven: None, tripped: true, fallen: false };
        self.trip_number = index as u16 + 1;
        self.acted = self.trip_number;
    }

    /// Forgets the trips; what is open stays open.
    pub(super) fn acknowledge(&mut self) {
        self.trip_number = 0;
        for switch in &mut self.switches {
            switch.tripped = false;
        }
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
        let driven = |close| !self.driven(close).is_empty();
        let comes_back =
            !self.asks && self.dead_for.is_zero() && self.switches.iter().any(|switch| switch.fallen);
        if driven(false) { Some(Drive::Open) } else { (driven(true) || comes_back).then_some(Drive::Close) }
    }

    pub(super) fn acted(&self) -> u16 {
        self.acted
    }

    pub(super) fn trip_number(&self) -> u16 {
        self.trip_number
    }

    /// Which ones carry current.
    pub(super) fn connected(&self) -> [bool; FEEDERS] {
        self.switches.map(|switch| switch.closed)
    }

    pub(super) fn closed(&self) -> BitSet {
        self.those(|switch| switch.closed)
    }

    pub(super) fn tripped(&self) -> BitSet {
        self.those(|switch| switch.tripped)
    }

    /// Whose closing or opening output is on.
    pub(super) fn driven(&self, close: bool) -> BitSet {
        self.those(|switch| switch.driven.is_some_and(|(closing, _)| closing == close))
    }

    fn those(&self, which: impl Fn(&LoadSwitch) -> bool) -> BitSet {
        (0..).zip(&self.switches).filter(|(_, switch)| which(switch)).map(|(bit, _)| bit).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn run(loads: &mut Loads, tenths: u32, alive: bool, auto: bool) {
        for _ in 0..tenths {
            loads.step(TENTH, alive, auto);
        }
    }

    #[test]
    fn a_short_gap_drops_nothing_a_long_one_all() {
        let mut loads = Loads::new();
        run(&mut loads, 9, false, true);
        assert_eq!(loads.closed().len(), 12);
        run(&mut loads, 1, false, true);
        assert!(loads.closed().is_empty());
    }

    #[test]
    fn in_auto_they_come_back_one_a_second() {
        let mut loads = Loads::new();
        run(&mut loads, 20, false, true);
        let mut counts = Vec::new();
        for _ in 0..13 {
            run(&mut loads, 10, true, true);
            counts.push((loads.closed().len(), loads.acted()));
        }
        assert_eq!(counts[..3], [(0, 1), (1, 2), (2, 3)], "the number is that of the one that moves");
        assert_eq!(counts[12], (12, 12));
        assert!(loads.steps().is_none() && !loads.asks());
    }

    #[test]
    fn in_manual_the_window_asks_first() {
        let mut loads = Loads::new();
        run(&mut loads, 20, false, false);
        run(&mut loads, 50, true, false);
        assert!(loads.asks() && loads.steps().is_none() && loads.closed().is_empty());
        loads.answer(true);
        run(&mut loads, 200, true, false);
        assert_eq!((loads.closed().len(), loads.asks()), (12, false));

        run(&mut loads, 20, false, false);
        run(&mut loads, 10, true, false);
        loads.answer(false);
        run(&mut loads, 200, true, false);
        assert_eq!((loads.closed().len(), loads.asks()), (0, false));
    }

    #[test]
    fn one_that_was_opened_stays_open_and_a_tripped_one_does_not_close() {
        let mut loads = Loads::new();
        loads.drive(4, false);
        assert_eq!(loads.driven(false).iter().collect::<Vec<_>>(), [4]);
        assert_eq!((loads.steps(), loads.acted()), (Some(Drive::Open), 5));
        run(&mut loads, 4, true, true);
        assert_eq!((loads.closed().len(), loads.acted()), (11, 5));
        loads.trip(6);
        loads.drive(6, true);
        run(&mut loads, 20, false, true);
        run(&mut loads, 200, true, true);
        assert_eq!(loads.closed().len(), 10);
        assert_eq!((loads.tripped().iter().collect::<Vec<_>>(), loads.trip_number()), (vec![6], 7));
        loads.acknowledge();
        loads.drive(6, true);
        loads.drive(4, true);
        run(&mut loads, 4, true, true);
        assert_eq!((loads.closed().len(), loads.trip_number()), (12, 0));
    }

    #[test]
    fn nothing_closes_without_voltage() {
        let mut loads = Loads::new();
        run(&mut loads, 20, false, true);
        loads.drive(0, true);
        assert!(loads.driven(true).is_empty());
    }
}
