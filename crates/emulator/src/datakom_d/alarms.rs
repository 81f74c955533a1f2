//! The three alarm arrays of a D-series unit, by the manual's bit numbers: what is active, what stays until somebody
//! resets it, and what of it takes the genset off.
//!
//! A shutdown and a load dump stay until they are reset; a warning goes with its cause, but for those that tell of a
//! moment: a breaker, a stop or a synchronizing that has failed, mains lost beside the genset.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::Controls;
use crate::settings;

use super::readings::Readings;
use super::sequence::{Failures, Trip};
use super::watch::{Class, EMERGENCY_STOP_INPUT, Situation, Watches};

const FAIL_TO_START: u16 = 98;
const FAIL_TO_STOP: u16 = 99;
const GENSET_BREAKER: BreakerBits =
    BreakerBits { to_close: (Class::LoadDump, 111), to_open: (Class::Warning, 112) };
const MAINS_BREAKER: BreakerBits =
    BreakerBits { to_close: (Class::Warning, 113), to_open: (Class::LoadDump, 114) };
/// What tells a genset beside the mains that these are gone, or must be left.
const G59: std::ops::RangeInclusive<u16> = 121..=125;
const SYNCHRONIZATION_FAIL: u16 = 128;
/// Those of services 2 and 3 follow.
pub(super) const SERVICE_1_REQUEST: u16 = 118;

const CLASSES: [Class; 3] = [Class::Shutdown, Class::LoadDump, Class::Warning];

/// What is wrong now.
#[derive(Clone, Debug)]
pub(super) struct Alarms {
    watches: Watches,
    genset_breaker: BreakerWatch,
    mains_breaker: BreakerWatch,
    breaker_fail: Duration,
    horn_time: Duration,
    horn: Duration,
    /// An alarm has come in this step.
    new: bool,
    /// What of [`G59`] is so now, and whether some of it has come in this step.
    losses: BitSet,
    loses_mains: bool,
    /// By class, as everything below.
    shown: [BitSet; 3],
    /// Whose cause is there, whether shown for longer or not.
    standing: [BitSet; 3],
    injected: [BitSet; 3],
}

impl Alarms {
    pub(super) fn new() -> Self {
        Self {
            watches: Watches::new(),
            genset_breaker: BreakerWatch::default(),
            mains_breaker: BreakerWatch::default(),
            breaker_fail: Duration::MAX,
            horn_time: Duration::ZERO,
            horn: Duration::ZERO,
            new: false,
            losses: BitSet::EMPTY,
            loses_mains: false,
            shown: [BitSet::EMPTY; 3],
            standing: [BitSet::EMPTY; 3],
            injected: [BitSet::EMPTY; 3],
        }
    }

    pub(super) fn configure(&mut self, settings: &settings::Settings) {
        self.watches.configure(settings);
        self.breaker_fail = settings.seconds("breaker_fail_time");
        self.horn_time = settings.seconds("horn_time");
    }

    /// Judges the plant, what the outputs told the breakers, and what went wrong in the sequence.
    pub(super) fn step(
        &mut self,
        dt: Duration,
        readings: &Readings,
        situation: Situation,
        breakers: &Breakers<'_>,
        failures: Failures,
    ) {
        self.horn = self.horn.saturating_sub(dt);
        self.watches.step(dt, readings, situation);
        let patience = self.breaker_fail;
        self.genset_breaker.step(dt, breakers.controls.genset_breaker, breakers.genset_closed, patience);
        self.mains_breaker.step(dt, breakers.controls.mains_breaker, breakers.mains_closed, patience);

        let mut standing = [BitSet::EMPTY; 3];
        let dumped = !self.shown[Class::LoadDump as usize].is_empty();
        let of_breakers = [
            self.genset_breaker.alarm(GENSET_BREAKER).map(|alarm| match alarm {
                // What cannot be unloaded cannot cool down either.
                (_, bit) if dumped && bit == GENSET_BREAKER.to_open.1 => (Class::Shutdown, bit),
                usual => usual,
            }),
            self.mains_breaker.alarm(MAINS_BREAKER),
        ];
        let watched = self.watches.active().map(|(class, bit)| match situation.lenient {
            true if bit != EMERGENCY_STOP_INPUT => (Class::Warning, bit),
            _ => (class, bit),
        });
        for (class, bit) in watched.chain(of_breakers.into_iter().flatten()) {
            standing[class as usize].insert(bit);
        }
        self.standing = standing;
        self.show(of_sequence(failures));
    }

    /// Takes an alarm for active whatever the plant says, or no longer.
    pub(super) fn inject(&mut self, class: Class, bit: u16, active: bool) {
        self.injected[class as usize].set(bit, active);
    }

    /// Forgets what stays although its cause is gone.
    pub(super) fn reset(&mut self) {
        for class in CLASSES.map(|class| class as usize) {
            self.shown[class] = self.standing[class].union(&self.injected[class]);
        }
        self.mute();
    }

    pub(super) fn mute(&mut self) {
        self.horn = Duration::ZERO;
    }

    /// A hard reset: everything is judged anew.
    pub(super) fn restart(&mut self) {
        (self.shown, self.standing) = ([BitSet::EMPTY; 3], [BitSet::EMPTY; 3]);
        self.genset_breaker = BreakerWatch::default();
        self.mains_breaker = BreakerWatch::default();
        self.mute();
    }

    pub(super) fn horn(&self) -> bool {
        !self.horn.is_zero()
    }

    /// Whether an alarm has come in the last step.
    pub(super) fn is_new(&self) -> bool {
        self.new
    }

    /// Whether the last step has brought a cause to leave the mains, shown for longer or not.
    pub(super) fn loses_mains(&self) -> bool {
        self.loses_mains
    }

    pub(super) fn of(&self, class: Class) -> BitSet {
        self.shown[class as usize]
    }

    /// How the genset is to be taken off, while it is.
    pub(super) fn trip(&self) -> Option<Trip> {
        match (self.of(Class::Shutdown).is_empty(), self.of(Class::LoadDump).is_empty()) {
            (false, _) => Some(Trip::Shutdown),
            (true, false) => Some(Trip::LoadDump),
            (true, true) => None,
        }
    }

    /// Whether the mains breaker has refused to close, so that the mains are of no use.
    pub(super) fn mains_breaker_refused(&self) -> bool {
        self.of(Class::Warning).contains(MAINS_BREAKER.to_close.1)
    }

    /// Brings what is shown up to date with what stands and what the sequence reports.
    fn show(&mut self, reported: [BitSet; 3]) {
        self.new = false;
        for class in CLASSES {
            let index = class as usize;
            let now = self.standing[index].union(&self.injected[index]).union(&reported[index]);
            let stays = match class {
                Class::Shutdown | Class::LoadDump => self.shown[index],
                Class::Warning => self.shown[index].intersection(&latched_warnings()),
            };
            self.new |= !now.difference(&self.shown[index]).is_empty();
            if class == Class::Warning {
                let losses = now.intersection(&G59.collect());
                self.loses_mains = !losses.difference(&self.losses).is_empty();
                self.losses = losses;
            }
            self.shown[index] = now.union(&stays);
        }
        if self.new {
            self.horn = self.horn_time;
        }
    }
}

/// The breakers as they were told to be and as they are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Breakers<'a> {
    pub(super) controls: &'a Controls,
    pub(super) genset_closed: bool,
    pub(super) mains_closed: bool,
}

/// What a breaker's refusals are shown as.
#[derive(Clone, Copy, Debug)]
struct BreakerBits {
    to_close: (Class, u16),
    to_open: (Class, u16),
}

/// A breaker whose feedback is held against its command.
#[derive(Clone, Debug, Default)]
struct BreakerWatch {
    differing: Duration,
    /// What it was told and did not do.
    refused: Option<bool>,
}

impl BreakerWatch {
    fn step(&mut self, dt: Duration, command: bool, closed: bool, patience: Duration) {
        self.differing = if command == closed { Duration::ZERO } else { self.differing + dt };
        self.refused = (self.differing >= patience).then_some(command);
    }

    fn alarm(&self, bits: BreakerBits) -> Option<(Class, u16)> {
        self.refused.map(|to_close| if to_close { bits.to_close } else { bits.to_open })
    }
}

/// Warnings that stay until they are reset.
fn latched_warnings() -> BitSet {
    let of_breakers = [GENSET_BREAKER.to_open.1, MAINS_BREAKER.to_close.1];
    of_breakers.into_iter().chain([FAIL_TO_STOP, SYNCHRONIZATION_FAIL]).chain(G59).collect()
}

fn of_sequence(failures: Failures) -> [BitSet; 3] {
    let set =
        |bits: &[(bool, u16)]| -> BitSet { bits.iter().filter(|(on, _)| *on).map(|(_, bit)| *bit).collect() };
    [
        set(&[(failures.to_start, FAIL_TO_START)]),
        set(&[(failures.to_parallel, SYNCHRONIZATION_FAIL)]),
        set(&[
            (failures.to_stop, FAIL_TO_STOP),
            (failures.to_synchronize && !failures.to_parallel, SYNCHRONIZATION_FAIL),
        ]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::Plant;

    const SECOND: Duration = Duration::from_secs(1);

    struct Unit {
        alarms: Alarms,
        readings: Readings,
        controls: Controls,
        closed: (bool, bool),
        failures: Failures,
    }

    impl Unit {
        fn new() -> Self {
            let mut alarms = Alarms::new();
            alarms.configure(&settings::Settings::of(busbar_profile::builtin("datakom-d").unwrap()));
            let controls = Controls { mains_breaker: true, ..Controls::default() };
            let readings = Readings::of(&Plant::new(1), 0.0);
            Self { alarms, readings, controls, closed: (false, true), failures: Failures::default() }
        }

        fn pass(&mut self, seconds: u32) {
            for _ in 0..seconds {
                let (genset_closed, mains_closed) = self.closed;
                let breakers = Breakers { controls: &self.controls, genset_closed, mains_closed };
                self.alarms.step(SECOND, &self.readings, Situation::default(), &breakers, self.failures);
            }
        }

        fn shown(&self, class: Class) -> Vec<u16> {
            self.alarms.of(class).iter().collect()
        }
    }

    #[test]
    fn a_shutdown_stays_until_it_is_reset_without_its_cause() {
        let mut unit = Unit::new();
        unit.readings.emergency_stop = true;
        unit.pass(1);
        assert_eq!((unit.shown(Class::Shutdown), unit.alarms.trip()), (vec![3], Some(Trip::Shutdown)));
        unit.alarms.reset();
        assert_eq!(unit.shown(Class::Shutdown), [3], "the button is still pressed");
        unit.readings.emergency_stop = false;
        unit.pass(1);
        assert_eq!(unit.shown(Class::Shutdown), [3]);
        unit.alarms.reset();
        assert_eq!((unit.shown(Class::Shutdown), unit.alarms.trip()), (vec![], None));
    }

    #[test]
    fn a_warning_goes_with_its_cause_and_the_horn_with_time() {
        let mut unit = Unit::new();
        unit.readings.fuel_level = Some(10.0);
        unit.pass(2);
        assert_eq!(unit.shown(Class::Warning), [58]);
        assert!(unit.alarms.horn() && unit.alarms.is_new());
        unit.pass(1);
        assert!(unit.alarms.horn() && !unit.alarms.is_new());
        unit.pass(60);
        assert!(!unit.alarms.horn());
        unit.readings.fuel_level = Some(60.0);
        unit.pass(1);
        assert!(unit.shown(Class::Warning).is_empty());
        assert_eq!(unit.alarms.trip(), None);
    }

    #[test]
    fn a_breaker_that_does_not_follow_is_found_out() {
        for (command, closed, class, bit) in [
            ((true, false), (false, false), Class::LoadDump, 111),
            ((false, false), (true, false), Class::Warning, 112),
            ((false, true), (false, false), Class::Warning, 113),
            ((false, false), (false, true), Class::LoadDump, 114),
        ] {
            let mut unit = Unit::new();
            (unit.controls.genset_breaker, unit.controls.mains_breaker) = command;
            unit.closed = closed;
            unit.pass(1);
            assert!(unit.shown(class).is_empty(), "a breaker takes its time");
            unit.pass(10);
            assert_eq!(unit.shown(class), [bit]);
            unit.closed = command;
            unit.pass(1);
            assert_eq!(unit.shown(class), [bit], "it stays until it is reset");
            unit.alarms.reset();
            assert!(unit.shown(class).is_empty());
        }
    }

    #[test]
    fn a_genset_that_can_neither_be_unloaded_nor_carry_is_shut_down() {
        let mut unit = Unit::new();
        unit.alarms.inject(Class::LoadDump, 107, true);
        unit.closed = (true, false);
        unit.controls.mains_breaker = false;
        unit.pass(10);
        assert_eq!(unit.alarms.trip(), Some(Trip::Shutdown));
        assert_eq!(unit.shown(Class::Shutdown), [112]);
    }

    #[test]
    fn failures_of_the_sequence_are_shown_by_class() {
        let mut unit = Unit::new();
        unit.failures = Failures { to_start: true, to_stop: true, to_synchronize: true, to_parallel: false };
        unit.pass(1);
        assert_eq!(unit.shown(Class::Shutdown), [98]);
        assert_eq!(unit.shown(Class::Warning), [99, 128]);
        unit.failures = Failures::default();
        unit.alarms.reset();
        unit.pass(1);
        assert!(unit.alarms.trip().is_none() && unit.shown(Class::Warning).is_empty());
    }

    #[test]
    fn an_injected_alarm_stands_until_it_is_taken_back_and_then_as_any_other() {
        let mut unit = Unit::new();
        unit.alarms.inject(Class::Warning, 101, true);
        unit.alarms.inject(Class::Shutdown, 54, true);
        unit.pass(1);
        unit.alarms.reset();
        assert_eq!((unit.shown(Class::Shutdown), unit.shown(Class::Warning)), (vec![54], vec![101]));
        unit.alarms.inject(Class::Warning, 101, false);
        unit.alarms.inject(Class::Shutdown, 54, false);
        unit.pass(1);
        assert_eq!((unit.shown(Class::Shutdown), unit.shown(Class::Warning)), (vec![54], vec![]));
        unit.alarms.reset();
        assert!(unit.shown(Class::Shutdown).is_empty());
    }
}
