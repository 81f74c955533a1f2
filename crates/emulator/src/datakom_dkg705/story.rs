//! Some minutes at the demonstration site, told again and again: a dip, an outage, an exercise on load.

use std::time::Duration;

/// Seconds until the story starts over.
const CYCLE: f64 = 330.0;
/// L/s that the neighbour's heating takes from the day tank.
const DRAW: f64 = 0.55;
const EXERCISE: Duration = Duration::from_secs(60);

/// What happens at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// The grid has no voltage.
    pub(super) mains_failed: bool,
    /// The genset is exercised on load, for so long from the first such moment on.
    pub(super) exercise: Option<Duration>,
    /// L/s drawn from the day tank by others.
    pub(super) fuel_draw: f64,
}

impl Scene {
    pub(super) const NOTHING: Self = Self { mains_failed: false, exercise: None, fuel_draw: 0.0 };

    /// The scene at `time` seconds since power-on.
    pub(super) fn at(time: f64) -> Self {
        let moment = time.rem_euclid(CYCLE);
        Self {
            // Three seconds are too short to start for; a minute is not.
            mains_failed: (15.0..18.0).contains(&moment) || (30.0..90.0).contains(&moment),
            exercise: (185.0..245.0).contains(&moment).then_some(EXERCISE),
            fuel_draw: if (190.0..220.0).contains(&moment) { DRAW } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_repeats() {
        assert_eq!(Scene::at(0.0), Scene::NOTHING);
        assert!(Scene::at(40.0).mains_failed);
        assert_eq!(Scene::at(200.0), Scene::at(200.0 + 4.0 * CYCLE));
    }
}
