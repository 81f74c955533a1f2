//! One source as it is at the terminals of its switch: mains, the genset that stands in for them, and the meter there.

use std::f64::consts::TAU;
use std::time::Duration;

use crate::plant::{Energy, Feed, Supply};
use crate::random::{Drift, Random, approach};

use super::engine::holds;
use super::section::Demand;
use super::{Grid, PHASE_VOLTAGE, RATED_FREQUENCY, turned};

/// Seconds that a change from mains to genset or back leaves the terminals dead.
const CHANGEOVER: f64 = 0.5;
/// A phase below this part of its voltage has neither angle nor frequency.
const PRESENT: f64 = 0.1;
/// Seconds in which a genset yields to what is asked of it.
const INERTIA: f64 = 0.8;
/// Seconds of a flicker, and how much of them the voltage is low.
const FLICKER: (f64, f64) = (2.0, 0.6);

/// How the mains behind a source are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Mains {
    Normal,
    Failed,
    Sagging,
    Swelling,
    /// A phase, 0 to 2, is missing.
    Lost(usize),
    /// Two phases are swapped.
    Reversed,
    /// Dips follow each other, each shorter than anybody waits.
    Flickering,
}

impl Mains {
    /// Part of the voltage that each phase keeps.
    fn remains(self, time: f64) -> [f64; 3] {
        match self {
            Self::Normal | Self::Reversed => [1.0; 3],
            Self::Failed => [0.0; 3],
            Self::Sagging => [0.68; 3],
            Self::Swelling => [1.28; 3],
            Self::Lost(lost) => std::array::from_fn(|phase| if phase == lost { 0.0 } else { 1.0 }),
            Self::Flickering if time.rem_euclid(FLICKER.0) < FLICKER.1 => [0.6; 3],
            Self::Flickering => [1.0; 3],
        }
    }
}

/// What the transformers of a source show.
#[derive(Clone, Debug)]
pub(in super::super) struct Meter {
    /// Voltages and frequency as the wires bring them; powers as amounts, for no register of theirs has a sign.
    pub(in super::super) feed: Feed,
    /// A of each phase.
    pub(in super::super) current: [f64; 3],
    /// Degrees of each phase that has a voltage.
    pub(in super::super) angles: [Option<f64>; 3],
    /// A that the three phases leave over, and degrees of that.
    pub(in super::super) residual: (f64, f64),
    /// kW towards the load; negative where it flows back into the source.
    pub(in super::super) power: f64,
}

/// One source.
#[derive(Clone, Debug)]
pub(in super::super) struct Source {
    pub(in super::super) mains: Mains,
    /// V from phase to neutral, where somebody has set it.
    pub(in super::super) set_voltage: Option<f64>,
    /// Hz, where somebody has set it.
    pub(in super::super) set_frequency: Option<f64>,
    /// Degrees that its mains stand ahead of where they would otherwise.
    pub(in super::super) shift: f64,
    /// The phase whose wire from the voltage transformer is broken.
    pub(in super::super) broken_wire: Option<usize>,
    pub(in super::super) energy: Energy,
    /// As it is, whatever the meter shows.
    pub(super) feed: Feed,
    on_genset: bool,
    changing: f64,
    /// A short circuit hangs on it.
    shorted: bool,
    /// kW that its sections would take at full voltage.
    asked: f64,
    /// Part of its speed and voltage that its genset holds under that.
    held: f64,
    time: f64,
    /// Degrees of phase A against a clock of exactly 50 Hz.
    angle: f64,
    level: Drift,
    phases: [Drift; 3],
    /// Degrees that its feeder leads the grid.
    lead: f64,
    swing: Drift,
    governor: Drift,
    /// Part of its voltage that each phase has now.
    parts: [f64; 3],
}

/// What a source stands in at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    /// The genset behind it has voltage.
    pub(super) genset: bool,
    /// The genset is to carry load even while the mains are there.
    pub(super) on_load: bool,
    /// Hz of the source that it runs in parallel with.
    pub(super) tied: Option<f64>,
    /// A short circuit that no switch has cleared hangs on it.
    pub(super) shorted: bool,
}

impl Source {
    pub(super) fn new(random: &mut Random) -> Self {
        Self {
            mains: Mains::Normal,
            set_voltage: None,
            set_frequency: None,
            shift: 0.0,
            broken_wire: None,
            energy: Energy::default(),
            feed: Feed::default(),
            on_genset: false,
            changing: 0.0,
            shorted: false,
            asked: 0.0,
            held: 1.0,
            time: 0.0,
            angle: 0.0,
            level: Drift::new(25.0, 180.0, random),
            phases: std::array::from_fn(|_| Drift::new(9.0, 15.0, random)),
            lead: random.between(-3.0, 3.0),
            swing: Drift::new(0.4, 30.0, random),
            governor: Drift::new(0.03, 4.0, random),
            parts: [1.0; 3],
        }
    }

    /// Counts what it has delivered in its time: on the average less than it carries now.
    pub(in super::super) fn has_served(&mut self, time: Duration, part: f64) {
        let hours = part * time.as_secs_f64() / 3600.0;
        self.energy.active = hours * self.feed.total_active();
        self.energy.inductive = hours * self.feed.total_reactive();
    }

    /// Its terminals hang on the genset.
    pub(in super::super) fn is_on_genset(&self) -> bool {
        self.on_genset
    }

    /// Part of its speed that the genset holds which it hangs on.
    pub(super) fn holds(&self) -> f64 {
        match (self.on_genset, self.shorted) {
            (true, true) => 0.0,
            (true, false) => self.held,
            (false, _) => 1.0,
        }
    }

    /// Mean of the phase voltages, as a part of the rated one.
    pub(super) fn average_part(&self) -> f64 {
        self.feed.average_voltage() / PHASE_VOLTAGE
    }

    /// What it gives to whoever is connected.
    pub(super) fn supply(&self) -> Supply {
        Supply {
            parts: self.feed.voltage.map(|volts| volts / PHASE_VOLTAGE),
            frequency: self.feed.frequency,
            reversed: self.is_reversed(),
        }
    }

    /// V from phase to neutral that its mains have, were they not ill.
    pub(in super::super) fn mains_voltage(&self) -> f64 {
        self.set_voltage.unwrap_or(PHASE_VOLTAGE + 40.0 + self.level.value())
    }

    /// Hz at its terminals.
    pub(in super::super) fn frequency(&self) -> f64 {
        self.feed.frequency
    }

    fn is_reversed(&self) -> bool {
        self.mains == Mains::Reversed && !self.on_genset
    }

    /// Degrees of each phase, 0 to 360.
    pub(super) fn angles(&self) -> [f64; 3] {
        let behind = if self.is_reversed() { [0.0, 120.0, 240.0] } else { [0.0, 240.0, 120.0] };
        behind.map(|behind| (self.angle + behind).rem_euclid(360.0))
    }

    /// Degrees of each phase's current, 0 to 360; 0 where none flows.
    pub(in super::super) fn current_angles(&self) -> [f64; 3] {
        let angles = self.angles();
        std::array::from_fn(|phase| {
            let (active, reactive) = (self.feed.active[phase], self.feed.reactive[phase]);
            if active == 0.0 && reactive == 0.0 {
                return 0.0;
            }
            (angles[phase] - reactive.atan2(active).to_degrees()).rem_euclid(360.0)
        })
    }

    /// A and degrees of what the three currents leave over.
    fn residual(&self) -> (f64, f64) {
        let (mut across, mut along) = (0.0, 0.0);
        for (current, angle) in self.feed.current().into_iter().zip(self.current_angles()) {
            across += current * (angle / 360.0 * TAU).sin();
            along += current * (angle / 360.0 * TAU).cos();
        }
        (across.hypot(along), across.atan2(along).to_degrees().rem_euclid(360.0))
    }

    /// What its transformers show of it.
    pub(in super::super) fn meter(&self) -> Meter {
        let mut feed = self.feed.clone();
        if let Some(volts) = self.broken_wire.and_then(|phase| feed.voltage.get_mut(phase)) {
            *volts = 0.0;
        }
        let has = |phase: usize| feed.voltage[phase] > PRESENT * PHASE_VOLTAGE;
        if !(0..3).any(has) {
            feed.frequency = 0.0;
        }
        let angles = self.angles();
        let angles = std::array::from_fn(|phase| has(phase).then_some(angles[phase]));
        let forwards = |total: f64, phases: [f64; 3]| phases.map(|part| (part * total.signum()).max(0.0));
        feed.active = forwards(self.feed.total_active(), feed.active);
        feed.reactive = forwards(self.feed.total_reactive(), feed.reactive);
        let mut current = feed.current();
        if let Some(phase) = self.broken_wire {
            // The current transformer is another one; the power is worked out from both.
            current[phase] = self.feed.current()[phase];
            (feed.active[phase], feed.reactive[phase]) = (0.0, 0.0);
        }
        Meter { feed, current, angles, residual: self.residual(), power: self.feed.total_active() }
    }

    pub(super) fn step(&mut self, dt: f64, around: Surroundings, grid: &Grid, random: &mut Random) {
        self.time += dt;
        let mains_fail = grid.failed || !self.mains_are_healthy();
        let on_genset = around.genset && (around.on_load || mains_fail);
        if on_genset != self.on_genset {
            self.on_genset = on_genset;
            (self.changing, self.held) = (CHANGEOVER, 1.0);
        }
        self.changing = (self.changing - dt).max(0.0);
        self.shorted = around.shorted;
        let alone = on_genset && around.tied.is_none();
        approach(&mut self.held, if alone { holds(self.asked) } else { 1.0 }, INERTIA, dt);
        let remains = match (self.changing > 0.0 || self.shorted, on_genset) {
            (true, _) => [0.0; 3],
            (false, true) => [1.0; 3],
            (false, false) if grid.failed => [0.0; 3],
            (false, false) => self.mains.remains(self.time),
        };
        for (part, target) in self.parts.iter_mut().zip(remains) {
            approach(part, target, 0.08, dt);
            // A meter shows no voltage that only the arithmetic keeps.
            if target == 0.0 && *part < 0.02 {
                *part = 0.0;
            }
        }
        // The sources sag a little under what they carried the moment before.
        let sag = 0.012 * self.feed.total_active();
        let own = PHASE_VOLTAGE + 40.0 + self.level.step(dt, random);
        let level = match self.set_voltage {
            Some(volts) if !on_genset => volts,
            _ => (own - sag) * self.held,
        };
        for (phase, part) in self.parts.into_iter().enumerate() {
            self.feed.voltage[phase] = part * (level + self.phases[phase].step(dt, random)).max(0.0);
        }
        let frequency = self.turn(dt, around, grid, random);
        let present = self.feed.voltage.iter().any(|volts| *volts > PRESENT * PHASE_VOLTAGE);
        self.feed.frequency = if present { frequency } else { 0.0 };
    }

    /// Lets its angle turn; Hz.
    fn turn(&mut self, dt: f64, around: Surroundings, grid: &Grid, random: &mut Random) -> f64 {
        let (swing, governor) = (self.swing.step(dt, random), self.governor.step(dt, random));
        let own = match (self.on_genset, self.set_frequency) {
            // A genset gives way under load, the grid does not.
            (true, _) => {
                let droop = 0.0002 * self.feed.total_active();
                Some((RATED_FREQUENCY + 0.25 - droop + governor) * self.held)
            }
            (false, Some(hertz)) => Some(hertz),
            (false, None) => None,
        };
        // In parallel what is not the grid is dragged along.
        let own = own.map(|hertz| around.tied.unwrap_or(hertz));
        match own {
            Some(hertz) => {
                self.angle = turned(self.angle, hertz, dt);
                hertz
            }
            None => {
                self.angle = (grid.angle + self.lead + self.shift + swing).rem_euclid(360.0);
                // What one meter differs from the other.
                grid.frequency + 0.1 * governor
            }
        }
    }

    /// Whether the changeover of the genset leaves its terminals to the mains.
    fn mains_are_healthy(&self) -> bool {
        let hertz = self.set_frequency.unwrap_or(RATED_FREQUENCY);
        let part = self.mains_voltage() / PHASE_VOLTAGE;
        matches!(self.mains, Mains::Normal | Mains::Flickering)
            && (0.85..1.15).contains(&part)
            && (hertz - RATED_FREQUENCY).abs() < 2.0
    }

    /// Takes its share of the sections, kW and kvar of each phase at full voltage. Whole kW and kvar: totals are then
    /// the exact sums of what is shown.
    pub(super) fn load(&mut self, dt: f64, share: &Demand) {
        self.asked = share.active.iter().sum();
        for phase in 0..3 {
            let volts = self.feed.voltage[phase];
            let part = (volts / PHASE_VOLTAGE).powi(2);
            let earth = if phase == 0 { share.earth * volts / 1000.0 } else { 0.0 };
            self.feed.active[phase] = (share.active[phase] * part + earth).round();
            self.feed.reactive[phase] = (share.reactive[phase] * part).round();
        }
        self.energy.add(&self.feed, dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source() -> Source {
        let mut source = Source::new(&mut Random::new(4));
        source.feed = Feed {
            voltage: [5800.0; 3],
            frequency: 50.0,
            active: [800.0, 790.0, 780.0],
            reactive: [300.0; 3],
            ..Feed::default()
        };
        source
    }

    #[test]
    fn what_was_delivered_fits_the_time() {
        let mut source = source();
        source.has_served(Duration::from_secs(3600 * 100), 0.5);
        assert!((source.energy.active - 50.0 * source.feed.total_active()).abs() < 1e-6);
        assert!(source.energy.inductive < source.energy.active);
    }

    #[test]
    fn the_residual_is_what_the_phases_leave_over() {
        let mut source = source();
        source.feed.active = [800.0; 3];
        assert!(source.residual().0 < 1e-6);
        source.feed.active[1] = 0.0;
        source.feed.reactive[1] = 0.0;
        assert!((source.residual().0 - source.feed.current()[0]).abs() < 1e-6);
    }

    #[test]
    fn a_broken_wire_hides_a_voltage_and_no_current() {
        let mut source = source();
        let whole = source.meter();
        source.broken_wire = Some(1);
        let meter = source.meter();
        assert_eq!(meter.feed.voltage, [5800.0, 0.0, 5800.0]);
        assert!(meter.angles[1].is_none() && meter.angles[0].is_some());
        assert_eq!(meter.current, whole.current);
        assert_eq!((meter.feed.active[1], meter.feed.active[0]), (0.0, 800.0));
    }

    #[test]
    fn power_that_flows_back_is_shown_as_an_amount() {
        let mut source = source();
        source.feed.active = [-300.0, -310.0, 5.0];
        let meter = source.meter();
        assert_eq!(meter.feed.active, [300.0, 310.0, 0.0]);
        assert_eq!(meter.power, -605.0);
    }

    #[test]
    fn swapped_phases_turn_the_other_way() {
        let mut source = source();
        let [a, b, _] = source.angles();
        assert_eq!((a - b).rem_euclid(360.0), 120.0);
        source.mains = Mains::Reversed;
        let [a, b, _] = source.angles();
        assert_eq!((a - b).rem_euclid(360.0), 240.0);
    }
}
