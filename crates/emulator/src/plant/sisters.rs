//! Other gensets on the same bus bar, which share its load evenly with the set whose plant this is.
//!
//! Imagined ones of the same make come on it one after the other and leave it with this set. Real ones have plants of
//! their own: each plant offers what it is to the bus bar and hears what the others are. A set that comes on a live bar is
//! brought in step first, and from then on turns as fast as all others and has their voltage; the consumers of a set that
//! has left it stay on it, unless the mains feed them. What a sick set gives is its own affair, and the others give the rest.

use crate::random::{Drift, Random, approach};

use super::load::{PhaseLoads, tenth};
use super::parallel::{FOLLOWING, MOTORING};
use super::{RATED_KW, alternator};

/// How many imagined ones there can be.
pub(super) const MOST: u8 = 3;
/// Seconds that each takes to start and to be synchronised, after the one before it.
const APART: f64 = 6.0;
/// Seconds in which one takes its share over.
const TAKING: f64 = 2.5;
/// rpm and V within which a set is taken for brought in step.
const SPEED_WINDOW: f64 = 45.0;
const VOLTAGE_WINDOW: f64 = 25.0;

/// What feeds the consumers of a plant by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feeding {
    Nobody,
    Mains,
    Genset,
}

/// A genset as the others on its bus bar feel it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Machine {
    /// rpm and V that it has.
    pub(super) speed: f64,
    pub(super) voltage: f64,
    /// kW and kvar that it gives whatever is wanted of it; none where its governor and its regulator do their work.
    pub(super) active: Option<f64>,
    pub(super) reactive: Option<f64>,
}

/// A sum and how many are in it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sum(f64, f64);

impl Sum {
    fn of(value: f64, counts: bool) -> Self {
        if counts { Self(value, 1.0) } else { Self::default() }
    }

    fn and(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }

    fn mean(self) -> Option<f64> {
        (self.1 > 0.0).then(|| self.0 / self.1)
    }
}

/// What one plant, or several together, are to the bus bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Offer {
    /// Shares of the active and of the reactive load that its gensets take.
    weights: [f64; 2],
    /// kW and kvar that those give which take no share.
    forced: [f64; 2],
    /// Gensets that are on the bus bar.
    sets: f64,
    /// kW and kvar of each phase that its consumers want of the bus bar.
    load: PhaseLoads,
    /// V of each phase of a genset that feeds it.
    voltage: [f64; 3],
    /// rpm of those whose governors hold the speed, and of those that run away.
    governed: Sum,
    runaway: Sum,
    /// V of those that have a field.
    excited: Sum,
}

impl Offer {
    /// Both together.
    pub(crate) fn and(self, other: Self) -> Self {
        let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|phase| a[phase] + b[phase]);
        let pair = |a: [f64; 2], b: [f64; 2]| [a[0] + b[0], a[1] + b[1]];
        Self {
            weights: pair(self.weights, other.weights),
            forced: pair(self.forced, other.forced),
            sets: self.sets + other.sets,
            load: (sum(self.load.0, other.load.0), sum(self.load.1, other.load.1)),
            voltage: std::array::from_fn(|phase| self.voltage[phase].max(other.voltage[phase])),
            governed: self.governed.and(other.governed),
            runaway: self.runaway.and(other.runaway),
            excited: self.excited.and(other.excited),
        }
    }

    /// rpm at which it is driven: who runs away drives it only where no governor is left to hold it.
    fn speed(&self) -> Option<f64> {
        self.governed.mean().or(self.runaway.mean())
    }

    /// Whether a genset on it is in step.
    fn meets(&self, machine: &Machine) -> bool {
        let near = |mean: Option<f64>, own: f64, window: f64| mean.is_none_or(|m| (m - own).abs() < window);
        near(self.speed(), machine.speed, SPEED_WINDOW)
            && near(self.excited.mean(), machine.voltage, VOLTAGE_WINDOW)
    }
}

/// What this set and its consumers want, of active or of reactive power.
struct Wish {
    /// Shares that it takes.
    own: f64,
    /// Part of its consumers that it feeds alone.
    apart: f64,
    /// kW or kvar of each phase of its consumers.
    load: [f64; 3],
    /// What it gives whatever is wanted of it.
    forced: Option<f64>,
}

/// What comes of it.
struct Portion {
    /// kW or kvar of each phase that this set carries.
    share: [f64; 3],
    /// What the others carry.
    left: f64,
    /// Shares that it and the imagined ones take, and what it gives without one.
    weight: f64,
    forced: f64,
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
    /// kW and kvar of this set as it gave them last.
    given: [f64; 2],
    machine: Machine,
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
            given: [0.0; 2],
            machine: Machine::default(),
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

    /// Whether this set shares a bus bar with another one.
    pub(crate) fn shares(&self) -> bool {
        self.weight > 0.0 && self.sets() > 1.0
    }

    /// What this set, with this speed and voltage, and its consumers are to the others.
    pub(super) fn offer(&self, speed: f64, volts: f64, terminals: [f64; 3]) -> Offer {
        let on = self.weight > 0.0;
        let holds = self.machine.active.is_none() && self.given[0] > 0.5 - MOTORING;
        let runs_away = self.machine.active.is_some_and(|kw| kw > 0.0);
        let excited = self.machine.reactive.is_none_or(|kvar| kvar > 0.0) && volts > alternator::DEAD;
        Offer {
            voltage: if on { terminals } else { [0.0; 3] },
            governed: Sum::of(speed, on && holds),
            runaway: Sum::of(speed, on && runs_away),
            excited: Sum::of(volts, on && excited),
            ..self.offered
        }
    }

    /// Hears what the others are; rpm and V of the bus bar, where this set is on it with others and anybody has any.
    pub(super) fn join(&mut self, own: Offer, others: Offer) -> (Option<f64>, Option<f64>) {
        self.others = Some(others);
        if self.weight > 0.0 && others.sets > 0.0 {
            let all = own.and(others);
            return (all.speed(), all.excited.mean());
        }
        (None, None)
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
        machine: Machine,
        random: &mut Random,
    ) -> PhaseLoads {
        let evenness = 1.0 + self.unevenness.step(dt, random);
        self.machine = machine;
        self.come_and_go(dt, feeding);
        let others = self.others.unwrap_or_default();
        let own = self.weight * evenness;
        let apart = if feeding == Feeding::Genset { 1.0 - self.coupled } else { 0.0 };
        // Somebody else must turn it, give it a field and take the rest.
        let (turned, excited) = (others.weights[0] + others.runaway.1 > 0.0, others.excited.1 > 0.0);
        let forced = |given: Option<f64>, possible: bool| given.filter(|_| self.weight > 0.0 && possible);
        let wishes = [
            Wish { own, apart, load: load.0, forced: forced(machine.active, turned) },
            Wish { own, apart, load: load.1, forced: forced(machine.reactive, excited) },
        ];
        let [active, reactive] = [0, 1].map(|n| self.portion(dt, n, &wishes[n], &others));
        [self.active, self.reactive] = [active.left, reactive.left];
        let times = |phases: [f64; 3]| phases.map(|phase| phase * self.coupled);
        let sisters = self.taken.iter().filter(|taken| **taken > 0.0).count() as f64;
        self.offered = Offer {
            weights: [active.weight, reactive.weight],
            forced: [active.forced, reactive.forced],
            sets: sisters + f64::from(u8::from(self.weight > 0.0)),
            load: (times(load.0), times(load.1)),
            ..Offer::default()
        };
        (active.share, reactive.share)
    }

    /// What becomes of active power (0) or reactive power (1).
    fn portion(&mut self, dt: f64, n: usize, wish: &Wish, others: &Offer) -> Portion {
        let theirs = if n == 0 { others.load.0 } else { others.load.1 };
        let pool: [f64; 3] = std::array::from_fn(|phase| self.coupled * wish.load[phase] + theirs[phase]);
        let wanted = pool.iter().sum::<f64>();
        let beside = self.taken.iter().sum::<f64>() + others.weights[n];
        let whole = wish.own + beside;
        let (part, weight) = match wish.forced {
            Some(most) => {
                // No more than the others can be made to take.
                let room = if n == 0 { wanted - others.forced[n] + MOTORING * beside } else { most };
                approach(&mut self.given[n], most.min(room), FOLLOWING, dt);
                ([self.given[n] / 3.0; 3], 0.0)
            }
            None => {
                let part = if whole > 0.0 { wish.own / whole } else { 0.0 };
                let part = pool.map(|phase| part * (phase - others.forced[n] / 3.0));
                self.given[n] = part.iter().sum();
                (part, wish.own)
            }
        };
        let share = std::array::from_fn(|phase| tenth(wish.apart * wish.load[phase] + part[phase]));
        let all = wish.apart * wish.load.iter().sum::<f64>() + wanted;
        Portion {
            share,
            left: if whole > 0.0 { tenth(all - share.iter().sum::<f64>()) } else { 0.0 },
            weight: weight + self.taken.iter().sum::<f64>(),
            forced: if wish.forced.is_some() { self.given[n] } else { 0.0 },
        }
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
        let live = self.others.is_some_and(|others| others.sets > 0.0);
        let in_step = self.others.is_none_or(|others| self.weight > 0.0 || others.meets(&self.machine));
        match (feeds, live) {
            (false, _) => self.weight = 0.0,
            (true, false) => self.weight = 1.0,
            (true, true) if self.feeding >= APART && in_step => approach(&mut self.weight, 1.0, TAKING, dt),
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
    const SOUND: Machine = Machine { speed: 1500.0, voltage: 230.0, active: None, reactive: None };

    fn run(sisters: &mut Sisters, feeding: Feeding, seconds: f64) -> f64 {
        let mut random = Random::new(2);
        let mut own = 0.0;
        for _ in 0..(seconds * 10.0) as u32 {
            own = sisters.share(0.1, feeding, LOAD, SOUND, &mut random).0.iter().sum();
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
        let machines = vec![SOUND; sets.len()];
        let carried = with_machines(sets, feeding, &machines, seconds);
        carried.into_iter().map(|[kw, _]| kw).collect()
    }

    /// The same of gensets that may be sick: kW and kvar.
    fn with_machines(
        sets: &mut [Sisters],
        feeding: &[Feeding],
        machines: &[Machine],
        seconds: f64,
    ) -> Vec<[f64; 2]> {
        let mut random = Random::new(2);
        let mut carried = vec![[0.0; 2]; sets.len()];
        for _ in 0..(seconds * 10.0) as u32 {
            let offers: Vec<_> = sets.iter().map(|set| set.offer(1500.0, 230.0, [230.0; 3])).collect();
            for (index, set) in sets.iter_mut().enumerate() {
                let others = offers.iter().enumerate().filter(|(other, _)| *other != index);
                set.join(offers[index], others.fold(Offer::default(), |sum, (_, offer)| sum.and(*offer)));
                let (active, reactive) = set.share(0.1, feeding[index], LOAD, machines[index], &mut random);
                carried[index] = [active.iter().sum(), reactive.iter().sum()];
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

    #[test]
    fn what_a_sick_set_gives_the_others_do_not_and_all_of_it_adds_up() {
        use Feeding::Genset;
        for (sick, gives) in [
            (Machine { active: Some(-MOTORING), ..SOUND }, [-MOTORING, 30.0]),
            (Machine { active: Some(104.0), ..SOUND }, [104.0, 30.0]),
            (Machine { reactive: Some(-42.0), ..SOUND }, [60.0, -42.0]),
            (Machine { reactive: Some(90.0), ..SOUND }, [60.0, 90.0]),
            (Machine { active: Some(-MOTORING), reactive: Some(-42.0), ..SOUND }, [-MOTORING, -42.0]),
        ] {
            let mut sets: Vec<_> = (0..3).map(|seed| Sisters::new(&mut Random::new(seed))).collect();
            together(&mut sets, &[Genset; 3], 20.0);
            let carried = with_machines(&mut sets, &[Genset; 3], &[SOUND, sick, SOUND], 10.0);
            let sum = |n: usize| carried.iter().map(|set| set[n]).sum::<f64>();
            assert!((sum(0) - 180.0).abs() < 1.0 && (sum(1) - 90.0).abs() < 1.0, "{carried:?}");
            assert!((0..2).all(|n| (carried[1][n] - gives[n]).abs() < 3.0), "{sick:?} {carried:?}");
            assert!((carried[0][0] - carried[2][0]).abs() < 3.0, "{carried:?}");
        }
    }

    #[test]
    fn one_that_runs_away_turns_all_once_no_governor_is_left_to_hold_it() {
        use Feeding::Genset;
        let runaway = Machine { speed: 1520.0, active: Some(104.0), ..SOUND };
        let mut sets: Vec<_> = (0..2).map(|seed| Sisters::new(&mut Random::new(seed))).collect();
        together(&mut sets, &[Genset; 2], 20.0);
        let speed = |sets: &[Sisters]| {
            let [sound, sick] =
                [(0, 1500.0), (1, 1520.0)].map(|(n, rpm)| sets[n].offer(rpm, 230.0, [230.0; 3]));
            sound.and(sick).speed()
        };
        with_machines(&mut sets, &[Genset; 2], &[SOUND, runaway], 0.3);
        assert_eq!(speed(&sets), Some(1500.0), "the other one still gives way");
        // 120 kW are wanted: of 104 the other one can hold the speed, of 300 it cannot.
        with_machines(&mut sets, &[Genset; 2], &[SOUND, runaway], 10.0);
        assert_eq!(speed(&sets), Some(1500.0));
        let carried = with_machines(
            &mut sets,
            &[Genset, Genset],
            &[SOUND, Machine { active: Some(300.0), ..runaway }],
            10.0,
        );
        assert!((carried[0][0] + MOTORING).abs() < 0.5, "{carried:?}");
        assert!((carried.iter().map(|set| set[0]).sum::<f64>() - 120.0).abs() < 0.5, "{carried:?}");
        assert_eq!(speed(&sets), Some(1520.0));
    }

    #[test]
    fn one_that_is_too_far_away_is_not_brought_in_step() {
        use Feeding::Genset;
        let far = Machine { voltage: 275.0, ..SOUND };
        let mut sets: Vec<_> = (0..2).map(|seed| Sisters::new(&mut Random::new(seed))).collect();
        together(&mut sets, &[Genset, Feeding::Nobody], 5.0);
        let carried = with_machines(&mut sets, &[Genset; 2], &[SOUND, far], 20.0);
        assert!(carried[0][0] == 60.0 && carried[1][0] == 60.0 && !sets[1].shares(), "{carried:?}");
        with_machines(&mut sets, &[Genset; 2], &[SOUND; 2], 20.0);
        assert!(sets.iter().all(Sisters::shares));
    }
}
