//! Behind the cylinders: the turbo, the exhaust, and the particle filter that fills with soot and burns it off.

use crate::random::approach;

/// degC above which soot burns.
const BURNS_ABOVE: f64 = 280.0;
/// Percent of soot at which the filter cleans itself, and at which it has done so.
const REGENERATE_AT: f64 = 80.0;
const CLEAN_AT: f64 = 15.0;

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

    /// `pull` and `speed` are parts of the rated torque and speed.
    pub(crate) fn step(
        &mut self,
        dt: f64,
        running: bool,
        pull: f64,
        speed: f64,
        regenerating: bool,
        around: f64,
    ) {
        let (temperature, memory, boost) = match running {
            true => (110.0 + 340.0 * pull, 25.0, 135.0 * pull * speed * speed),
            false => (around, 400.0, 0.0),
        };
        let burner = if regenerating { 130.0 } else { 0.0 };
        approach(&mut self.temperature, temperature + burner, memory, dt);
        approach(&mut self.boost, boost, 1.5, dt);
    }
}

/// A diesel particle filter.
#[derive(Clone, Debug)]
pub(crate) struct ParticleFilter {
    /// Percent of what it should hold at most.
    soot: f64,
    regenerating: bool,
}

impl ParticleFilter {
    pub(crate) fn new(soot: f64) -> Self {
        Self { soot, regenerating: false }
    }

    pub(crate) fn step(&mut self, dt: f64, running: bool, exhaust: &Exhaust) {
        let hot = exhaust.temperature > BURNS_ABOVE;
        self.regenerating =
            running && hot && self.soot > CLEAN_AT && (self.regenerating || self.soot >= REGENERATE_AT);
        let per_hour = match (running, self.regenerating, hot) {
            (false, ..) => 0.0,
            (_, true, _) => -180.0,
            // A hot exhaust burns part of the soot as it comes.
            (.., true) => 7.0,
            _ => 25.0,
        };
        self.soot = (self.soot + per_hour * dt / 3600.0).clamp(0.0, 150.0);
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
        self.soot >= 95.0 && !self.regenerating
    }

    /// It is clogged.
    pub(crate) fn has_failed(&self) -> bool {
        self.soot >= 120.0
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
}
