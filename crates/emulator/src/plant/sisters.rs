//! Other gensets of the same make on the same bus bar: they come on it one after the other, share its load and leave it
//! with the set whose plant this is.

use crate::random::{Drift, Random, approach};

use super::RATED_KW;
use super::load::{PhaseLoads, tenth};

/// How many there can be.
pub(super) const MOST: u8 = 3;
/// Seconds that each takes to start and to be synchronised, after the one before it.
const APART: f64 = 6.0;
/// Seconds in which one takes its share over.
const TAKING: f64 = 2.5;

#[derive(Clone, Debug)]
pub(crate) struct Sisters {
    /// How many are to run with this set.
    pub(super) wanted: u8,
    /// Seconds for which this set has fed the bus bar.
    feeding: f64,
    /// Part of an equal share that each has taken over.
    taken: [f64; MOST as usize],
    active: f64,
    reactive: f64,
    unevenness: Drift,
}

impl Sisters {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            wanted: 0,
            feeding: 0.0,
            taken: [0.0; MOST as usize],
            active: 0.0,
            reactive: 0.0,
            unevenness: Drift::new(0.01, 20.0, random),
        }
    }

    /// How many of them are on the bus bar.
    pub(crate) fn on_bus(&self) -> usize {
        self.taken.iter().filter(|taken| **taken > 0.0).count()
    }

    /// kW that all of them carry.
    pub(crate) fn active(&self) -> f64 {
        self.active
    }

    /// kvar that all of them carry.
    pub(crate) fn reactive(&self) -> f64 {
        self.reactive
    }

    /// Lets them come or go; what is left of the load for this set.
    pub(super) fn share(
        &mut self,
        dt: f64,
        feeds: bool,
        (active, reactive): PhaseLoads,
        random: &mut Random,
    ) -> PhaseLoads {
        let unevenness = self.unevenness.step(dt, random);
        self.feeding = if feeds { self.feeding + dt } else { 0.0 };
        for (number, taken) in (1_u8..).zip(&mut self.taken) {
            match number <= self.wanted && self.feeding >= APART * f64::from(number) {
                true => approach(taken, 1.0, TAKING, dt),
                false => *taken = 0.0,
            }
        }
        let others: f64 = self.taken.iter().sum();
        let part = match others > 0.0 {
            true => ((1.0 + unevenness) / (1.0 + others)).min(1.0),
            false => 1.0,
        };
        let own = [active, reactive].map(|phases| phases.map(|phase| tenth(phase * part)));
        let left = |whole: [f64; 3], own: [f64; 3]| whole.iter().sum::<f64>() - own.iter().sum::<f64>();
        self.active = tenth(left(active, own[0]));
        self.reactive = tenth(left(reactive, own[1]));
        (own[0], own[1])
    }

    /// Percent of rated power by which a set that carries `own` kW is behind the average of all on the bus bar.
    pub(crate) fn behind(&self, own: f64) -> f64 {
        let average = (own + self.active) / (1.0 + self.on_bus() as f64);
        100.0 * (average - own) / RATED_KW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(sisters: &mut Sisters, feeds: bool, seconds: f64) -> f64 {
        let mut random = Random::new(2);
        let load = ([20.0; 3], [10.0; 3]);
        let mut own = 0.0;
        for _ in 0..(seconds * 10.0) as u32 {
            own = sisters.share(0.1, feeds, load, &mut random).0.iter().sum();
        }
        own
    }

    #[test]
    fn they_come_one_by_one_share_evenly_and_leave_at_once() {
        let mut sisters = Sisters::new(&mut Random::new(1));
        assert_eq!(run(&mut sisters, true, 60.0), 60.0);
        assert_eq!(sisters.on_bus(), 0);
        sisters.wanted = 2;
        run(&mut sisters, false, 1.0);
        run(&mut sisters, true, 7.0);
        assert_eq!(sisters.on_bus(), 1);
        let own = run(&mut sisters, true, 40.0);
        assert_eq!(sisters.on_bus(), 2);
        assert!((18.5..21.5).contains(&own), "{own}");
        assert!((own + sisters.active() - 60.0).abs() < 1e-9);
        assert!((sisters.reactive() - 20.0).abs() < 1.5);
        assert!(sisters.behind(own).abs() < 2.0);
        assert_eq!(run(&mut sisters, false, 0.2), 60.0);
        assert_eq!((sisters.on_bus(), sisters.active()), (0, 0.0));
    }
}
