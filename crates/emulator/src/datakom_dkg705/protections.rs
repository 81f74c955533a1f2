//! What parts the genset from mains with which it runs in parallel: warnings 9 to 13 of register 0037h.

use std::time::Duration;

use busbar_profile::BitSet;

use crate::plant::{Feed, RATED_KW};

use super::parameters::{MainsLimits, ParallelLimits};

pub(super) const REVERSE_POWER: u16 = 9;
pub(super) const FREQUENCY: u16 = 10;
pub(super) const NO_FREQUENCY: u16 = 11;
pub(super) const ROCOF: u16 = 12;
pub(super) const VECTOR_SHIFT: u16 = 13;

/// Steps over which the frequency's rate of change is taken.
const WINDOW: usize = 4;
/// Degrees by which a step of rated load turns the rotor against the busbar.
const LOAD_ANGLE: f64 = 40.0;
/// How long power must flow back.
const REVERSE_AFTER: Duration = Duration::from_millis(500);

/// What they have seen since the two were joined.
#[derive(Clone, Debug, Default)]
pub(super) struct Protections {
    joined: Duration,
    reversed: Duration,
    /// Hz, the newest last.
    frequencies: [f64; WINDOW + 1],
    genset_power: f64,
    tripped: BitSet,
}

impl Protections {
    /// The bits of those that tripped, until the mains are trusted again.
    pub(super) fn tripped(&self) -> BitSet {
        self.tripped
    }

    /// The mains are trusted: what was, is over.
    pub(super) fn forget(&mut self) {
        self.tripped = BitSet::EMPTY;
    }

    /// Looks at both feeds; true where the two must part at once.
    pub(super) fn step(
        &mut self,
        dt: Duration,
        joined: bool,
        (mains, genset): (&Feed, &Feed),
        limits: &ParallelLimits,
        good: &MainsLimits,
    ) -> bool {
        let jump = LOAD_ANGLE * (genset.total_active() - self.genset_power).abs() / RATED_KW;
        self.genset_power = genset.total_active();
        self.frequencies.rotate_left(1);
        self.frequencies[WINDOW] = mains.frequency;
        self.joined = if joined { self.joined + dt } else { Duration::ZERO };
        let reverse = joined && above(-mains.total_active(), limits.reverse_power);
        self.reversed = if reverse { self.reversed + dt } else { Duration::ZERO };
        if !joined || self.joined < limits.check {
            return false;
        }
        let [first, .., last] = self.frequencies;
        let rate = (last - first).abs() / (dt.as_secs_f64() * WINDOW as f64);
        let lived = self.frequencies.iter().all(|hertz| *hertz > 0.0);
        let outside = last < good.low_frequency || above(last, good.high_frequency);
        let found = [
            (REVERSE_POWER, self.reversed >= REVERSE_AFTER),
            (FREQUENCY, last > 0.0 && outside),
            (NO_FREQUENCY, last == 0.0),
            (ROCOF, lived && above(rate, limits.rocof)),
            (VECTOR_SHIFT, above(jump, limits.vector_shift)),
        ];
        let before = self.tripped.len();
        found.iter().filter(|(_, trips)| *trips).for_each(|(bit, _)| self.tripped.insert(*bit));
        self.tripped.len() > before
    }
}

/// A limit of 0 is not watched.
fn above(value: f64, limit: f64) -> bool {
    limit > 0.0 && value > limit
}

#[cfg(test)]
mod tests {
    use super::super::parameters::site;
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn feed(hertz: f64, kilowatts: f64) -> Feed {
        Feed { voltage: [230.0; 3], frequency: hertz, active: [kilowatts / 3.0; 3], ..Feed::default() }
    }

    /// The bits after a quiet time together, and then so many tenths of these.
    fn tripped(mains: &Feed, genset: &Feed, tenths: u32, joined: bool) -> Vec<u16> {
        let (mut protections, set) = (Protections::default(), site());
        let quiet = (feed(50.0, 10.0), feed(50.0, 30.0));
        let mut step = |pair: (&Feed, &Feed)| {
            protections.step(TENTH, joined, pair, &set.parallel, &set.mains);
        };
        (0..20).for_each(|_| step((&quiet.0, &quiet.1)));
        (0..tenths).for_each(|_| step((mains, genset)));
        protections.tripped().iter().collect()
    }

    #[test]
    fn each_sees_what_it_is_for_and_only_in_parallel() {
        let genset = feed(50.0, 30.0);
        for (what, mains, genset, tenths, expected) in [
            ("nothing", feed(50.05, 9.0), feed(50.0, 30.8), 20, &[][..]),
            ("power back", feed(50.0, -11.0), genset.clone(), 5, &[REVERSE_POWER]),
            ("power back, not for long", feed(50.0, -11.0), genset.clone(), 4, &[]),
            ("too fast by far", feed(53.5, 10.0), genset.clone(), 1, &[FREQUENCY, ROCOF]),
            ("none", feed(0.0, 0.0), genset.clone(), 1, &[NO_FREQUENCY]),
            ("a leap", feed(51.0, 10.0), genset.clone(), 1, &[ROCOF]),
            ("the load of the mains", feed(50.0, 10.0), feed(50.0, 55.0), 1, &[VECTOR_SHIFT]),
        ] {
            assert_eq!(tripped(&mains, &genset, tenths, true), expected, "{what}");
            assert!(tripped(&mains, &genset, tenths, false).is_empty(), "{what}");
        }
    }
}
