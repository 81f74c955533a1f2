//! The load valve of an ACC1700: open and shut by the discharge pressure, and kept shut by overload protection.

use std::time::Duration;

use super::setup::Setup;

/// The valve of a unit that is loaded, or not.
#[derive(Clone, Debug, Default)]
pub(super) struct LoadValve {
    open: bool,
    /// How long the engine has been overloaded.
    overloaded_for: Duration,
    /// How much longer overload protection keeps the valve shut at least.
    rest: Option<Duration>,
}

/// What the valve follows; nothing where nobody knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    /// The unit is loaded (43.6).
    pub(super) loaded: bool,
    /// kPa at the discharge.
    pub(super) pressure: Option<f64>,
    /// Percent of what the engine can give at its speed.
    pub(super) engine_load: Option<f64>,
}

impl LoadValve {
    pub(super) fn is_open(&self) -> bool {
        self.open
    }

    /// The engine was overloaded, and is kept unloaded (44.14).
    pub(super) fn protects(&self) -> bool {
        self.rest.is_some()
    }

    pub(super) fn step(&mut self, dt: Duration, demand: Demand, setup: &Setup) {
        self.protect(dt, demand, setup);
        self.follow(demand, setup);
    }

    /// Opens or shuts: at once, as whoever presses the key and reads back expects.
    pub(super) fn follow(&mut self, demand: Demand, setup: &Setup) {
        // Nobody fills a receiver whose pressure he does not know.
        let room = demand.pressure.is_some_and(|pressure| {
            pressure < setup.unload_pressure && (self.open || pressure < setup.load_pressure)
        });
        self.open = demand.loaded && room && !self.protects();
    }

    /// Opens for a unit that has just been loaded: it fills up to the unload pressure first.
    pub(super) fn load(&mut self, demand: Demand, setup: &Setup) {
        self.open = true;
        self.follow(demand, setup);
    }

    fn protect(&mut self, dt: Duration, demand: Demand, setup: &Setup) {
        let overloaded = demand.engine_load.is_some_and(|load| load >= setup.overload_limit);
        self.overloaded_for = if overloaded { self.overloaded_for + dt } else { Duration::ZERO };
        self.rest = match self.rest {
            None if demand.loaded && overloaded && self.overloaded_for >= setup.overload_delay => {
                Some(setup.overload_rest)
            }
            Some(rest) if overloaded || rest > dt => Some(rest.saturating_sub(dt)),
            _ => None,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);

    fn demand(pressure: f64) -> Demand {
        Demand { loaded: true, pressure: Some(pressure), engine_load: Some(60.0) }
    }

    #[test]
    fn it_hunts_between_its_limits() {
        for (changes, pressures) in [
            (&[][..], [0.0, 700.0, 749.0, 750.0, 700.0, 620.0, 619.0, 700.0, 800.0]),
            (
                &[("load_pressure", "500"), ("unload_pressure", "600")],
                [0.0, 599.0, 580.0, 600.0, 501.0, 500.0, 499.0, 550.0, 700.0],
            ),
            // The pressure at which it shuts has the last word.
            (&[("load_pressure", "2000")], [0.0, 700.0, 749.0, 750.0, 751.0, 800.0, 700.0, 749.0, 750.0]),
        ] {
            let (setup, mut valve) = (Setup::with(changes), LoadValve::default());
            let opens = pressures.map(|pressure| {
                valve.step(TENTH, demand(pressure), &setup);
                valve.is_open()
            });
            assert_eq!(opens, [true, true, true, false, false, false, true, true, false]);
        }
    }

    #[test]
    fn a_unit_that_is_loaded_between_the_limits_fills_up_first() {
        let (setup, mut valve) = (Setup::with(&[]), LoadValve::default());
        valve.follow(demand(700.0), &setup);
        assert!(!valve.is_open());
        valve.load(demand(700.0), &setup);
        assert!(valve.is_open());
        valve.load(demand(760.0), &setup);
        assert!(!valve.is_open());
        valve.load(Demand { loaded: false, ..demand(0.0) }, &setup);
        assert!(!valve.is_open());
    }

    #[test]
    fn it_stays_shut_while_nobody_knows_the_pressure() {
        let (setup, mut valve) = (Setup::with(&[]), LoadValve::default());
        valve.step(TENTH, Demand { pressure: None, ..demand(0.0) }, &setup);
        assert!(!valve.is_open());
    }

    #[test]
    fn overload_shuts_it_after_its_delay_and_for_its_rest_at_least() {
        let setup = Setup::with(&[("overload_delay", "1"), ("overload_rest_time", "2")]);
        let mut valve = LoadValve::default();
        let mut pass = |engine_load: Option<f64>, tenths: u32| {
            for _ in 0..tenths {
                valve.step(TENTH, Demand { engine_load, ..demand(300.0) }, &setup);
            }
            (valve.is_open(), valve.protects())
        };
        assert_eq!(pass(Some(109.9), 100), (true, false));
        assert_eq!(pass(Some(110.0), 9), (true, false));
        assert_eq!(pass(Some(110.0), 1), (false, true));
        assert_eq!(pass(Some(40.0), 19), (false, true));
        assert_eq!(pass(Some(40.0), 1), (true, false));
        // Nothing can be taken from an engine that is not loaded.
        let drag = Demand { loaded: false, engine_load: Some(130.0), ..demand(300.0) };
        let mut unloaded = LoadValve::default();
        (0..100).for_each(|_| unloaded.step(TENTH, drag, &setup));
        assert!(!unloaded.protects());
        // An engine that stays overloaded, whatever the valve does, is not loaded again.
        assert_eq!(pass(Some(130.0), 100), (false, true));
        assert_eq!(pass(Some(40.0), 1), (true, false));
        assert_eq!(pass(None, 100), (true, false), "without an ECU nobody knows the load");
    }
}
