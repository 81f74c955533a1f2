//! The speed governor: its set point with droop, how it answers a load, and how it can be sick.

use std::f64::consts::TAU;

use crate::random::{Random, approach};

use super::{RATED_KW, RATED_RPM};

/// The set point of a governor (rpm) or a voltage regulator (V).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Regulation {
    /// What a controller's analog output adds to it.
    pub(crate) trim: f64,
    /// By how much rated load bends it; 0 where it holds whatever the load.
    pub(crate) droop: f64,
}

impl Regulation {
    /// The speed or voltage at a part of rated load.
    pub(super) fn settles_at(&self, rated: f64, part: f64) -> f64 {
        rated + self.trim - self.droop * part
    }

    /// The part of rated load at which a busbar held by others is met; nothing without droop.
    pub(super) fn part_at(&self, rated: f64, held: f64) -> f64 {
        match self.droop {
            droop if droop > 0.0 => ((rated + self.trim - held) / droop).clamp(-0.2, 1.1),
            _ => 0.0,
        }
    }
}

/// What is wrong with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Fault {
    #[default]
    None,
    /// It swings about its set point.
    Hunting,
    /// The rack is stuck at full fuel.
    RunningAway,
    /// It answers late.
    Sluggish,
}

/// rpm and seconds of a swing.
const SWING: f64 = 60.0;
const PERIOD: f64 = 2.4;
/// rpm of a runaway, and of the dip that a step of rated load costs until the governor has answered.
const RUNAWAY_RPM: f64 = 1.35 * RATED_RPM;
const DIP: f64 = 90.0;
const SLUGGISH_DIP: f64 = 230.0;

#[derive(Clone, Debug, Default)]
pub(crate) struct Governor {
    /// What a controller's analog output adds to the set point, rpm.
    pub(crate) trim: f64,
    /// rpm by which rated load bends the set point; 0 where it holds whatever the load.
    pub(crate) droop: f64,
    pub(super) fault: Fault,
    /// Turns of the swing.
    phase: f64,
    /// kW it has already answered; the rest still pulls the speed down.
    answered: f64,
}

impl Governor {
    /// rpm that it steers to from a set point, with `load` in kW at the shaft.
    pub(super) fn answer(&mut self, dt: f64, rated: f64, load: f64, random: &mut Random) -> f64 {
        let (late, dip) = match self.fault {
            Fault::Sluggish => (4.0, SLUGGISH_DIP),
            _ => (0.9, DIP),
        };
        approach(&mut self.answered, load, late, dt);
        self.phase = (self.phase + dt / PERIOD).fract();
        let ripple = 1.2 * random.noise();
        match self.fault {
            Fault::RunningAway => RUNAWAY_RPM,
            _ if rated < RATED_RPM => rated + self.swing() + ripple,
            _ => {
                let settled = self.set_point().settles_at(rated, load / RATED_KW);
                settled - dip * (load - self.answered) / RATED_KW + ripple
            }
        }
    }

    /// The set point at this moment, swing included.
    pub(super) fn set_point(&self) -> Regulation {
        Regulation { trim: self.trim + self.swing(), droop: self.droop }
    }

    /// Nothing is left to answer.
    pub(super) fn rest(&mut self) {
        self.answered = 0.0;
    }

    /// rpm a second.
    pub(super) fn fastest_rise(&self) -> f64 {
        if self.fault == Fault::RunningAway { 200.0 } else { 600.0 }
    }

    fn swing(&self) -> f64 {
        if self.fault == Fault::Hunting { SWING * (TAU * self.phase).sin() } else { 0.0 }
    }
}
