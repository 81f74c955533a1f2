//! The two analog outputs GOV and AVR: they hold the frequency and the voltage of a genset that runs alone, lead it to
//! the mains, and move power and reactive power between the two.

use std::time::Duration;

use crate::plant::{HERTZ_PER_RPM, Plant, RATED_KVAR, RATED_KW, RATED_RPM, RATED_VOLTAGE};

use super::mains::is_order_wrong;
use super::measures::Measures;
use super::operation::Operation;
use super::parameters::{Control, Parameters, Transfer};

/// What the full scale of an output adds to and takes from a set point: rpm and V.
const GOV_SPAN: f64 = 90.0;
const AVR_SPAN: f64 = 24.0;
/// How far rated load bends the genset: 4 %, the usual setting where gensets run in parallel.
const SPEED_DROOP: f64 = 60.0;
const VOLTAGE_DROOP: f64 = 9.2;

/// How fast the outputs answer, 1/s.
const GAIN: f64 = 1.0;
/// Seconds in which an angle is worked off, and the greatest slip for it, Hz.
const ANGLE_SECONDS: f64 = 3.0;
const GREATEST_SLIP: f64 = 0.25;
/// For how long the two must agree before a contactor may close.
const IN_STEP_AFTER: Duration = Duration::from_millis(300);
/// Where an output stands that does not regulate.
const REST: f64 = 0.5;

/// Both outputs and what they follow.
#[derive(Clone, Debug)]
pub(super) struct Regulation {
    governor: Output,
    exciter: Output,
    /// kW that the genset is to carry in parallel.
    base: f64,
    agreed: Duration,
}

/// 0 to 1; the middle leaves the genset's own set point alone.
#[derive(Clone, Debug)]
struct Output {
    value: f64,
    /// How long it has stood at an end of its range.
    at_end: Duration,
}

/// What is wanted of the genset at this moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    pub(super) operation: Operation,
    /// The genset is ready for its load.
    pub(super) regulating: bool,
    /// kW that mains keep which only want help.
    pub(super) mains_keep: Option<f64>,
}

impl Regulation {
    /// Takes over a plant's genset.
    pub(super) fn new(plant: &mut Plant) -> Self {
        plant.engine.governor.droop = SPEED_DROOP;
        plant.excitation.droop = VOLTAGE_DROOP;
        Self { governor: Output::AT_REST, exciter: Output::AT_REST, base: 0.0, agreed: Duration::ZERO }
    }

    pub(super) fn governor(&self) -> f64 {
        self.governor.value
    }

    pub(super) fn exciter(&self) -> f64 {
        self.exciter.value
    }

    /// Whether an output has been at its end for too long.
    pub(super) fn governor_failed(&self, set: &Parameters) -> bool {
        self.governor.is_stuck(set.timers.control_fail)
    }

    pub(super) fn exciter_failed(&self, set: &Parameters) -> bool {
        self.exciter.is_stuck(set.timers.control_fail)
    }

    /// Whether genset and mains have agreed for long enough.
    pub(super) fn in_step(&self) -> bool {
        self.agreed >= IN_STEP_AFTER
    }

    /// Moves the outputs, and the plant's set points with them.
    pub(super) fn step(
        &mut self,
        dt: Duration,
        task: Task,
        measures: &Measures,
        plant: &mut Plant,
        set: &Parameters,
    ) {
        let transfer = &set.transfer;
        let missing = task.regulating.then(|| match plant.is_parallel() {
            true => self.missing_in_parallel(dt, task, measures, transfer),
            false => missing_alone(task.operation, plant),
        });
        self.governor.step(dt, transfer.governor, missing.map(|(rpm, _)| rpm / (2.0 * GOV_SPAN)));
        self.exciter.step(dt, transfer.exciter, missing.map(|(_, volts)| volts / (2.0 * AVR_SPAN)));
        if !plant.is_parallel() {
            self.base = measures.genset.total_active();
        }
        plant.engine.governor.trim = (2.0 * self.governor.value - 1.0) * GOV_SPAN;
        plant.excitation.trim = (2.0 * self.exciter.value - 1.0) * AVR_SPAN;
        self.agreed = if agree(plant, measures, set) { self.agreed + dt } else { Duration::ZERO };
    }

    /// rpm and V by which the set points miss the share of the load that the genset is to carry.
    fn missing_in_parallel(
        &mut self,
        dt: Duration,
        task: Task,
        measures: &Measures,
        transfer: &Transfer,
    ) -> (f64, f64) {
        let (mains, genset) = (&measures.mains, &measures.genset);
        let active = mains.total_active() + genset.total_active();
        let reactive = mains.total_reactive() + genset.total_reactive();
        let target = match (task.operation, task.mains_keep) {
            (Operation::GensetContactorSynch | Operation::SoftToMains, _) => 0.0,
            // No more than the genset has.
            (_, Some(kept)) => (active - kept).clamp(0.0, RATED_KW),
            _ => active,
        };
        let step = transfer.ramp * dt.as_secs_f64();
        self.base += (target - self.base).clamp(-step, step);
        let part = if active > 0.0 { self.base / active } else { 0.0 };
        (
            SPEED_DROOP * (self.base - genset.total_active()) / RATED_KW,
            VOLTAGE_DROOP * (part * reactive - genset.total_reactive()) / RATED_KVAR,
        )
    }
}

impl Output {
    const AT_REST: Self = Self { value: REST, at_end: Duration::ZERO };

    /// `missing` is a part of the output's range, none while it does not regulate.
    fn step(&mut self, dt: Duration, control: Control, missing: Option<f64>) {
        let Some(missing) = missing.filter(|_| control.enabled) else {
            *self = Self::AT_REST;
            return;
        };
        let towards = if control.reversed { -missing } else { missing };
        self.value = (self.value + GAIN * dt.as_secs_f64() * towards).clamp(0.0, 1.0);
        let at_end = self.value <= 0.0 || self.value >= 1.0;
        self.at_end = if at_end { self.at_end + dt } else { Duration::ZERO };
    }

    fn is_stuck(&self, patience: Duration) -> bool {
        !self.at_end.is_zero() && self.at_end >= patience
    }
}

/// rpm and V by which a genset beside the mains misses its nominal values, or the mains that it is to meet.
fn missing_alone(operation: Operation, plant: &Plant) -> (f64, f64) {
    let (mains, genset) = (&plant.mains, &plant.genset);
    let (rpm, volts) = if operation.is_synchronizing() {
        let slip = (-plant.angle() / (360.0 * ANGLE_SECONDS)).clamp(-GREATEST_SLIP, GREATEST_SLIP);
        ((mains.frequency + slip) / HERTZ_PER_RPM, mains.average_voltage())
    } else {
        (RATED_RPM, RATED_VOLTAGE)
    };
    (rpm - plant.engine.speed, volts - genset.average_voltage())
}

/// Whether a contactor may close between the two.
fn agree(plant: &Plant, measures: &Measures, set: &Parameters) -> bool {
    let (transfer, stands) = (&set.transfer, plant.synchronism());
    let orders = [&measures.mains, &measures.genset].map(is_order_wrong);
    stands.live
        && (orders == [false, false] || set.mains.any_order)
        && stands.angle.abs() < transfer.angle
        && stands.slip.abs() < transfer.slip
        && stands.voltage.abs() < transfer.volts
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENTH: Duration = Duration::from_millis(100);
    const USUAL: Control = Control { enabled: true, reversed: false };

    fn after(control: Control, missing: Option<f64>, tenths: u32) -> Output {
        let mut output = Output { value: 0.6, at_end: TENTH };
        (0..tenths).for_each(|_| output.step(TENTH, control, missing));
        output
    }

    #[test]
    fn an_output_goes_where_it_is_needed_unless_it_is_off_or_the_wrong_way_round() {
        assert!((after(USUAL, Some(0.1), 10).value - 0.7).abs() < 1e-9);
        assert!((after(Control { reversed: true, ..USUAL }, Some(0.1), 10).value - 0.5).abs() < 1e-9);
        for (control, missing) in [(Control { enabled: false, ..USUAL }, Some(0.1)), (USUAL, None)] {
            let output = after(control, missing, 10);
            assert_eq!((output.value, output.at_end), (REST, Duration::ZERO));
        }
    }

    #[test]
    fn an_output_that_stays_at_its_end_is_counted_until_it_leaves_it() {
        let mut output = after(USUAL, Some(-1.0), 20);
        assert_eq!(output.value, 0.0);
        assert!(output.at_end >= Duration::from_secs(1), "{output:?}");
        output.step(TENTH, USUAL, Some(0.5));
        assert_eq!(output.at_end, Duration::ZERO);
    }
}
