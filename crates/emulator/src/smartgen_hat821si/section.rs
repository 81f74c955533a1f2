//! What the load switches of one bus section feed.

use crate::random::{Drift, Random};

use super::plant::FEEDERS;

/// kW and kvar of each phase that a section takes at full voltage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub(super) active: [f64; 3],
    pub(super) reactive: [f64; 3],
}

/// What hangs on one bus section.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// kW of each load switch.
    feeders: [f64; FEEDERS],
    level: Drift,
    power_factor: Drift,
    shares: [Drift; 3],
}

impl Section {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            feeders: std::array::from_fn(|_| random.between(110.0, 260.0)),
            level: Drift::new(0.03, 60.0, random),
            power_factor: Drift::new(0.008, 60.0, random),
            shares: std::array::from_fn(|_| Drift::new(0.004, 45.0, random)),
        }
    }

    pub(super) fn step(&mut self, dt: f64, closed: &[bool; FEEDERS], random: &mut Random) -> Demand {
        let level = 1.0 + self.level.step(dt, random);
        let power_factor = 0.92 + self.power_factor.step(dt, random);
        let reactive_part = (1.0 - power_factor * power_factor).sqrt() / power_factor;
        let connected = self.feeders.iter().zip(closed).filter(|(_, closed)| **closed);
        let total = level * connected.map(|(kw, _)| kw).sum::<f64>();

        let mut shares = [0.337, 0.333, 0.330];
        for (share, drift) in shares.iter_mut().zip(&mut self.shares) {
            *share += drift.step(dt, random);
        }
        let whole: f64 = shares.iter().sum();
        let active = shares.map(|share| total * share / whole);
        Demand { active, reactive: active.map(|kw| kw * reactive_part) }
    }
}
