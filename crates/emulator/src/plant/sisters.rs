//! Other gensets on the same bus bar, which share its load evenly with the set whose plant this is.
//!
//! Imagined ones of the same make come on it one after the other and leave it with this set. Real ones have plants of
//! their own: each plant offers what it is to the bus bar and hears what the others are. A set that comes on a live bar is
//! brought in step first; the consumers of a set that has left it stay on it, unless the mains feed them.

use crate::random::{Drift, Random, approach};

use super::RATED_KW;
use super::load::{PhaseLoads, tenth};

/// How many imagined ones there can be.
pub(super) const MOST: u8 = 3;
/// Seconds that each takes to start and to be synchronised, after the one before it.
const APART: f64 = 6.0;
/// Seconds in which one takes its share over.
const TAKING: f64 = 2.5;

/// What feeds the consumers of a plant by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feeding {
    Nobody,
    Mains,
    Genset,
}

/// What one plant, or several together, are to the bus bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Offer {
    /// Shares of the load that its gensets take.
    weight: f64,
    /// Gensets that take any.
    sets: f64,
    /// kW and kvar of each phase that its consumers want of the bus bar.
    load: PhaseLoads,
    /// V of each phase of a genset that feeds it.
    voltage: [f64; 3],
}

impl Offer {
    /// Both together.
    pub(crate) fn and(self, other: Self) -> Self {
        let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|phase| a[phase] + b[phase]);
        Self {
            weight: self.weight + other.weight,
            sets: self.sets + other.sets,
            load: (sum(self.load.0, other.load.0), sum(self.load.1, other.load.1)),
            voltage: std::array::from_fn(|phase| self.voltage[phase].max(other.voltage[phase])),
        }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Sisters {
    /// How many imagined ones are to run with this set.
    pub(super) wanted: u8,
    /// What the real ones are; none where there is no bus bar to share.
    pub(super) others: Option<Offer>,
    /// Seconds for which this set has fed the bus bar.
    feeding: f64,
    /// Part of an equal share that each imagined one has taken over.
    taken: [f64; MOST as usize],
    /// The same of this set.
    weight: f64,
    /// Part of this set's consumers that the bus bar feeds.
    coupled: f64,
    offered: Offer,
    active: f64,
    reactive: f64,
    unevenness: Drift,
}

impl Sisters {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            wanted: 0,
            others: None,
            feeding: 0.0,
            taken: [0.0; MOST as usize],
            weight: 0.0,
            coupled: 0.0,
            offered: Offer::default(),
            active: 0.0,
            reactive: 0.0,
            unevenness: Drift::new(0.01, 20.0, random),
        }
    }

    /// How many gensets are on the bus bar, at least this one.
    pub(crate) fn sets(&self) -> f64 {
        let others = self.others.map_or(0.0, |others| others.sets);
        (self.offered.sets + others).max(1.0)
    }

    /// kW that the others carry.
    pub(crate) fn active(&self) -> f64 {
        self.active
    }

    /// kvar that the others carry.
    pub(crate) fn reactive(&self) -> f64 {
        self.reactive
    }

    /// What this set, with this voltage at its terminals, and its consumers are to the others.
    pub(super) fn offer(&self, voltage: [f64; 3]) -> Offer {
        Offer { voltage: if self.weight > 0.0 { voltage } else { [0.0; 3] }, ..self.offered }
    }

    /// V of each phase that the bus bar gives to consumers whose own set does not feed them.
    pub(super) fn fed(&self) -> [f64; 3] {
        self.others.filter(|_| self.coupled > 0.0).map_or([0.0; 3], |others| others.voltage)
    }

    /// Lets others come or go; what is left of the load for this set.
    pub(super) fn share(
        &mut self,
        dt: f64,
        feeding: Feeding,
        load: PhaseLoads,
        random: &mut Random,
    ) -> PhaseLoads {
        let evenness = 1.0 + self.unevenness.step(dt, random);
        self.come_and_go(dt, feeding);
        let others = self.others.unwrap_or_default();
        let own = self.weight * evenness;
        let mine = own + self.taken.iter().sum::<f64>();
        let whole = mine + others.weight;
        let part = if whole > 0.0 { own / whole } else { 0.0 };

        let apart = if feeding == Feeding::Genset { 1.0 - self.coupled } else { 0.0 };
        let times = |phases: [f64; 3], factor: f64| phases.map(|phase| phase * factor);
        let pool = |own: [f64; 3], others: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|phase| self.coupled * own[phase] + others[phase])
        };
        let pools = (pool(load.0, others.load.0), pool(load.1, others.load.1));
        let share = |own: [f64; 3], pool: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|phase| tenth(apart * own[phase] + part * pool[phase]))
        };
        let shares = (share(load.0, pools.0), share(load.1, pools.1));
        let rest = |own: [f64; 3], pool: [f64; 3], share: [f64; 3]| {
            tenth(apart * own.iter().sum::<f64>() + pool.iter().sum::<f64>() - share.iter().sum::<f64>())
        };
        self.active = rest(load.0, pools.0, shares.0);
        self.reactive = rest(load.1, pools.1, shares.1);
        let imagined = self.taken.iter().filter(|taken| **taken > 0.0).count() as f64;
        self.offered = Offer {
            weight: mine,
            sets: imagined + f64::from(u8::from(self.weight > 0.0)),
            load: (times(load.0, self.coupled), times(load.1, self.coupled)),
            voltage: [0.0; 3],
        };
        shares
    }

    fn come_and_go(&mut self, dt: f64, feeding: Feeding) {
        let feeds = feeding == Feeding::Genset;
        self.feeding = if feeds { self.feeding + dt } else { 0.0 };
        for (number, taken) in (1_u8..).zip(&mut self.taken) {
            match number <= self.wanted && self.feeding >= APART * f64::from(number) {
                true => approach(taken, 1.0, TAKING, dt),
                false => *taken = 0.0,
            }
        }
        let live = self.others.is_some_and(|others| others.weight > 0.0);
        match (feeds, live) {
            (false, _) => self.weight = 0.0,
            (true, false) => self.weight = 1.0,
            (true, true) if self.feeding >= APART => approach(&mut self.weight, 1.0, TAKING, dt),
            (true, true) => {}
        }
        self.coupled = match feeding {
            Feeding::Mains => 0.0,
            Feeding::Genset => self.coupled.max(self.weight),
            Feeding::Nobody if live => self.coupled,
            Feeding::Nobody => 0.0,
        };
    }

    /// Percent of rated power by which a set that carries `own` kW is behind the average of all on the bus bar.
    pub(crate) fn behind(&self, own: f64) -> f64 {
        100.0 * self.short(own, self.active) / RATED_KW
    }

    /// How far a set that carries `own` is behind the average, where the others carry that much; nothing for one that is
    /// not on the bus bar.
    pub(crate) fn short(&self, own: f64, others: f64) -> f64 {
        if self.weight > 0.0 { (own + others) / self.sets() - own } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOAD: PhaseLoads = ([20.0; 3], [10.0; 3]);

    fn run(sisters: &mut Sisters, feeding: Feeding, seconds: f64) -> f64 {
        let mut random = Random::new(2);
        let mut own = 0.0;
        for _ in 0..(seconds * 10.0) as u32 {
            own = sisters.share(0.1, feeding, LOAD, &mut random).0.iter().sum();
        }
        own
    }

    #[test]
    fn they_come_one_by_one_share_evenly_and_leave_at_once() {
        let mut sisters = Sisters::new(&mut Random::new(1));
        assert_eq!(run(&mut sisters, Feeding::Genset, 60.0), 60.0);
        assert_eq!(sisters.sets(), 1.0);
        sisters.wanted = 2;
        run(&mut sisters, Feeding::Mains, 1.0);
        run(&mut sisters, Feeding::Genset, 7.0);
        assert_eq!(sisters.sets(), 2.0);
        let own = run(&mut sisters, Feeding::Genset, 40.0);
        assert_eq!(sisters.sets(), 3.0);
        assert!((18.5..21.5).contains(&own), "{own}");
        assert!((own + sisters.active() - 60.0).abs() < 1e-9);
        assert!((sisters.reactive() - 20.0).abs() < 1.5);
        assert!(sisters.behind(own).abs() < 2.0);
        run(&mut sisters, Feeding::Nobody, 0.2);
        assert_eq!((sisters.sets(), sisters.active()), (1.0, 0.0));
    }

    /// Lets several sets live on one bus bar; what each carries in the end.
    fn together(sets: &mut [Sisters], feeding: &[Feeding], seconds: f64) -> Vec<f64> {
        let mut carried = vec![0.0; sets.len()];
        for _ in 0..(seconds * 10.0) as u32 {
            let offers: Vec<_> = sets.iter().map(|set| set.offer([230.0; 3])).collect();
            for (index, set) in sets.iter_mut().enumerate() {
                let others = offers.iter().enumerate().filter(|(other, _)| *other != index);
                set.others = Some(others.fold(Offer::default(), |sum, (_, offer)| sum.and(*offer)));
                carried[index] = run(set, feeding[index], 0.1);
            }
        }
        carried
    }

    #[test]
    fn real_ones_share_what_all_their_consumers_want_and_take_over_from_one_that_leaves() {
        use Feeding::{Genset, Mains, Nobody};
        let mut sets: Vec<_> = (0..3).map(|seed| Sisters::new(&mut Random::new(seed))).collect();
        let carried = together(&mut sets, &[Genset, Nobody, Nobody], 5.0);
        assert_eq!(carried[0], 60.0, "nobody else is on the bar");
        let carried = together(&mut sets, &[Genset, Genset, Genset], 3.0);
        assert_eq!(carried, [60.0; 3], "they are not in step yet");
        let carried = together(&mut sets, &[Genset, Genset, Genset], 40.0);
        assert!(carried.iter().all(|kw| (57.0..63.0).contains(kw)), "{carried:?}");
        assert!((carried.iter().sum::<f64>() - 180.0).abs() < 1.0, "{carried:?}");
        assert_eq!(sets[1].sets(), 3.0);
        assert!((sets[1].active() + carried[1] - 180.0).abs() < 1.0);

        let carried = together(&mut sets, &[Genset, Nobody, Genset], 5.0);
        assert!((carried[0] + carried[2] - 180.0).abs() < 1.0, "its consumers stay on the bar: {carried:?}");
        assert_eq!(sets[1].fed(), [230.0; 3]);
        assert_eq!((sets[0].sets(), sets[1].behind(0.0)), (2.0, 0.0));
        let carried = together(&mut sets, &[Genset, Mains, Genset], 5.0);
        assert!((carried[0] + carried[2] - 120.0).abs() < 1.0, "its mains feed them: {carried:?}");
        together(&mut sets, &[Nobody; 3], 1.0);
        assert!(sets.iter().all(|set| set.fed() == [0.0; 3] && set.active() == 0.0), "the bar is dead");
    }
}
