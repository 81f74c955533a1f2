//! What a three-phase meter sees: voltages, currents, powers and energy of one feed.

/// One measuring point: the mains or the genset.
#[derive(Clone, Debug, Default)]
pub(crate) struct Feed {
    /// Phase to neutral, V.
    pub(crate) voltage: [f64; 3],
    /// Hz.
    pub(crate) frequency: f64,
    /// The phases follow each other the wrong way round.
    pub(crate) phase_order_wrong: bool,
    /// kW of each phase, positive towards the load.
    pub(crate) active: [f64; 3],
    /// kvar of each phase, positive where the load is inductive.
    pub(crate) reactive: [f64; 3],
}

impl Feed {
    /// V of L1-L2, L2-L3 and L3-L1, the phases standing 120 degrees apart.
    pub(crate) fn line_voltage(&self) -> [f64; 3] {
        let [l1, l2, l3] = self.voltage;
        [(l1, l2), (l2, l3), (l3, l1)].map(|(a, b)| (a * a + b * b + a * b).sqrt())
    }

    /// A of each phase.
    pub(crate) fn current(&self) -> [f64; 3] {
        let apparent = self.apparent();
        std::array::from_fn(|phase| match self.voltage[phase] {
            volts if volts > 1.0 => apparent[phase] * 1000.0 / volts,
            _ => 0.0,
        })
    }

    /// A in the neutral conductor: what three phase currents of one power factor leave over.
    pub(crate) fn neutral_current(&self) -> f64 {
        let [a, b, c] = self.current();
        (a * a + b * b + c * c - a * b - b * c - c * a).max(0.0).sqrt()
    }

    /// kVA of each phase.
    pub(crate) fn apparent(&self) -> [f64; 3] {
        std::array::from_fn(|phase| self.active[phase].hypot(self.reactive[phase]))
    }

    /// kW of all phases.
    pub(crate) fn total_active(&self) -> f64 {
        self.active.iter().sum()
    }

    /// kvar of all phases.
    pub(crate) fn total_reactive(&self) -> f64 {
        self.reactive.iter().sum()
    }

    /// kVA of all phases.
    pub(crate) fn total_apparent(&self) -> f64 {
        self.total_active().hypot(self.total_reactive())
    }

    /// Of each phase; 0 where nothing flows.
    pub(crate) fn power_factor(&self) -> [f64; 3] {
        let apparent = self.apparent();
        std::array::from_fn(|phase| ratio(self.active[phase], apparent[phase]))
    }

    /// Of all phases together; 0 where nothing flows.
    pub(crate) fn total_power_factor(&self) -> f64 {
        ratio(self.total_active(), self.total_apparent())
    }

    /// Mean of the phase voltages, V.
    pub(crate) fn average_voltage(&self) -> f64 {
        self.voltage.iter().sum::<f64>() / 3.0
    }

    /// Mean of the phase currents, A.
    pub(crate) fn average_current(&self) -> f64 {
        self.current().iter().sum::<f64>() / 3.0
    }
}

/// Energy through a feed; every part only grows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Energy {
    /// kWh towards the load.
    pub(crate) active: f64,
    /// kWh away from the load.
    pub(crate) exported: f64,
    /// kvarh, inductive.
    pub(crate) inductive: f64,
    /// kvarh, capacitive.
    pub(crate) capacitive: f64,
}

impl Energy {
    pub(crate) fn add(&mut self, feed: &Feed, seconds: f64) {
        let hours = seconds / 3600.0;
        let (active, reactive) = (feed.total_active(), feed.total_reactive());
        self.active += active.max(0.0) * hours;
        self.exported += (-active).max(0.0) * hours;
        self.inductive += reactive.max(0.0) * hours;
        self.capacitive += (-reactive).max(0.0) * hours;
    }
}

fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn balanced() -> Feed {
        Feed { voltage: [230.0; 3], frequency: 50.0, active: [8.0; 3], reactive: [6.0; 3], ..Feed::default() }
    }

    #[test]
    fn a_balanced_feed_obeys_the_textbook() {
        let feed = balanced();
        for line in feed.line_voltage() {
            assert!((line - 230.0 * 3.0_f64.sqrt()).abs() < 1e-9);
        }
        assert_eq!(feed.apparent(), [10.0; 3]);
        assert!((feed.current()[0] - 43.478).abs() < 1e-3);
        assert!(feed.neutral_current() < 1e-6);
        assert!((feed.total_apparent() - 30.0).abs() < 1e-9);
        assert!((feed.total_power_factor() - 0.8).abs() < 1e-9);
    }

    #[test]
    fn one_loaded_phase_returns_through_the_neutral() {
        let feed = Feed { active: [8.0, 0.0, 0.0], reactive: [6.0, 0.0, 0.0], ..balanced() };
        assert!((feed.neutral_current() - feed.current()[0]).abs() < 1e-9);
    }

    #[test]
    fn a_dead_feed_carries_nothing() {
        let feed = Feed::default();
        assert_eq!(feed.current(), [0.0; 3]);
        assert_eq!(feed.total_power_factor(), 0.0);
    }

    #[test]
    fn energy_is_power_over_time_by_direction() {
        let mut energy = Energy::default();
        energy.add(&balanced(), 3600.0);
        let back = Feed { active: [-1.0; 3], reactive: [-2.0; 3], ..balanced() };
        energy.add(&back, 1800.0);
        assert_eq!(
            (energy.active, energy.exported, energy.inductive, energy.capacitive),
            (24.0, 1.5, 18.0, 3.0)
        );
    }
}
