//! The outputs to governor and voltage regulator, registers 10607 and 10608: they hold the frequency and the voltage of
//! a genset that runs alone, lead it to the mains, and move power and reactive power between the two.

use std::time::Duration;

use crate::plant::{HERTZ_PER_RPM, Plant, RATED_KVAR, RATED_KW, RATED_RPM, RATED_VOLTAGE, Synchronism};

use super::operation::Operation::{self, *};
use super::settings::Settings;

/// What the full scale of an output adds to and takes from a set point: rpm and V.
const GOVERNOR_SPAN: f64 = 90.0;
const REGULATOR_SPAN: f64 = 24.0;
/// How far rated load bends the genset: 4 %, the usual setting where gensets run in parallel.
const SPEED_DROOP: f64 = 60.0;
const VOLTAGE_DROOP: f64 = 9.2;

/// How fast the outputs answer, 1/s.
const GAIN: f64 = 1.0;
/// Seconds in which an angle is worked off, and the greatest slip for it, Hz.
const ANGLE_SECONDS: f64 = 3.0;
const GREATEST_SLIP: f64 = 0.25;

/// Agreement needed to close a breaker between two live sources: degrees, Hz, V, and for how long.
const ANGLE_WINDOW: f64 = 10.0;
const SLIP_WINDOW: f64 = 0.2;
const VOLTAGE_WINDOW: f64 = 8.0;
const IN_STEP_AFTER: Duration = Duration::from_millis(300);

/// A breaker carries next to nothing below this, kW.
const UNLOADED: f64 = 3.0;
/// Part of its rating that a genset beside the mains carries at least and at most.
const PARALLEL_PARTS: (f64, f64) = (0.1, 1.0);

/// Both outputs and what they follow.
#[derive(Clone, Debug)]
pub(super) struct Regulation {
    /// 0 to 1; the middle leaves the genset's own set point alone.
    governor: f64,
    regulator: f64,
    regulating: bool,
    /// kW that the genset is to carry in parallel, on its way to what is wanted.
    base: f64,
    agreed: Duration,
}

impl Regulation {
    /// Takes over a plant's genset.
    pub(super) fn new(plant: &mut Plant) -> Self {
        plant.engine.governor.droop = SPEED_DROOP;
        plant.excitation.droop = VOLTAGE_DROOP;
        Self { governor: 0.5, regulator: 0.5, regulating: false, base: 0.0, agreed: Duration::ZERO }
    }

    /// % of the outputs; nothing while nothing is regulated.
    pub(super) fn outputs(&self) -> (f64, f64) {
        match self.regulating {
            true => (100.0 * self.governor, 100.0 * self.regulator),
            false => (0.0, 0.0),
        }
    }

    /// Whether genset and mains have agreed for long enough.
    pub(super) fn in_step(&self) -> bool {
        self.agreed >= IN_STEP_AFTER
    }

    /// Moves the outputs, and the plant's set points with them.
    pub(super) fn step(
        &mut self,
        dt: Duration,
        operation: Operation,
        settings: &Settings,
        plant: &mut Plant,
    ) {
        let seconds = dt.as_secs_f64();
        self.regulating = operation.is_up_to_speed() && plant.engine.is_running();
        if self.regulating {
            let (rpm, volts) = match plant.is_parallel() {
                true => self.missing_in_parallel(seconds, operation, settings, plant),
                false => missing_alone(operation, plant),
            };
            self.governor = (self.governor + GAIN * seconds * rpm / (2.0 * GOVERNOR_SPAN)).clamp(0.0, 1.0);
            self.regulator =
                (self.regulator + GAIN * seconds * volts / (2.0 * REGULATOR_SPAN)).clamp(0.0, 1.0);
        } else {
            (self.governor, self.regulator) = (0.5, 0.5);
        }
        if !plant.is_parallel() {
            self.base = plant.genset.total_active();
        }
        plant.engine.governor.trim = (2.0 * self.governor - 1.0) * GOVERNOR_SPAN;
        plant.excitation.trim = (2.0 * self.regulator - 1.0) * REGULATOR_SPAN;
        self.agreed = if agree(plant) { self.agreed + dt } else { Duration::ZERO };
    }

    /// rpm and V by which the set points miss the share of the load that the genset is to carry.
    fn missing_in_parallel(
        &mut self,
        seconds: f64,
        operation: Operation,
        settings: &Settings,
        plant: &Plant,
    ) -> (f64, f64) {
        let (mains, genset) = (&plant.mains, &plant.genset);
        let active = mains.total_active() + genset.total_active();
        let reactive = mains.total_reactive() + genset.total_reactive();
        let (least, most) = (PARALLEL_PARTS.0 * RATED_KW, PARALLEL_PARTS.1 * RATED_KW);
        let target = match operation {
            PeakLopping => (active - settings.peak_lopping_power).clamp(least, most),
            Exporting => settings.export_power.clamp(least, most),
            TransferToGenset | OnLoad | SlaveOnLoad | SynchronizingBack => active,
            _ => 0.0,
        };
        let ramp = settings.load_ramp * seconds;
        self.base += (target - self.base).clamp(-ramp, ramp);
        // The genset carries the same part of both, as far as it can.
        let part = if active > 0.0 { (self.base / active).clamp(0.0, 1.0) } else { 0.0 };
        (
            SPEED_DROOP * (self.base - genset.total_active()) / RATED_KW,
            VOLTAGE_DROOP * (part * reactive - genset.total_reactive()) / RATED_KVAR,
        )
    }
}

/// Whether next to nothing flows from the genset, and from the mains.
pub(super) fn unloaded(plant: &Plant) -> (bool, bool) {
    let small = |kw: f64| kw.abs() < UNLOADED;
    (small(plant.genset.total_active()), small(plant.mains.total_active()))
}

/// rpm and V by which a genset beside the mains misses its nominal values, or the mains that it is to meet.
fn missing_alone(operation: Operation, plant: &Plant) -> (f64, f64) {
    let (mains, genset) = (&plant.mains, &plant.genset);
    let meets = operation.is_synchronizing() || operation == GensetBreakerActivation;
    let (rpm, volts) = if meets && mains.average_voltage() > 100.0 {
        let slip = (-plant.angle() / (360.0 * ANGLE_SECONDS)).clamp(-GREATEST_SLIP, GREATEST_SLIP);
        ((mains.frequency + slip) / HERTZ_PER_RPM, mains.average_voltage())
    } else {
        (RATED_RPM, RATED_VOLTAGE)
    };
    (rpm - plant.engine.speed, volts - genset.average_voltage())
}

fn agree(plant: &Plant) -> bool {
    let Synchronism { live, angle, slip, voltage, same_order } = plant.synchronism();
    live && same_order
        && angle.abs() < ANGLE_WINDOW
        && slip.abs() < SLIP_WINDOW
        && voltage.abs() < VOLTAGE_WINDOW
}
