//! A working day on the demonstration site, told again and again: air is wanted, somebody draws fuel, somebody fills up.

/// Seconds until the story starts over.
const CYCLE: f64 = 300.0;
/// L/s that a lamp tower takes from the tank.
const DRAW: f64 = 0.3;
/// Percent to which the attendant fills the tank: low enough that the next draw reaches the warning.
const FILLED: f64 = 22.5;

/// What happens at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// The site wants the engine.
    pub(super) engine: bool,
    /// The site wants air.
    pub(super) air: bool,
    /// L/s drawn from the tank by others.
    pub(super) fuel_draw: f64,
    /// Somebody has opened the canopy to fill the tank.
    pub(super) attendant: bool,
}

impl Scene {
    pub(super) const NOTHING: Self = Self { engine: false, air: false, fuel_draw: 0.0, attendant: false };

    /// The scene at `time` seconds since power-on.
    pub(super) fn at(time: f64) -> Self {
        let moment = time.rem_euclid(CYCLE);
        Self {
            engine: (10.0..210.0).contains(&moment),
            air: (50.0..210.0).contains(&moment),
            fuel_draw: if (85.0..110.0).contains(&moment) { DRAW } else { 0.0 },
            attendant: (272.0..294.0).contains(&moment),
        }
    }

    /// Whether the attendant still fills a tank with this level in percent.
    pub(super) fn refills(self, level: f64) -> bool {
        self.attendant && level < FILLED
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_repeats() {
        assert_eq!(Scene::at(0.0), Scene::NOTHING);
        assert!(Scene::at(20.0).engine && !Scene::at(20.0).air);
        assert_eq!(Scene::at(90.0), Scene::at(90.0 + 4.0 * CYCLE));
    }

    #[test]
    fn the_attendant_fills_up_to_the_mark() {
        let scene = Scene::at(280.0);
        assert!(scene.refills(20.0) && !scene.refills(22.5));
        assert!(!Scene::NOTHING.refills(1.0));
    }
}
