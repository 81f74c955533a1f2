//! What time-outs mean: which units are silent, and whether the whole connection is dead.

/// So many times the limit, and a connection is given up even if a unit that used to answer was not asked meanwhile.
const PATIENCE: u32 = 8;

/// What each unit of a wire did when it was asked last, and how long nobody has answered.
///
/// A unit that is switched off says nothing about the others on its wire: the connection is suspect only when nobody is
/// left who might answer.
#[derive(Clone, Debug, Default)]
pub(crate) struct Silence {
    answering: Units,
    silent: Units,
    /// Time-outs since the last answer of any unit.
    timeouts: u32,
    /// Those among them of units that had answered before.
    fallen: u32,
}

impl Silence {
    /// A unit answered, be it with an exception.
    pub(crate) fn answered(&mut self, unit: u8) {
        self.answering.insert(unit);
        self.silent.remove(unit);
        self.begin();
    }

    /// A unit did not answer in time.
    pub(crate) fn timed_out(&mut self, unit: u8) {
        self.timeouts = self.timeouts.saturating_add(1);
        self.fallen = self.fallen.saturating_add(u32::from(self.answering.contains(unit)));
        self.answering.remove(unit);
        self.silent.insert(unit);
    }

    /// Counts anew, on a new connection; what the units did stays known.
    pub(crate) fn begin(&mut self) {
        self.timeouts = 0;
        self.fallen = 0;
    }

    /// Whether the unit did not answer when it was asked last.
    pub(crate) fn is_silent(&self, unit: u8) -> bool {
        self.silent.contains(unit)
    }

    /// Whether any unit answered when it was asked last.
    pub(crate) fn has_answering(&self) -> bool {
        !self.answering.is_empty()
    }

    /// Time-outs since the last answer of any unit.
    pub(crate) fn timeouts(&self) -> u32 {
        self.timeouts
    }

    /// Whether the connection itself is dead, judged after a time-out: `limit` of them came in a row, and either
    /// nobody is left who might answer, or as many units fell silent that did answer. `waiting` are the units that
    /// will be asked next.
    pub(crate) fn is_dead(&self, limit: u32, mut waiting: impl Iterator<Item = u8>) -> bool {
        if self.timeouts < limit {
            return false;
        }
        let hope = self.has_answering() || waiting.any(|unit| !self.is_silent(unit));
        !hope || self.fallen >= limit || self.timeouts >= limit.saturating_mul(PATIENCE)
    }
}

/// A set of unit ids.
#[derive(Clone, Copy, Debug, Default)]
struct Units([u64; 4]);

impl Units {
    fn insert(&mut self, unit: u8) {
        self.0[usize::from(unit >> 6)] |= 1 << (unit & 63);
    }

    fn remove(&mut self, unit: u8) {
        self.0[usize::from(unit >> 6)] &= !(1 << (unit & 63));
    }

    fn contains(self, unit: u8) -> bool {
        self.0[usize::from(unit >> 6)] >> (unit & 63) & 1 == 1
    }

    fn is_empty(self) -> bool {
        self.0 == [0; 4]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: u32 = 3;

    /// Units that answer, then time-outs in this order; which of them, counted from 1, shows that the connection is
    /// dead.
    fn dead_at(answered: &[u8], timed_out: &[u8], waiting: &[u8]) -> Option<usize> {
        let mut silence = Silence::default();
        answered.iter().for_each(|unit| silence.answered(*unit));
        let dead = timed_out.iter().position(|unit| {
            silence.timed_out(*unit);
            silence.is_dead(LIMIT, waiting.iter().copied())
        });
        dead.map(|index| index + 1)
    }

    #[test]
    fn a_connection_is_dead_when_nobody_is_left_who_might_answer() {
        for (label, answered, timed_out, waiting, dead) in [
            ("one unit", &[1][..], &[1, 1, 1][..], &[][..], Some(3)),
            ("one that never answered", &[], &[0, 0, 0], &[], Some(3)),
            ("others than the one that answers", &[1], &[2, 3, 4, 2, 3, 4], &[], None),
            ("then that one too", &[1], &[2, 3, 1], &[], Some(3)),
            ("one that waits was never asked", &[], &[2, 3, 4, 255], &[1], None),
            ("all who wait are silent", &[], &[2, 3, 4], &[2, 3], Some(3)),
            ("several fell silent", &[1, 64, 128, 255], &[1, 64, 128], &[255], Some(3)),
            ("one is not asked any more", &[1], &[2; 40], &[], Some(24)),
        ] {
            assert_eq!(dead_at(answered, timed_out, waiting), dead, "{label}");
        }
    }

    #[test]
    fn any_answer_counts_anew_and_a_new_connection_too() {
        let mut silence = Silence::default();
        for _ in 0..10 {
            silence.timed_out(2);
            silence.timed_out(2);
            assert!(silence.is_silent(2) && !silence.is_dead(LIMIT, [].into_iter()));
            silence.answered(3);
        }
        silence.timed_out(3);
        silence.timed_out(3);
        silence.begin();
        silence.timed_out(3);
        assert_eq!((silence.timeouts(), silence.is_dead(LIMIT, [].into_iter())), (1, false));
        silence.answered(2);
        assert!(!silence.is_silent(2));
        assert!(silence.is_silent(3));
        assert!(!silence.is_silent(4), "nobody knows");
    }
}
