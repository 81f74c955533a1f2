//! Behind the cylinders: the turbo, the exhaust, and the particle filter that fills with soot and burns it off.

use crate::random::approach;

/// degC above which soot burns.
const BURNS_ABOVE: f64 = 280.0;
/// Percent of soot at which the filter cleans itself, and at which it has done so.
const REGENERATE_AT: f64 = 80.0;
const CLEAN_AT: f64 = 15.0;
/// Percent at which it wants a person, is too full to be burned clean, lets hardly anything through, and holds no more.
const WANTS_A_PERSON: f64 = 95.0;
const FAILED: f64 = 120.0;
const PLUGGED: f64 = 140.0;
const FULL: f64 = 150.0;
/// degC that a burner adds: while working, and while a person sees to it with the engine unloaded; and up to which.
const BURNER: f64 = 130.0;
const BURNER_BY_HAND: f64 = 320.0;
const BURNER_UP_TO: f64 = 580.0;
/// degC that too little air adds at full pull, and part of the boost that is left.
const STARVED: f64 = 110.0;
const STARVED_BOOST: f64 = 0.6;

/// What goes through the exhaust.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gas {
    pub(super) running: bool,
    /// Parts of the rated torque and speed.
    pub(super) pull: f64,
    pub(super) speed: f64,
    /// The air filter lets too little in.
    pub(super) starved: bool,
    /// degC of the air around.
    pub(super) around: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Exhaust {
    /// degC at the outlet.
    pub(crate) temperature: f64,
    /// kPa of boost from the turbo.
    pub(crate) boost: f64,
}

impl Exhaust {
    pub(crate) fn new(temperature: f64) -> Self {
        Self { temperature, boost: 0.0 }
    }

    pub(super) fn step(&mut self, dt: f64, gas: Gas, filter: &ParticleFilter) {
        let (hotter, boosted) = if gas.starved { (STARVED, STARVED_BOOST) } else { (0.0, 1.0) };
        let (temperature, memory, boost) = match gas.running {
            true => (
                110.0 + (340.0 + hotter) * gas.pull,
                25.0,
                135.0 * boosted * gas.pull * gas.speed * gas.speed,
            ),
            false => (gas.around, 400.0, 0.0),
        };
        let burned = (temperature + filter.burner()).min(BURNER_UP_TO);
        approach(&mut self.temperature, burned.max(temperature), memory, dt);
        approach(&mut self.boost, boost, 1.5, dt);
    }
}

/// How a filter is cleaned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Regeneration {
    /// As soon as it is full and the exhaust is hot.
    Automatic,
    /// Not at all: somebody has forbidden it.
    Inhibited,
    /// A person has asked for it beside the running engine: until it is done, or the engine stops under it.
    ByHand,
}

/// A diesel particle filter.
#[derive(Clone, Debug)]
pub(crate) struct ParticleFilter {
    /// Percent of what it should hold at most.
    pub(super) soot: f64,
    pub(super) regeneration: Regeneration,
    regenerating: bool,
}

impl ParticleFilter {
    pub(crate) fn new(soot: f64) -> Self {
        Self { soot, regeneration: Regeneration::Automatic, regenerating: false }
    }

    pub(super) fn step(&mut self, dt: f64, running: bool, exhaust: &Exhaust) {
        let hot = exhaust.temperature > BURNS_ABOVE;
        let wanted = match self.regeneration {
            Regeneration::Automatic => hot && (self.regenerating || self.soot >= REGENERATE_AT),
            Regeneration::Inhibited => false,
            Regeneration::ByHand => true,
        };
        let interrupted = self.regenerating && !running;
        // So much soot would melt it.
        let burns = self.soot > CLEAN_AT && !self.has_failed();
        self.regenerating = running && wanted && burns;
        if self.regeneration == Regeneration::ByHand && (interrupted || !burns) {
            self.regeneration = Regeneration::Automatic;
        }
        let per_hour = match (running, self.regenerating && hot, hot) {
            (false, ..) => 0.0,
            (_, true, _) => -180.0,
            // A hot exhaust burns part of the soot as it comes.
            (.., true) => 7.0,
            _ => 25.0,
        };
        self.soot = (self.soot + per_hour * dt / 3600.0).clamp(0.0, FULL);
    }

    /// degC that the burner adds to the exhaust.
    fn burner(&self) -> f64 {
        match (self.regenerating, self.regeneration) {
            (false, _) => 0.0,
            (true, Regeneration::ByHand) => BURNER_BY_HAND,
            (true, _) => BURNER,
        }
    }

    /// Somebody has forbidden it to clean itself.
    pub(crate) fn is_inhibited(&self) -> bool {
        self.regeneration == Regeneration::Inhibited
    }

    /// It is full, and burns as soon as the exhaust is hot enough.
    pub(crate) fn is_waiting(&self) -> bool {
        self.soot >= REGENERATE_AT && !self.regenerating
    }

    pub(crate) fn is_regenerating(&self) -> bool {
        self.regenerating
    }

    /// It filled up without ever getting hot: somebody has to see to it.
    pub(crate) fn needs_a_person(&self) -> bool {
        self.soot >= WANTS_A_PERSON && !self.regenerating
    }

    /// It is too full to be burned clean: another has to be put in.
    pub(crate) fn has_failed(&self) -> bool {
        self.soot >= FAILED
    }

    /// Hardly anything goes through it.
    pub(crate) fn is_plugged(&self) -> bool {
        self.soot >= PLUGGED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(filter: &mut ParticleFilter, temperature: f64, hours: f64) {
        for _ in 0..(hours * 3600.0) as u32 {
            filter.step(1.0, true, &Exhaust::new(temperature));
        }
    }

    #[test]
    fn an_idling_engine_fills_the_filter_until_it_asks_for_a_person_and_then_fails() {
        let mut filter = ParticleFilter::new(70.0);
        run(&mut filter, 150.0, 0.5);
        assert!(filter.is_waiting() && !filter.needs_a_person());
        run(&mut filter, 150.0, 0.7);
        assert!(filter.needs_a_person() && !filter.has_failed());
        run(&mut filter, 150.0, 1.0);
        assert!(filter.has_failed());
    }

    #[test]
    fn a_hot_exhaust_burns_a_full_filter_clean_once() {
        let mut filter = ParticleFilter::new(79.99);
        run(&mut filter, 400.0, 0.1);
        assert!(filter.is_regenerating() && !filter.is_waiting());
        run(&mut filter, 400.0, 0.5);
        assert!(!filter.is_regenerating() && filter.soot < 25.0, "{}", filter.soot);
    }

    #[test]
    fn it_is_interrupted_when_the_engine_stops() {
        let mut filter = ParticleFilter::new(90.0);
        run(&mut filter, 400.0, 0.05);
        assert!(filter.is_regenerating());
        filter.step(1.0, false, &Exhaust::new(400.0));
        assert!(!filter.is_regenerating() && filter.soot > 70.0);
    }

    #[test]
    fn a_person_cleans_it_at_idle_and_it_is_automatic_again() {
        let mut filter = ParticleFilter::new(100.0);
        filter.regeneration = Regeneration::ByHand;
        let mut exhaust = Exhaust::new(130.0);
        let idle = Gas { running: true, pull: 0.1, speed: 0.6, ..Gas::default() };
        filter.step(1.0, true, &exhaust);
        assert!(filter.is_regenerating() && filter.soot >= 100.0, "the exhaust is still cold");
        for _ in 0..2400 {
            exhaust.step(1.0, idle, &filter);
            filter.step(1.0, true, &exhaust);
        }
        assert!(!filter.is_regenerating() && filter.soot < 20.0, "{}", filter.soot);
        assert_eq!(filter.regeneration, Regeneration::Automatic);
    }

    #[test]
    fn what_a_person_asked_for_ends_with_the_engine_and_is_refused_by_a_filter_that_failed() {
        let asked = |soot| ParticleFilter { regeneration: Regeneration::ByHand, ..ParticleFilter::new(soot) };
        let mut filter = asked(90.0);
        filter.step(1.0, false, &Exhaust::new(20.0));
        assert_eq!(filter.regeneration, Regeneration::ByHand, "it waits for the start");
        filter.step(1.0, true, &Exhaust::new(150.0));
        assert!(filter.is_regenerating());
        filter.step(1.0, false, &Exhaust::new(150.0));
        assert_eq!(filter.regeneration, Regeneration::Automatic);
        let mut filter = asked(121.0);
        filter.step(1.0, true, &Exhaust::new(450.0));
        assert!(!filter.is_regenerating() && filter.has_failed() && !filter.is_plugged());
        assert_eq!(filter.regeneration, Regeneration::Automatic);
    }

    #[test]
    fn the_burner_heats_an_exhaust_that_is_hot_already_no_further_than_it_has_to() {
        let mut filter = ParticleFilter { regeneration: Regeneration::ByHand, ..ParticleFilter::new(100.0) };
        let mut exhaust = Exhaust::new(400.0);
        let gas = Gas { running: true, pull: 1.0, speed: 1.0, starved: false, around: 20.0 };
        for _ in 0..300 {
            exhaust.step(1.0, gas, &filter);
            filter.step(1.0, true, &exhaust);
        }
        assert!(filter.is_regenerating() && (500.0..590.0).contains(&exhaust.temperature));
    }

    #[test]
    fn one_that_is_inhibited_fills_up_however_hot_it_is() {
        let mut filter =
            ParticleFilter { regeneration: Regeneration::Inhibited, ..ParticleFilter::new(90.0) };
        run(&mut filter, 450.0, 1.0);
        assert!(filter.is_inhibited() && !filter.is_regenerating());
        assert!(filter.soot > 95.0 && filter.needs_a_person());
    }

    #[test]
    fn an_engine_without_air_runs_hot_and_without_boost() {
        let after = |starved| {
            let mut exhaust = Exhaust::new(30.0);
            let gas = Gas { running: true, pull: 0.9, speed: 1.0, starved, around: 20.0 };
            (0..300).for_each(|_| exhaust.step(1.0, gas, &ParticleFilter::new(20.0)));
            exhaust
        };
        let (fed, starved) = (after(false), after(true));
        assert!(starved.temperature > fed.temperature + 60.0 && starved.boost < 0.7 * fed.boost);
    }
}
