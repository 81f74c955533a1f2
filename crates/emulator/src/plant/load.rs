//! The consumers of the site: what they want by the hour, and what they get at the voltage that there is.

use crate::random::{Drift, Random};

use super::RATED_VOLTAGE;

/// kW and kvar of each phase.
pub(super) type PhaseLoads = ([f64; 3], [f64; 3]);
pub(super) const NO_LOAD: PhaseLoads = ([0.0; 3], [0.0; 3]);

/// kW on every hour of a working day.
const DAY: [f64; 24] = [
    9.0, 8.0, 8.0, 8.0, 9.0, 12.0, 19.0, 30.0, 42.0, 48.0, 50.0, 48.0, 38.0, 46.0, 50.0, 48.0, 42.0, 34.0,
    30.0, 28.0, 24.0, 18.0, 13.0, 10.0,
];
/// Parts of the load on the three phases.
const EVEN: [f64; 3] = [0.342, 0.331, 0.327];
const UNEVEN: [f64; 3] = [0.55, 0.27, 0.18];

/// Part of the load that can be spared.
const SPARED: f64 = 0.2;

/// What the consumers want.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Demand {
    /// A base that wanders, and a machine that switches on and off.
    Varies,
    /// The curve of a working day.
    Daily,
    /// kW.
    Held(f64),
}

#[derive(Clone, Debug)]
pub(super) struct Load {
    pub(super) demand: Demand,
    /// None where it wanders.
    pub(super) power_factor: Option<f64>,
    pub(super) uneven: bool,
    /// What can be spared is switched off.
    pub(super) shed: bool,
    base: Drift,
    wander: Drift,
    shares: [Drift; 3],
    machine_on: bool,
    machine_switches_in: f64,
}

impl Load {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            demand: Demand::Varies,
            power_factor: None,
            uneven: false,
            shed: false,
            base: Drift::new(2.5, 90.0, random),
            wander: Drift::new(0.012, 60.0, random),
            shares: std::array::from_fn(|_| Drift::new(0.008, 120.0, random)),
            machine_on: false,
            machine_switches_in: random.between(20.0, 60.0),
        }
    }

    /// kW and kvar of each phase at these voltages, in the tenths that the controllers' meters resolve: totals are then
    /// the exact sums of what is shown.
    pub(super) fn step(&mut self, dt: f64, hour: f64, volts: [f64; 3], random: &mut Random) -> PhaseLoads {
        let part = if self.shed { 1.0 - SPARED } else { 1.0 };
        let wanted = tenth(part * self.wanted(dt, hour, random));
        let wander = self.wander.step(dt, random);
        let power_factor = self.power_factor.unwrap_or(0.885 + wander);
        let reactive_part = (1.0 - power_factor * power_factor).max(0.0).sqrt() / power_factor;

        let mut shares = if self.uneven { UNEVEN } else { EVEN };
        for (share, drift) in shares.iter_mut().zip(&mut self.shares) {
            *share += drift.step(dt, random);
        }
        let whole: f64 = shares.iter().sum();
        let [l1, l2] = [shares[0], shares[1]].map(|share| tenth(wanted * share / whole));
        let at_rated = [l1, l2, wanted - l1 - l2];
        let active = std::array::from_fn(|phase| tenth(at_rated[phase] * taken(volts[phase])));
        (active, active.map(|kw| tenth(kw * reactive_part)))
    }

    fn wanted(&mut self, dt: f64, hour: f64, random: &mut Random) -> f64 {
        self.machine_switches_in -= dt;
        if self.machine_switches_in <= 0.0 {
            self.machine_on = !self.machine_on;
            self.machine_switches_in = random.between(40.0, 120.0);
        }
        let base = self.base.step(dt, random);
        match self.demand {
            Demand::Varies => 36.0 + base + if self.machine_on { 7.5 } else { 0.0 },
            Demand::Daily => of_the_day(hour) + 0.3 * base,
            Demand::Held(kw) => kw,
        }
    }
}

/// kW at a time of day.
fn of_the_day(hour: f64) -> f64 {
    let hour = hour.rem_euclid(24.0);
    let now = hour as usize % 24;
    let (from, to) = (DAY[now], DAY[(now + 1) % 24]);
    from + (to - from) * hour.fract()
}

/// Part of its power that a consumer takes: electronics hold it near the rated voltage, nothing does far from it.
fn taken(volts: f64) -> f64 {
    match volts / RATED_VOLTAGE {
        part if part < 0.2 => 0.0,
        part if part < 0.9 => (part / 0.9) * (part / 0.9).sqrt(),
        part if part > 1.1 => part / 1.1,
        _ => 1.0,
    }
}

pub(super) fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATED: [f64; 3] = [RATED_VOLTAGE; 3];

    fn at(load: &mut Load, hour: f64, volts: [f64; 3]) -> (f64, f64) {
        let (active, reactive) = load.step(0.1, hour, volts, &mut Random::new(2));
        (active.iter().sum(), reactive.iter().sum())
    }

    #[test]
    fn a_held_load_is_what_it_was_set_to_at_its_power_factor() {
        let mut load = Load::new(&mut Random::new(1));
        for (kw, power_factor) in [(0.0, 1.0), (12.3, 0.8), (66.6, 0.5), (120.0, 1.0)] {
            (load.demand, load.power_factor) = (Demand::Held(kw), Some(power_factor));
            let (active, reactive) = at(&mut load, 3.0, RATED);
            assert!((active - kw).abs() < 1e-9, "{active}");
            let expected = kw * (1.0 / (power_factor * power_factor) - 1.0).sqrt();
            assert!((reactive - expected).abs() < 0.16, "{reactive} {expected}");
        }
    }

    #[test]
    fn the_day_has_a_quiet_night_and_a_busy_morning() {
        let mut load = Load { demand: Demand::Daily, ..Load::new(&mut Random::new(1)) };
        let (night, _) = at(&mut load, 27.0, RATED);
        let (morning, _) = at(&mut load, 10.0, RATED);
        assert!((5.0..13.0).contains(&night) && (45.0..55.0).contains(&morning), "{night} {morning}");
        assert_eq!(of_the_day(7.5), 36.0);
        assert_eq!(of_the_day(23.5), 9.5);
    }

    #[test]
    fn a_dead_phase_takes_nothing_and_a_low_voltage_less() {
        let mut load = Load { demand: Demand::Held(60.0), ..Load::new(&mut Random::new(1)) };
        let (active, reactive) = load.step(0.1, 0.0, [0.0, 231.0, 160.0], &mut Random::new(2));
        assert_eq!((active[0], reactive[0]), (0.0, 0.0));
        assert!(active[1] > 15.0 && active[2] < 0.75 * active[1] && active[2] > 10.0, "{active:?}");
    }
}
