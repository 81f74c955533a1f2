//! Where the unit stands, as its GPS receiver tells: a fix of a thing that stands still wanders by some metres.

use crate::random::{Drift, Random};

/// 1/100 000 degree of latitude and longitude, and metres.
const PLACE: [f64; 3] = [4_821_000.0, 1_637_200.0, 186.0];
/// What a receiver is usually wrong by: two metres, and more in height.
const SPREAD: [f64; 3] = [1.8, 2.7, 4.0];
/// Seconds in which it forgets how wrong it was.
const MEMORY: f64 = 90.0;

#[derive(Clone, Debug)]
pub(super) struct Gps {
    wander: [Drift; 3],
    random: Random,
}

impl Gps {
    pub(super) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self { wander: SPREAD.map(|spread| Drift::new(spread, MEMORY, &mut random)), random }
    }

    pub(super) fn step(&mut self, seconds: f64) {
        for drift in &mut self.wander {
            drift.step(seconds, &mut self.random);
        }
    }

    /// Latitude, longitude and altitude as the registers hold them: the manual gives no format.
    pub(super) fn fix(&self) -> [i64; 3] {
        std::array::from_fn(|axis| (PLACE[axis] + self.wander[axis].value()).round() as i64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fix_wanders_by_metres() {
        let mut gps = Gps::new(1);
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..3600 {
            gps.step(1.0);
            let fix = gps.fix();
            for (axis, value) in fix.into_iter().enumerate() {
                assert!((value as f64 - PLACE[axis]).abs() <= 3.0 * SPREAD[axis] + 1.0, "{fix:?}");
            }
            seen.insert(fix);
        }
        assert!(seen.len() > 100, "{}", seen.len());
    }
}
