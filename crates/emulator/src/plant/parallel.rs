//! Genset and grid on one busbar: the angle between the two, how they meet, and who carries how much.

use crate::random::approach;

use super::alternator::Avr;
use super::grid::DEAD_PHASE;
use super::load::{PhaseLoads, tenth};
use super::{
    Feed, HERTZ_PER_RPM, RATED_KVA, RATED_KVAR, RATED_KW, RATED_RPM, RATED_VOLTAGE, Regulation, engine,
};

/// Seconds in which power follows a governor or a voltage regulator.
const FOLLOWING: f64 = 0.4;
/// kW that the grid needs to turn an engine without fuel.
const MOTORING: f64 = 9.6;
/// Beyond these two live sources are not joined without a jolt: degrees, Hz, V.
const ANGLE_WINDOW: f64 = 20.0;
const SLIP_WINDOW: f64 = 0.6;
const VOLTAGE_WINDOW: f64 = 25.0;
/// Seconds of a jolt until the genset breaker's own release has opened it.
const RELEASE: f64 = 0.2;
/// Times the rated power that flows between two sources in opposition.
const SURGE: f64 = 3.0;

/// How the genset stands to the mains.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Synchronism {
    /// Both have a voltage; the rest means little otherwise.
    pub(crate) live: bool,
    /// Degrees by which the genset leads, -180 to 180.
    pub(crate) angle: f64,
    /// Hz by which the genset is faster.
    pub(crate) slip: f64,
    /// V by which its average phase is higher.
    pub(crate) voltage: f64,
    /// The phases of both follow each other in one order.
    pub(crate) same_order: bool,
}

impl Synchronism {
    /// Whether a breaker between the two can be closed without a jolt.
    pub(crate) fn is_safe(&self) -> bool {
        self.live
            && self.same_order
            && self.angle.abs() <= ANGLE_WINDOW
            && self.slip.abs() <= SLIP_WINDOW
            && self.voltage.abs() <= VOLTAGE_WINDOW
    }
}

/// How genset and grid are tied together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Tie {
    #[default]
    Apart,
    /// Out of step: seconds until the release opens.
    Jolting(f64),
    Together,
}

/// What ties the genset to the grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Coupling {
    tie: Tie,
    angle: f64,
    /// kW and kvar of the genset.
    active: f64,
    reactive: f64,
}

impl Coupling {
    /// Degrees by which the genset leads the mains.
    pub(super) fn angle(&self) -> f64 {
        self.angle
    }

    /// Whether they pull at each other out of step.
    pub(super) fn is_jolting(&self) -> bool {
        matches!(self.tie, Tie::Jolting(_))
    }

    /// Joins them, or takes them apart. True when the genset breaker's release opens.
    pub(super) fn meet(&mut self, dt: f64, joined: bool, synchronism: &Synchronism) -> bool {
        let mut releases = false;
        self.tie = match (joined, self.tie) {
            (false, _) => Tie::Apart,
            (true, Tie::Apart) if synchronism.is_safe() => Tie::Together,
            (true, Tie::Apart) => Tie::Jolting(RELEASE),
            (true, Tie::Jolting(left)) if left > 1.5 * dt => Tie::Jolting(left - dt),
            (true, Tie::Jolting(_)) => {
                releases = true;
                Tie::Together
            }
            (true, Tie::Together) => Tie::Together,
        };
        releases
    }

    /// What the mains and the genset carry of a load when both feed it: the genset what its set points ask for, the
    /// grid the rest. A phase that the grid has lost is all the genset's.
    pub(super) fn split(
        &mut self,
        dt: f64,
        (active, reactive): PhaseLoads,
        grid: ([f64; 3], f64),
        genset: &Set<'_>,
    ) -> (PhaseLoads, PhaseLoads) {
        let (volts, hertz) = grid;
        if self.is_jolting() {
            let angle = self.angle.to_radians();
            self.active = SURGE * RATED_KW * angle.sin();
            self.reactive = SURGE * RATED_KVA * (1.0 - angle.cos()) + 0.5 * RATED_KVAR;
        } else {
            approach(&mut self.active, genset.active(hertz), FOLLOWING, dt);
            approach(&mut self.reactive, genset.reactive(live_average(volts)), FOLLOWING, dt);
        }
        let third = (tenth(self.active / 3.0), tenth(self.reactive / 3.0));
        let part = |whole: [f64; 3], third: f64| -> [f64; 3] {
            std::array::from_fn(|n| if volts[n] < DEAD_PHASE { whole[n] } else { third })
        };
        let own = (part(active, third.0), part(reactive, third.1));
        let rest = |whole: [f64; 3], part: [f64; 3]| std::array::from_fn(|n| tenth(whole[n] - part[n]));
        ((rest(active, own.0), rest(reactive, own.1)), own)
    }

    /// Lets the two run against each other, and remembers what the genset carries.
    pub(super) fn follow(&mut self, dt: f64, genset: &Feed, grid_frequency: f64) {
        match self.tie {
            Tie::Together => self.angle = 0.0,
            // The stronger drags the other into step.
            Tie::Jolting(_) => self.angle *= 0.6,
            Tie::Apart => {
                (self.active, self.reactive) = (genset.total_active(), genset.total_reactive());
                let angle = self.angle + 360.0 * (genset.frequency - grid_frequency) * dt;
                self.angle = (angle + 180.0).rem_euclid(360.0) - 180.0;
            }
        }
    }
}

/// What decides how much a genset carries beside the grid.
pub(super) struct Set<'a> {
    pub(super) running: bool,
    pub(super) runaway: bool,
    pub(super) governor: Regulation,
    pub(super) excitation: &'a Regulation,
    pub(super) avr: Avr,
}

impl Set<'_> {
    /// kW at a frequency that the grid holds.
    fn active(&self, hertz: f64) -> f64 {
        match (self.running, self.runaway) {
            (false, _) => -MOTORING,
            (_, true) => engine::MOST_KW,
            _ => (RATED_KW * self.governor.part_at(RATED_RPM, hertz / HERTZ_PER_RPM)).max(-MOTORING),
        }
    }

    /// kvar at a voltage that the grid holds.
    fn reactive(&self, volts: f64) -> f64 {
        match self.avr {
            // Without a field of its own it takes it from the grid.
            Avr::Failed => -0.7 * RATED_KVAR,
            Avr::High => 1.5 * RATED_KVAR,
            Avr::Normal => RATED_KVAR * self.excitation.part_at(RATED_VOLTAGE, volts),
        }
    }
}

/// V of the phases that have any.
pub(super) fn live_average(volts: [f64; 3]) -> f64 {
    let (sum, count) = volts
        .into_iter()
        .filter(|volts| *volts >= DEAD_PHASE)
        .fold((0.0, 0.0), |(sum, count), volts| (sum + volts, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}
