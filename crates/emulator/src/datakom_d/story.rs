//! A short day at the demonstration site, told again and again: the exerciser runs the genset, somebody draws fuel.

/// Seconds until the story starts over.
const CYCLE: f64 = 270.0;
/// L/s that the neighbour's heating takes from the day tank.
const DRAW: f64 = 0.55;

/// What happens at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// The weekly exerciser wants the genset on load.
    pub(super) exerciser: bool,
    /// L/s drawn from the day tank by others.
    pub(super) fuel_draw: f64,
}

impl Scene {
    pub(super) const NOTHING: Self = Self { exerciser: false, fuel_draw: 0.0 };

    /// The scene at `time` seconds since power-on.
    pub(super) fn at(time: f64) -> Self {
        let moment = time.rem_euclid(CYCLE);
        Self {
            exerciser: (15.0..115.0).contains(&moment),
            fuel_draw: if (40.0..70.0).contains(&moment) { DRAW } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_repeats() {
        assert_eq!(Scene::at(0.0), Scene::NOTHING);
        assert!(Scene::at(20.0).exerciser);
        assert_eq!(Scene::at(50.0), Scene::at(50.0 + 4.0 * CYCLE));
    }
}
