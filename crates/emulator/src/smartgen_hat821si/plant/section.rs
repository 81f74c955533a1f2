//! What hangs on one bus section: consumers behind the load switches, a power station of the neighbour, and faults.

use crate::random::{Drift, Random};

use super::super::switches::FEEDERS;

/// Seconds after which a solar park comes back to a section that was dead.
const RECONNECT: f64 = 30.0;
/// Part of the load that each shed step of non-essential consumers takes away.
const SHED_PART: f64 = 0.06;

/// kW and kvar of each phase that a section takes at full voltage, and A from phase A to earth.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Demand {
    pub(super) active: [f64; 3],
    pub(super) reactive: [f64; 3],
    pub(super) earth: f64,
}

impl Demand {
    pub(super) fn add(&mut self, other: &Self, part: f64) {
        for phase in 0..3 {
            self.active[phase] += part * other.active[phase];
            self.reactive[phase] += part * other.reactive[phase];
        }
        self.earth += part * other.earth;
    }
}

/// What hangs on one bus section.
#[derive(Clone, Debug)]
pub(in super::super) struct Section {
    /// kW of all consumers together, where somebody has set it.
    pub(in super::super) load: Option<f64>,
    /// Of all consumers together, where somebody has set it.
    pub(in super::super) power_factor: Option<f64>,
    /// kW that a solar park feeds into the section.
    pub(in super::super) infeed: f64,
    /// A that flow from phase A to earth.
    pub(in super::super) earth_fault: f64,
    /// The bus bars are short-circuited.
    pub(in super::super) short_circuit: bool,
    /// kW of each load switch.
    feeders: [f64; FEEDERS],
    /// Seconds until the solar park feeds again.
    away: f64,
    level: Drift,
    wandering_factor: Drift,
    shares: [Drift; 3],
}

impl Section {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            load: None,
            power_factor: None,
            infeed: 0.0,
            earth_fault: 0.0,
            short_circuit: false,
            feeders: std::array::from_fn(|_| random.between(110.0, 260.0)),
            away: 0.0,
            level: Drift::new(0.03, 60.0, random),
            wandering_factor: Drift::new(0.008, 60.0, random),
            shares: std::array::from_fn(|_| Drift::new(0.004, 45.0, random)),
        }
    }

    /// Says whether the section has voltage: the solar park leaves a dead one.
    pub(super) fn notice(&mut self, dt: f64, alive: bool) {
        self.away = if alive { (self.away - dt).max(0.0) } else { RECONNECT };
    }

    /// `carrying` says which load switches do, `shed` how many steps of non-essential consumers are off.
    pub(super) fn step(
        &mut self,
        dt: f64,
        carrying: &[bool; FEEDERS],
        shed: u16,
        random: &mut Random,
    ) -> Demand {
        let infeed = if self.away > 0.0 { 0.0 } else { self.infeed };
        let whole: f64 = self.feeders.iter().sum();
        let level = 1.0 + self.level.step(dt, random);
        let level = self.load.map_or(level, |kw| kw / whole);
        let wandering = 0.92 + self.wandering_factor.step(dt, random);
        let power_factor = self.power_factor.unwrap_or(wandering);
        let reactive_part = (1.0 - power_factor * power_factor).max(0.0).sqrt() / power_factor;
        let carried = self.feeders.iter().zip(carrying).filter(|(_, carries)| **carries);
        let kept = 1.0 - SHED_PART * f64::from(shed);
        let total = kept * level * carried.map(|(kw, _)| kw).sum::<f64>();

        let mut shares = [0.337, 0.333, 0.330];
        for (share, drift) in shares.iter_mut().zip(&mut self.shares) {
            *share += drift.step(dt, random);
        }
        let whole: f64 = shares.iter().sum();
        let active = shares.map(|share| total * share / whole);
        Demand {
            active: active.map(|kw| kw - infeed / 3.0),
            reactive: active.map(|kw| kw * reactive_part),
            earth: self.earth_fault,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn active(section: &mut Section, carrying: [bool; FEEDERS], shed: u16) -> f64 {
        section.step(0.1, &carrying, shed, &mut Random::new(1)).active.iter().sum()
    }

    #[test]
    fn consumers_take_what_they_are_set_to_and_the_rest_adds_to_it() {
        let mut section = Section::new(&mut Random::new(3));
        section.load = Some(1200.0);
        assert!((active(&mut section, [true; FEEDERS], 0) - 1200.0).abs() < 1e-6);
        assert!((active(&mut section, [true; FEEDERS], 2) - 0.88 * 1200.0).abs() < 1e-6);
        assert_eq!(active(&mut section, [false; FEEDERS], 0), 0.0);
        section.infeed = 1500.0;
        assert!((active(&mut section, [true; FEEDERS], 0) + 300.0).abs() < 1e-6);
        section.notice(0.1, false);
        section.notice(29.0, true);
        assert!(active(&mut section, [true; FEEDERS], 0) > 1000.0, "it waits");
        section.notice(1.0, true);
        assert!(active(&mut section, [true; FEEDERS], 0) < 0.0);
        section.power_factor = Some(0.8);
        section.infeed = 0.0;
        let demand = section.step(0.1, &[true; FEEDERS], 0, &mut Random::new(1));
        assert!((demand.reactive.iter().sum::<f64>() - 900.0).abs() < 1e-6);
    }
}
