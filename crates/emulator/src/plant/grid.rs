//! The public grid at the meter, and what can be wrong with it.

use crate::random::{Drift, Random, approach};

/// V between phase and neutral, and Hz.
const NOMINAL_VOLTAGE: f64 = 231.5;
const NOMINAL_FREQUENCY: f64 = 50.0;
/// Part of its voltage that a sag leaves, and that a swell makes of it: beyond every usual limit.
const SAG: f64 = 0.72;
const SWELL: f64 = 1.18;
/// Below this part of its voltage a phase is as good as dead.
const UNSEEN: f64 = 0.02;
/// V below which a meter finds no frequency.
const NO_FREQUENCY: f64 = 15.0;
/// V below which a phase feeds nobody.
pub(super) const DEAD_PHASE: f64 = 50.0;
/// V from which all phases are beyond that, however they wander.
const ALIVE: f64 = 53.0;
/// Hz a second at which the grid drifts to another frequency.
const DRIFT: f64 = 0.5;

/// What switchgear farther up gives, as parts of its rated voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Supply {
    /// Of each phase.
    pub(crate) parts: [f64; 3],
    /// Hz; 0 where nothing is there.
    pub(crate) frequency: f64,
    /// Two phases have changed places.
    pub(crate) reversed: bool,
}

/// What is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Condition {
    Normal,
    Failed,
    Sagging,
    Swelling,
    /// A phase by its index.
    Lost(usize),
    /// Two phases have changed places.
    Reversed,
    Flickering,
}

#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) condition: Condition,
    /// V between phase and neutral that it is held at; none where it wanders by itself.
    pub(super) held_voltage: Option<f64>,
    /// Hz that it is held at.
    pub(super) held_frequency: Option<f64>,
    /// The line is switched off, whatever its condition.
    pub(super) outage: bool,
    /// What feeds the line; none where that is always there.
    pub(super) supply: Option<Supply>,
    level: f64,
    /// Hz that it has, and Hz with its wandering.
    frequency: f64,
    hertz: f64,
    common: Drift,
    phases: [Drift; 3],
    wander: Drift,
    /// Part of its voltage that each phase has.
    present: [f64; 3],
    flicker: Flicker,
}

impl Grid {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            condition: Condition::Normal,
            held_voltage: None,
            held_frequency: None,
            outage: false,
            supply: None,
            level: NOMINAL_VOLTAGE,
            frequency: NOMINAL_FREQUENCY,
            hertz: NOMINAL_FREQUENCY,
            common: Drift::new(1.2, 180.0, random),
            phases: std::array::from_fn(|_| Drift::new(0.5, 15.0, random)),
            wander: Drift::new(0.012, 8.0, random),
            present: [1.0; 3],
            flicker: Flicker::new(),
        }
    }

    /// Whether it can feed anybody.
    pub(super) fn is_alive(&self) -> bool {
        !self.outage && self.parts().iter().any(|part| part * self.level > ALIVE)
    }

    pub(super) fn is_reversed(&self) -> bool {
        let reversed = self.supply.is_some_and(|supply| supply.reversed);
        reversed != (self.condition == Condition::Reversed)
    }

    /// Hz, seen or not.
    pub(super) fn hertz(&self) -> f64 {
        self.hertz
    }

    /// V of each phase and the Hz that a meter sees. `load` in kW bends the voltage of a line that nobody holds.
    pub(super) fn step(&mut self, dt: f64, load: f64, random: &mut Random) -> ([f64; 3], f64) {
        let level = NOMINAL_VOLTAGE + self.common.step(dt, random) - 0.02 * load;
        match self.held_voltage {
            Some(held) => approach(&mut self.level, held, 0.3, dt),
            None => approach(&mut self.level, level, 0.3, dt),
        }
        let drift = self.held_frequency.unwrap_or(NOMINAL_FREQUENCY) - self.frequency;
        self.frequency += drift.clamp(-DRIFT * dt, DRIFT * dt);
        let own = self.frequency + self.wander.step(dt, random);
        // What somebody holds is held, wherever it comes from.
        let from_above = self.supply.filter(|supply| supply.frequency > 0.0 && self.held_frequency.is_none());
        self.hertz = from_above.map_or(own, |supply| supply.frequency);

        let remains = self.remains(dt, random);
        let mut voltage = [0.0; 3];
        for (phase, volts) in voltage.iter_mut().enumerate() {
            // Motors that run down hold the voltage for some periods.
            approach(&mut self.present[phase], remains[phase], 0.1, dt);
            let whole = self.level + self.phases[phase].step(dt, random);
            *volts = match self.present[phase] {
                0.999..=1.001 => whole,
                ..UNSEEN => 0.0,
                part => whole * part,
            }
            .max(0.0);
        }
        (voltage, found(voltage, self.hertz))
    }

    /// Part of its voltage that each phase is to have.
    fn remains(&mut self, dt: f64, random: &mut Random) -> [f64; 3] {
        if self.outage {
            return [0.0; 3];
        }
        if self.condition == Condition::Flickering {
            self.flicker.step(dt, random);
        }
        self.parts()
    }

    /// What the line's condition and what feeds it leave of the voltage of each phase.
    fn parts(&self) -> [f64; 3] {
        let own = |phase| match self.condition {
            Condition::Normal | Condition::Reversed => 1.0,
            Condition::Failed => 0.0,
            Condition::Sagging => SAG,
            Condition::Swelling => SWELL,
            Condition::Lost(lost) => f64::from(u8::from(phase != lost)),
            Condition::Flickering => self.flicker.part,
        };
        let supplied = self.supply.map_or([1.0; 3], |supply| supply.parts);
        std::array::from_fn(|phase| own(phase) * supplied[phase])
    }
}

/// The frequency that a meter finds at these voltages.
pub(super) fn found(voltage: [f64; 3], hertz: f64) -> f64 {
    if voltage.iter().any(|volts| *volts > NO_FREQUENCY) { hertz } else { 0.0 }
}

/// Dips that come and go.
#[derive(Clone, Debug)]
struct Flicker {
    part: f64,
    left: f64,
}

impl Flicker {
    fn new() -> Self {
        Self { part: 1.0, left: 0.0 }
    }

    fn step(&mut self, dt: f64, random: &mut Random) {
        self.left -= dt;
        if self.left <= 0.0 {
            (self.part, self.left) = match self.part {
                1.0.. => (random.between(0.3, 0.75), random.between(0.2, 1.2)),
                _ => (1.0, random.between(1.0, 6.0)),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(grid: &mut Grid, seconds: f64) -> ([f64; 3], f64) {
        let mut random = Random::new(4);
        let mut last = ([0.0; 3], 0.0);
        for _ in 0..(seconds * 10.0) as u32 {
            last = grid.step(0.1, 0.0, &mut random);
        }
        last
    }

    fn grid(condition: Condition) -> Grid {
        Grid { condition, ..Grid::new(&mut Random::new(1)) }
    }

    #[test]
    fn each_condition_shows_at_the_meter() {
        let volts = |condition| run(&mut grid(condition), 3.0).0;
        assert!(volts(Condition::Normal).iter().all(|volts| (225.0..238.0).contains(volts)));
        assert!(volts(Condition::Sagging).iter().all(|volts| (160.0..175.0).contains(volts)));
        assert!(volts(Condition::Swelling).iter().all(|volts| (264.0..282.0).contains(volts)));
        for lost in 0..3 {
            let volts = volts(Condition::Lost(lost));
            assert_eq!(volts[lost], 0.0);
            assert_eq!(volts.iter().filter(|volts| **volts > 225.0).count(), 2);
        }
        assert_eq!(run(&mut grid(Condition::Failed), 3.0), ([0.0; 3], 0.0));
        assert!(grid(Condition::Reversed).is_reversed());
    }

    #[test]
    fn what_feeds_it_is_what_it_has() {
        let supply = |parts, frequency| Some(Supply { parts, frequency, reversed: false });
        let mut grid = grid(Condition::Normal);
        grid.supply = supply([1.0, 0.7, 0.0], 49.7);
        let (volts, hertz) = run(&mut grid, 3.0);
        assert!(volts[0] > 225.0 && (155.0..170.0).contains(&volts[1]) && volts[2] == 0.0, "{volts:?}");
        assert!(hertz == 49.7 && grid.is_alive());
        grid.supply = supply([0.0; 3], 0.0);
        assert_eq!(run(&mut grid, 3.0), ([0.0; 3], 0.0));
        assert!(!grid.is_alive());
        grid.supply = Some(Supply { parts: [1.0; 3], frequency: 50.0, reversed: true });
        assert!(run(&mut grid, 3.0).0[0] > 225.0 && grid.is_alive() && grid.is_reversed());
        grid.condition = Condition::Reversed;
        assert!(!grid.is_reversed(), "twice is not at all");
    }

    #[test]
    fn a_flickering_grid_dips_and_comes_back_and_never_dies() {
        let (mut grid, mut random) = (grid(Condition::Flickering), Random::new(2));
        let walk: Vec<f64> = (0..600).map(|_| grid.step(0.1, 0.0, &mut random).0[0]).collect();
        let dips = walk.windows(2).filter(|pair| pair[0] > 190.0 && pair[1] <= 190.0).count();
        assert!((5..60).contains(&dips), "{dips}");
        assert!(walk.iter().all(|volts| *volts > 60.0) && grid.is_alive());
    }

    #[test]
    fn it_is_held_and_drifts_back() {
        let mut grid = grid(Condition::Normal);
        (grid.held_voltage, grid.held_frequency) = (Some(205.0), Some(52.0));
        let (_, first) = run(&mut grid, 1.0);
        assert!((50.3..50.7).contains(&first), "it drifts: {first}");
        let (volts, hertz) = run(&mut grid, 10.0);
        assert!((203.0..207.0).contains(&volts[0]) && (51.9..52.1).contains(&hertz), "{volts:?} {hertz}");
        (grid.held_voltage, grid.held_frequency) = (None, None);
        let (volts, hertz) = run(&mut grid, 10.0);
        assert!(volts[0] > 225.0 && (49.9..50.1).contains(&hertz));
        grid.held_voltage = Some(0.0);
        run(&mut grid, 3.0);
        assert!(!grid.is_alive());
    }
}
