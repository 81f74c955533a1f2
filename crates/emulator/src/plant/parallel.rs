//! Genset and grid on one busbar: the angle between the two, how they meet, and who carries how much.

use crate::random::approach;

use super::alternator::Avr;
use super::grid::DEAD_PHASE;
use super::load::{PhaseLoads, tenth};
use super::{
    Feed, HERTZ_PER_RPM, RATED_KVA, RATED_KVAR, RATED_KW, RATED_RPM, RATED_VOLTAGE, Regulation, engine,
};

/// Seconds in which power follows a governor or a voltage regulator.
pub(super) const FOLLOWING: f64 = 0.4;
/// kW that the grid needs to turn an engine without fuel.
pub(super) const MOTORING: f64 = 9.6;
/// Beyond these two live sources are not joined without a jolt: degrees, Hz, V.
const ANGLE_WINDOW: f64 = 20.0;
const SLIP_WINDOW: f64 = 0.6;
const VOLTAGE_WINDOW: f64 = 25.0;
/// Seconds of a jolt until the genset breaker's own release has opened it.
const RELEASE: f64 = 0.2;
/// Times the rated power that a source of full voltage sends into one of none.
const SURGE: f64 = 3.0;
/// Times the rated current that a dead line draws, with all that hangs on it, and the parts of it that are active and
/// reactive power.
const LINE_DRAWS: f64 = 2.5;
const LINE_PARTS: (f64, f64) = (0.5, 0.87);
/// V below which nothing to speak of flows into it.
const LEAST_VOLTAGE: f64 = 5.0;

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

    /// Part of the other's voltage that the genset sets against it: nothing of use where it turns the other way round.
    fn against(&self) -> f64 {
        match self.live && self.same_order {
            true => 1.0 + self.voltage / RATED_VOLTAGE,
            false => 0.0,
        }
    }
}

/// What a line that its grid has left draws from a genset that still feeds it, by the voltage of its dead phases.
pub(super) fn dead_line(volts: [f64; 3], dead: [bool; 3]) -> PhaseLoads {
    let kva: [f64; 3] = std::array::from_fn(|n| match dead[n] && volts[n] > LEAST_VOLTAGE {
        true => LINE_DRAWS * RATED_KVA / 3.0 * volts[n] / RATED_VOLTAGE,
        false => 0.0,
    });
    (kva.map(|kva| tenth(LINE_PARTS.0 * kva)), kva.map(|kva| tenth(LINE_PARTS.1 * kva)))
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
    /// Part of the grid's voltage that the genset sets against it in a jolt.
    against: f64,
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
    pub(super) fn meet(&mut self, dt: f64, joined: bool, stand: &Synchronism) -> bool {
        let released = matches!(self.tie, Tie::Jolting(left) if left <= 1.5 * dt);
        self.tie = match (joined, self.tie) {
            (false, _) => Tie::Apart,
            (true, Tie::Jolting(left)) if !released => Tie::Jolting(left - dt),
            // Where the release cannot open, the stronger has dragged the other into step by now, if there is one.
            (true, Tie::Jolting(_) | Tie::Together) if stand.same_order => Tie::Together,
            (true, Tie::Apart) if stand.is_safe() => Tie::Together,
            (true, _) => {
                self.against = stand.against();
                Tie::Jolting(RELEASE)
            }
        };
        joined && released
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
            let (sine, cosine) = self.angle.to_radians().sin_cos();
            self.active = SURGE * RATED_KVA * self.against * sine;
            self.reactive = SURGE * RATED_KVA * (self.against * cosine - 1.0);
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
    /// kW that it gives whatever is wanted of it; none where its governor does its work.
    pub(super) fn forced_active(&self) -> Option<f64> {
        match (self.running, self.runaway) {
            (false, _) => Some(-MOTORING),
            (_, true) => Some(engine::MOST_KW),
            _ => None,
        }
    }

    /// kvar that it gives whatever is wanted of it; none where its regulator does its work.
    pub(super) fn forced_reactive(&self) -> Option<f64> {
        match self.avr {
            // Without a field of its own it takes it from the others.
            Avr::Failed => Some(-0.7 * RATED_KVAR),
            Avr::High => Some(1.5 * RATED_KVAR),
            Avr::Normal => None,
        }
    }

    /// kW at a frequency that the grid holds.
    fn active(&self, hertz: f64) -> f64 {
        let governed = || RATED_KW * self.governor.part_at(RATED_RPM, hertz / HERTZ_PER_RPM);
        self.forced_active().unwrap_or_else(|| governed().max(-MOTORING))
    }

    /// kvar at a voltage that the grid holds.
    fn reactive(&self, volts: f64) -> f64 {
        let regulated = || RATED_KVAR * self.excitation.part_at(RATED_VOLTAGE, volts);
        self.forced_reactive().unwrap_or_else(regulated)
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
