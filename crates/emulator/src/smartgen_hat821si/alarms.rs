//! The alarms of the controller: what is active, what is latched, what somebody injects, and what follows from others.
//!
//! A fault stays until it is reset, a warning as long as its cause.

use std::collections::BTreeSet;

use busbar_profile::BitSet;

use super::switches::{Drive, FEEDERS, Switch};

/// One alarm by the address of its word and its bit there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Alarm {
    word: u16,
    bit: u16,
}

impl Alarm {
    pub(super) const GROUND_FAULT: Self = Self::at(503, 3);
    pub(super) const FORCED_OPEN_FAULT: Self = Self::at(503, 10);
    pub(super) const SYNC_FAULT: Self = Self::at(503, 14);
    pub(super) const FORCED_OPEN_WARNING: Self = Self::at(504, 2);
    pub(super) const OVERLOAD: Self = Self::at(504, 3);
    pub(super) const SYNC_WARNING: Self = Self::at(504, 5);
    pub(super) const GROUND_WARNING: Self = Self::at(504, 7);
    pub(super) const PARALLEL: Self = Self::at(504, 11);

    const fn at(word: u16, bit: u16) -> Self {
        Self { word, bit }
    }

    /// A switch that did not close, or did not open.
    pub(super) fn stuck(switch: Switch, drive: Drive) -> Self {
        match (switch, drive) {
            (Switch::Qs1, Drive::Close) => Self::at(503, 1),
            (Switch::Qs1, Drive::Open) => Self::at(503, 2),
            (Switch::Qs2, Drive::Close) => Self::at(503, 4),
            (Switch::Qs2, Drive::Open) => Self::at(503, 5),
            (Switch::Qtie, Drive::Close) => Self::at(504, 12),
            (Switch::Qtie, Drive::Open) => Self::at(504, 13),
        }
    }

    /// A switch that has opened by itself.
    pub(super) fn tripped(switch: Switch) -> Self {
        match switch {
            Switch::Qs1 => Self::at(504, 14),
            Switch::Qs2 => Self::at(504, 15),
            Switch::Qtie => Self::at(503, 15),
        }
    }

    /// The relay of a source's switch has operated. Sources are 0 and 1.
    pub(super) fn short_circuit(source: usize) -> Self {
        Self::of_source(source, [(503, 6), (503, 7)])
    }

    pub(super) fn overcurrent_trip(source: usize) -> Self {
        Self::of_source(source, [(503, 8), (503, 9)])
    }

    pub(super) fn overcurrent_warning(source: usize) -> Self {
        Self::of_source(source, [(504, 0), (504, 1)])
    }

    pub(super) fn genset(source: usize) -> Self {
        Self::of_source(source, [(503, 11), (503, 12)])
    }

    pub(super) fn broken_wire(source: usize) -> Self {
        Self::of_source(source, [(504, 4), (504, 6)])
    }

    pub(super) fn reverse_power(source: usize) -> Self {
        Self::of_source(source, [(511, 12), (511, 13)])
    }

    fn of_source(source: usize, [first, second]: [(u16, u16); 2]) -> Self {
        let (word, bit) = if source == 0 { first } else { second };
        Self::at(word, bit)
    }

    /// An expansion module that is silent: a fault, or a warning. The number is its bit.
    pub(super) fn module(bit: u16, is_fault: bool) -> Self {
        Self::at(if is_fault { 511 } else { 512 }, bit)
    }

    /// A load switch that did not close, or did not open. Sides are 0 and 1.
    pub(super) fn feeder_stuck(side: usize, feeder: usize, drive: Drive) -> Self {
        Self::of_feeder(if drive.closes() { 523 } else { 525 }, side, feeder)
    }

    pub(super) fn feeder_tripped(side: usize, feeder: usize) -> Self {
        Self::of_feeder(527, side, feeder)
    }

    fn of_feeder(word: u16, side: usize, feeder: usize) -> Self {
        Self::at(word + side as u16, feeder as u16)
    }

    /// A fault stays until it is reset.
    fn is_fault(self) -> bool {
        FAULTS.contains(&self.word)
            || self.word == 504 && FAULTS_OF_504.contains(&self.bit)
            || self.word == 511 && FAULTS_OF_511.contains(&self.bit)
    }
}

/// Words that hold alarms.
pub(super) const WORDS: [u16; 10] = [503, 504, 511, 512, 523, 524, 525, 526, 527, 528];
/// Words whose bits are all faults.
pub(super) const FAULTS: [u16; 7] = [503, 523, 524, 525, 526, 527, 528];
/// Bits of word 504 that are faults; its others are warnings.
pub(super) const FAULTS_OF_504: [u16; 5] = [9, 12, 13, 14, 15];
/// Bits of word 511 that are faults; its others are warnings.
pub(super) const FAULTS_OF_511: [u16; 4] = [12, 13, 14, 15];

/// Alarms that follow from others, so that nobody can inject them.
const DERIVED: [Alarm; 8] = [
    Alarm::at(503, 0),
    Alarm::at(503, 13),
    Alarm::at(504, 9),
    Alarm::at(511, 14),
    Alarm::at(511, 15),
    Alarm::at(512, 6),
    Alarm::at(512, 14),
    Alarm::at(512, 15),
];

/// All that are active.
#[derive(Clone, Debug, Default)]
pub(super) struct Board {
    latched: BTreeSet<Alarm>,
    standing: BTreeSet<Alarm>,
    injected: BTreeSet<Alarm>,
    /// A load switch that does not move is a fault, not a warning.
    pub(super) feeder_faults: bool,
}

impl Board {
    pub(super) fn has(&self, alarm: Alarm) -> bool {
        self.latched.contains(&alarm) || self.standing.contains(&alarm) || self.injected.contains(&alarm)
    }

    /// A fault: until somebody resets it.
    pub(super) fn latch(&mut self, alarm: Alarm) {
        self.latched.insert(alarm);
    }

    /// A warning: as long as its cause is there.
    pub(super) fn follow(&mut self, alarm: Alarm, is_so: bool) {
        if is_so {
            self.standing.insert(alarm);
        } else {
            self.standing.remove(&alarm);
        }
    }

    pub(super) fn reset(&mut self) {
        self.latched.clear();
    }

    /// False where the alarm follows from others.
    pub(super) fn inject(&mut self, word: u16, bit: u16, active: bool) -> bool {
        let alarm = Alarm::at(word, bit);
        if DERIVED.contains(&alarm) || !WORDS.contains(&word) {
            return false;
        }
        if active {
            self.injected.insert(alarm);
            if alarm.is_fault() {
                self.latched.insert(alarm);
            }
        } else {
            self.injected.remove(&alarm);
        }
        true
    }

    /// All of them, without those that follow from others.
    pub(super) fn active(&self) -> BTreeSet<Alarm> {
        [&self.latched, &self.standing, &self.injected].into_iter().flatten().copied().collect()
    }

    /// The bits of one word, with those that follow.
    pub(super) fn word(&self, word: u16) -> BitSet {
        let own = self.active().into_iter().filter(|alarm| alarm.word == word).map(|alarm| alarm.bit);
        let derived = DERIVED.into_iter().filter(|alarm| alarm.word == word && self.follows(*alarm));
        own.chain(derived.map(|alarm| alarm.bit)).collect()
    }

    fn follows(&self, derived: Alarm) -> bool {
        let any_switch =
            |alarm: fn(Switch) -> Alarm| Switch::ALL.iter().any(|switch| self.has(alarm(*switch)));
        match (derived.word, derived.bit) {
            (503, 0) => Switch::OF_SOURCES.iter().any(|switch| {
                [Drive::Close, Drive::Open].iter().any(|drive| self.has(Alarm::stuck(*switch, *drive)))
            }),
            (503, 13) => any_switch(Alarm::tripped),
            (504, 9) => (0..2).any(|source| self.has(Alarm::genset(source))),
            (511, bit) => self.feeder_faults && self.feeders_stick(usize::from(bit - 14)),
            (512, 6) => (0..2).any(|side| (0..FEEDERS).any(|it| self.has(Alarm::feeder_tripped(side, it)))),
            (512, bit) => !self.feeder_faults && self.feeders_stick(usize::from(bit - 14)),
            _ => false,
        }
    }

    fn feeders_stick(&self, side: usize) -> bool {
        (0..FEEDERS).any(|feeder| self.feeder_sticks(side, feeder))
    }

    /// A load switch that did not move when it should have.
    pub(super) fn feeder_sticks(&self, side: usize, feeder: usize) -> bool {
        [Drive::Close, Drive::Open].iter().any(|drive| self.has(Alarm::feeder_stuck(side, feeder, *drive)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(board: &Board, word: u16) -> Vec<u16> {
        board.word(word).iter().collect()
    }

    #[test]
    fn faults_stay_until_reset_and_warnings_with_their_cause() {
        let mut board = Board::default();
        board.latch(Alarm::GROUND_FAULT);
        board.follow(Alarm::OVERLOAD, true);
        assert_eq!((bits(&board, 503), bits(&board, 504), board.active().len()), (vec![3], vec![3], 2));
        board.reset();
        assert!(!board.has(Alarm::GROUND_FAULT) && board.has(Alarm::OVERLOAD));
        board.follow(Alarm::OVERLOAD, false);
        assert_eq!(board.active().len(), 0);
    }

    #[test]
    fn an_injected_alarm_outlasts_a_reset() {
        let mut board = Board::default();
        assert!(board.inject(503, 1, true) && board.inject(504, 3, true));
        board.reset();
        assert!(board.has(Alarm::stuck(Switch::Qs1, Drive::Close)));
        assert!(board.inject(503, 1, true), "once more");
        assert!(board.inject(503, 1, false) && board.inject(504, 3, false));
        assert_eq!(bits(&board, 503), [0, 1], "a fault stays until it is reset");
        assert!(bits(&board, 504).is_empty(), "a warning does not");
        board.reset();
        assert_eq!(board.active().len(), 0);
    }

    #[test]
    fn what_follows_from_others_follows_and_cannot_be_injected() {
        for (word, bit, causes) in [
            (503, 0, vec![(503, 1), (503, 2), (503, 4), (503, 5)]),
            (503, 13, vec![(504, 14), (504, 15), (503, 15)]),
            (504, 9, vec![(503, 11), (503, 12)]),
            (512, 6, vec![(527, 0), (528, 11)]),
            (512, 14, vec![(523, 2), (525, 3)]),
            (512, 15, vec![(524, 2), (526, 3)]),
        ] {
            for cause in causes {
                let mut board = Board::default();
                assert!(!board.inject(word, bit, true));
                assert!(bits(&board, word).is_empty());
                assert!(board.inject(cause.0, cause.1, true));
                assert!(bits(&board, word).contains(&bit), "{word}.{bit} from {cause:?}");
            }
        }
        let mut board = Board { feeder_faults: true, ..Board::default() };
        board.latch(Alarm::feeder_stuck(1, 4, Drive::Open));
        assert_eq!((bits(&board, 511), bits(&board, 512)), (vec![15], vec![]));
    }
}
