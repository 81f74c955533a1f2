//! What the controller protects the site from: too much current, earth faults, power that flows back, sources that stay
//! joined, switches that open by themselves, contacts that ask for it, and modules that are silent.

use std::time::Duration;

use crate::settings::Settings;

use super::alarms::{Alarm, Board};
use super::inputs::{INPUT_MODULES, Input, Inputs, OUTPUT_MODULES};
use super::plant::Meter;
use super::shedding::Burden;
use super::supervision;
use super::switches::{Drive, Positions, Switch};
use super::timer::Lasting;

/// Part of the rated current that tells a phase that is there from one that is missing.
const FLOWS: f64 = 0.03;

/// Thresholds and delays as they are set.
#[derive(Clone, Debug, Default)]
pub(super) struct Limits {
    /// A.
    rated_current: f64,
    /// Parts of the rated current.
    overcurrent_warning: f64,
    overcurrent_warning_delay: Duration,
    overcurrent_trip: f64,
    overcurrent_trip_delay: Duration,
    /// Part of what a source can carry.
    overload: f64,
    overload_delay: Duration,
    /// Parts of the rated current.
    ground_warning: f64,
    ground_trip: f64,
    ground_delay: Duration,
    /// Part of what a source can carry.
    reverse_power: f64,
    reverse_power_delay: Duration,
    broken_wire_delay: Duration,
    parallel: Duration,
    forced_open_latches: bool,
    sync_latches: bool,
    modules_fault: bool,
    module_delay: Duration,
}

impl Limits {
    pub(super) fn of(settings: &Settings) -> Self {
        let part = |id| settings.number(id) / 100.0;
        Self {
            rated_current: settings.number("rated_current"),
            overcurrent_warning: part("overcurrent_warning"),
            overcurrent_warning_delay: settings.seconds("overcurrent_warning_delay"),
            overcurrent_trip: part("overcurrent_trip"),
            overcurrent_trip_delay: settings.seconds("overcurrent_trip_delay"),
            overload: part("overload_level"),
            overload_delay: settings.seconds("overload_delay"),
            ground_warning: part("ground_fault_warning_level"),
            ground_trip: part("ground_fault_level"),
            ground_delay: settings.seconds("ground_fault_delay"),
            reverse_power: part("reverse_power_level"),
            reverse_power_delay: settings.seconds("reverse_power_delay"),
            broken_wire_delay: settings.seconds("broken_wire_delay"),
            parallel: settings.seconds("parallel_time"),
            forced_open_latches: settings.is_on("forced_open_fault"),
            sync_latches: settings.is_on("sync_fault"),
            modules_fault: settings.is_on("module_fault"),
            module_delay: settings.seconds("module_delay"),
        }
    }

    /// A that the percentages are of.
    pub(super) fn rated_current(&self) -> f64 {
        self.rated_current
    }

    /// The alarm of sources that do not come together, where it stays until it is reset.
    pub(super) fn latched_sync_alarm(&self) -> Option<Alarm> {
        self.sync_latches.then_some(Alarm::SYNC_FAULT)
    }
}

/// What is looked at in one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub(super) meters: [&'a Meter; 2],
    /// All phases of the source are there, as far as can be told.
    pub(super) has_phases: [bool; 2],
    pub(super) burden: Burden,
    pub(super) positions: Positions,
    /// The relays of QS1, QTIE and QS2 that have operated.
    pub(super) relays: [bool; 3],
    /// The outputs under which the switches have moved.
    pub(super) drives: [Option<Drive>; 3],
    pub(super) inputs: &'a Inputs,
    pub(super) supervision: &'a supervision::Limits,
    /// The sources are waited for to come together, for too long.
    pub(super) sync_fails: bool,
}

/// How long things last, and what the alarms do not tell.
#[derive(Clone, Debug)]
pub(super) struct Protection {
    overcurrent_warning: [Lasting; 2],
    overcurrent_trip: [Lasting; 2],
    overload: Lasting,
    ground_warning: Lasting,
    ground_trip: [Lasting; 2],
    reverse_power: [Lasting; 2],
    missing: [Lasting; 2],
    parallel: Lasting,
    modules: [Lasting; INPUT_MODULES + OUTPUT_MODULES],
    /// Sources behind which the earth fault was seen.
    grounded: [bool; 2],
    broken_wire: [Option<usize>; 2],
    before: Positions,
}

impl Protection {
    pub(super) fn new(positions: Positions) -> Self {
        Self {
            overcurrent_warning: Default::default(),
            overcurrent_trip: Default::default(),
            overload: Lasting::default(),
            ground_warning: Lasting::default(),
            ground_trip: Default::default(),
            reverse_power: Default::default(),
            missing: Default::default(),
            parallel: Lasting::default(),
            modules: Default::default(),
            grounded: [false; 2],
            broken_wire: [None; 2],
            before: positions,
        }
    }

    pub(super) fn step(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        self.currents(dt, scene, limits, board);
        self.earth(dt, scene, limits, board);
        self.power(dt, scene, limits, board);
        self.wires(dt, scene, limits, board);
        self.switches(dt, scene, limits, board);
        self.contacts(dt, scene, limits, board);
    }

    fn currents(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        for source in 0..2 {
            let most = scene.meters[source].current.into_iter().fold(0.0, f64::max) / limits.rated_current;
            let warns = self.overcurrent_warning[source].step(
                dt,
                most > limits.overcurrent_warning,
                limits.overcurrent_warning_delay,
            );
            board.follow(Alarm::overcurrent_warning(source), warns);
            let too_much = most > limits.overcurrent_trip;
            if self.overcurrent_trip[source].step(dt, too_much, limits.overcurrent_trip_delay) {
                board.latch(Alarm::overcurrent_trip(source));
            }
        }
        let most = scene.burden.parts[0].max(scene.burden.parts[1]);
        let overload = self.overload.step(dt, most > limits.overload, limits.overload_delay);
        board.follow(Alarm::OVERLOAD, overload);
    }

    fn earth(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        // With a phase missing the other two leave much over, and no earth fault.
        let residual = |source: usize| match scene.has_phases[source] {
            true => scene.meters[source].residual.0 / limits.rated_current,
            false => 0.0,
        };
        let residuals = [residual(0), residual(1)];
        let warns = residuals.iter().any(|part| *part > limits.ground_warning);
        let warns = self.ground_warning.step(dt, warns, limits.ground_delay);
        for (source, part) in residuals.into_iter().enumerate() {
            if self.ground_trip[source].step(dt, part > limits.ground_trip, limits.ground_delay) {
                board.latch(Alarm::GROUND_FAULT);
                self.grounded[source] = true;
            }
        }
        board.follow(Alarm::GROUND_WARNING, warns);
    }

    fn power(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        for source in 0..2 {
            let part = scene.burden.parts[source];
            let back = part < -limits.reverse_power;
            if self.reverse_power[source].step(dt, back, limits.reverse_power_delay) {
                board.latch(Alarm::reverse_power(source));
            }
        }
    }

    /// A voltage that is missing where current flows is a broken wire.
    fn wires(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        for source in 0..2 {
            let meter = scene.meters[source];
            let missing = |phase: usize| scene.supervision.is_missing(meter.feed.voltage[phase]);
            let flows =
                |phase: &usize| missing(*phase) && meter.current[*phase] > FLOWS * limits.rated_current;
            let known = self.broken_wire[source].filter(|phase| missing(*phase));
            let suspect = (0..3).find(flows).filter(|_| (0..3).filter(|phase| missing(*phase)).count() == 1);
            let lasts = self.missing[source].step(dt, suspect.is_some(), limits.broken_wire_delay);
            self.broken_wire[source] = known.or(suspect.filter(|_| lasts));
            board.follow(Alarm::broken_wire(source), self.broken_wire[source].is_some());
        }
    }

    fn switches(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        for switch in Switch::ALL {
            let opened = self.before.is_closed(switch) && !scene.positions.is_closed(switch);
            let asked = scene.drives[switch as usize] == Some(Drive::Open);
            let relay = scene.relays[switch as usize].then_some(match switch {
                Switch::Qs1 => Alarm::short_circuit(0),
                Switch::Qs2 => Alarm::short_circuit(1),
                // The relay of the tie has no alarm of its own.
                Switch::Qtie => Alarm::tripped(switch),
            });
            if let Some(alarm) = relay.or((opened && !asked).then_some(Alarm::tripped(switch))) {
                board.latch(alarm);
            }
        }
        self.before = scene.positions;
        let joined = scene.positions == Positions::ALL_CLOSED;
        board.follow(Alarm::PARALLEL, self.parallel.step(dt, joined, limits.parallel));
        board.follow(Alarm::SYNC_WARNING, scene.sync_fails && !limits.sync_latches);
    }

    fn contacts(&mut self, dt: Duration, scene: Scene<'_>, limits: &Limits, board: &mut Board) {
        let forced = scene.inputs.has(Input::ForcedOpen);
        if forced && limits.forced_open_latches {
            board.latch(Alarm::FORCED_OPEN_FAULT);
        }
        board.follow(Alarm::FORCED_OPEN_WARNING, forced && !limits.forced_open_latches);
        let inputs = (0..).zip(scene.inputs.input_modules_cut);
        let outputs = (8..).zip(scene.inputs.output_modules_cut);
        for ((bit, cut), lasting) in inputs.chain(outputs).zip(&mut self.modules) {
            let silent = lasting.step(dt, cut, limits.module_delay);
            board.follow(Alarm::module(bit, true), silent && limits.modules_fault);
            board.follow(Alarm::module(bit, false), silent && !limits.modules_fault);
        }
    }

    /// The phase of a source whose voltage is missing only because its wire is broken.
    pub(super) fn broken_wire(&self, source: usize) -> Option<usize> {
        self.broken_wire[source]
    }

    /// Which of QS1, QTIE and QS2 have to be open until the alarms are reset: behind a source that saw a fault nothing is
    /// tried again, and neither from the other side.
    pub(super) fn locks(&self, board: &Board) -> Positions {
        let nobody = self.grounded == [false; 2];
        let faulted = |source: usize| {
            let grounded = board.has(Alarm::GROUND_FAULT) && (nobody || self.grounded[source]);
            let switch = Switch::OF_SOURCES[source];
            grounded
                || board.has(Alarm::short_circuit(source))
                || board.has(Alarm::overcurrent_trip(source))
                || board.has(Alarm::tripped(switch))
        };
        Positions::by(|switch| match switch {
            Switch::Qs1 => faulted(0) || board.has(Alarm::reverse_power(0)),
            Switch::Qs2 => faulted(1) || board.has(Alarm::reverse_power(1)),
            Switch::Qtie => faulted(0) || faulted(1) || board.has(Alarm::tripped(Switch::Qtie)),
        })
    }

    /// Everything has to be open: a contact asks for it, or has.
    pub(super) fn forces_open(&self, board: &Board) -> bool {
        board.has(Alarm::FORCED_OPEN_FAULT) || board.has(Alarm::FORCED_OPEN_WARNING)
    }

    pub(super) fn acknowledge(&mut self) {
        self.grounded = [false; 2];
    }
}
