//! Datakom DKG-705: modes, clock and the situation the unit is in.
//!
//! Power-on finds the unit in AUTO with healthy mains that carry the load. `docs/imitation/datakom-dkg705.md` has its
//! states and what it does where the manual is silent.

mod alarms;
#[cfg(test)]
mod chaos;
mod clock;
mod ecu;
mod exerciser;
mod levers;
mod mains;
mod measures;
mod operation;
mod parameters;
mod protections;
mod regulation;
mod render;
mod sequence;
mod story;
#[cfg(test)]
mod transitions;
mod watches;

use std::time::Duration;

use busbar_modbus::ExceptionCode;
use busbar_profile::DateTime;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::{Controls, Plant, Tank};
use crate::random::Random;
use crate::rules::Refusals;
use crate::settings::Settings;

use alarms::{Alarms, Contacts, View};
use clock::Clock;
use ecu::Ecu;
use exerciser::Exerciser;
use mains::Mains;
use measures::Measures;
use operation::Operation;
use parameters::Parameters;
use protections::Protections;
use regulation::{Regulation, Task};
use sequence::{Demand, Sensed, Sequence};
use story::Scene;

const CLOCK: u16 = 0x0024;
const LAST_OF_CLOCK: u16 = 0x0029;
const MODE_KEYS: u16 = 0x0040;

/// kW below which a contactor may open after a soft transfer.
const NEXT_TO_NOTHING: f64 = 2.5;
/// How long the other genset of the busbar may be silent.
const PARTNER_SILENCE: Duration = Duration::from_secs(5);

/// The unit and its plant.
#[derive(Clone, Debug)]
pub(crate) struct DatakomDkg705 {
    plant: Plant,
    set: Parameters,
    measures: Measures,
    mains: Mains,
    sequence: Sequence,
    regulation: Regulation,
    protections: Protections,
    alarms: Alarms,
    ecu: Ecu,
    clock: Clock,
    exerciser: Exerciser,
    mode: Mode,
    last_key: Mode,
    peak: Peak,
    controls: Controls,
    block_heater: bool,
    fuel_pump: bool,
    sheds_load: bool,
    /// The site's lever: two wires of the genset's voltages have changed places.
    genset_swapped: bool,
    partner_silent: Duration,
    service: Service,
    story: bool,
    scene: Scene,
}

/// Bits of registers 003Dh and 0040h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Auto,
    Off,
    Test,
    LoadTest,
}

impl Mode {
    fn of(keys: u8) -> Option<Self> {
        match keys {
            0x10 => Some(Self::Auto),
            0x20 => Some(Self::Off),
            0x40 => Some(Self::Test),
            0x80 => Some(Self::LoadTest),
            _ => None,
        }
    }

    fn bit(self) -> u16 {
        match self {
            Self::Auto => 4,
            Self::Off => 5,
            Self::Test => 6,
            Self::LoadTest => 7,
        }
    }
}

/// Whether the mains need help, and for how long they have needed the contrary.
#[derive(Clone, Copy, Debug, Default)]
struct Peak {
    lopping: bool,
    doubted: Duration,
}

/// What stood on the counters when the genset was last serviced.
#[derive(Clone, Copy, Debug)]
struct Service {
    /// Engine hours.
    hours: f64,
    /// Days of the plant's time; negative where it was before power-on.
    days: f64,
}

impl DatakomDkg705 {
    /// A unit at power-on.
    pub(crate) fn new(seed: u64, story: bool, settings: &Settings) -> Self {
        let mut random = Random::new(seed ^ 0xD705);
        let mut plant = Plant::new(seed);
        if story {
            // Low enough that the story reaches the warning.
            plant.tank = Tank::new(24.9);
        }
        let (set, clock) = (Parameters::of(settings), Clock::at(DateTime::FIRST));
        Self {
            measures: Measures::of(&plant, &set.options, false),
            set,
            mains: Mains::GOOD,
            sequence: Sequence::new(),
            regulation: Regulation::new(&mut plant),
            protections: Protections::default(),
            alarms: Alarms::default(),
            ecu: Ecu::new(&plant),
            exerciser: Exerciser::at(&clock),
            clock,
            mode: Mode::Auto,
            last_key: Mode::Auto,
            peak: Peak::default(),
            controls: Controls { mains_breaker: true, ..Controls::default() },
            block_heater: false,
            fuel_pump: false,
            sheds_load: false,
            genset_swapped: false,
            partner_silent: Duration::ZERO,
            service: Service {
                hours: plant.engine.hours - random.between(20.0, 110.0),
                days: -random.between(20.0, 90.0),
            },
            story,
            scene: Scene::NOTHING,
            plant,
        }
    }

    /// The same unit with its clock set.
    pub(crate) fn starting(self, epoch: DateTime) -> Self {
        let clock = Clock::at(epoch);
        Self { exerciser: Exerciser::at(&clock), clock, ..self }
    }

    fn press(&mut self, keys: u8) {
        let Some(mode) = Mode::of(keys) else { return };
        if mode == Mode::Off && self.last_key == Mode::Off {
            self.sequence.stop_now(&self.set);
        }
        self.sequence.acknowledge();
        self.alarms.acknowledge();
        self.exerciser.cancel();
        let tests = matches!(mode, Mode::Test | Mode::LoadTest);
        if tests && self.set.exercise.by_buttons {
            self.exerciser.begin(self.set.exercise.duration, Mode::Auto);
        }
        (self.mode, self.last_key) = (mode, mode);
    }

    fn demand(&self) -> Demand {
        if self.is_locked() {
            return Demand::REST;
        }
        // Mains that are back must prove themselves, unless nothing has been started yet.
        let mains_missing = match self.sequence.is_committed() {
            true => !self.mains.is_trusted(),
            false => !self.mains.is_healthy(),
        };
        match self.mode {
            Mode::Off => Demand::REST,
            Mode::LoadTest => Demand::ON_LOAD,
            Mode::Auto if mains_missing || self.plant.remote_start => Demand::ON_LOAD,
            Mode::Auto if self.peak.lopping => Demand::PARALLEL,
            Mode::Auto => Demand::REST,
            Mode::Test if mains_missing && self.set.options.emergency_backup => Demand::ON_LOAD,
            Mode::Test => Demand::OFF_LOAD,
        }
    }

    /// A shutdown or a load dump keeps the genset at rest.
    fn is_locked(&self) -> bool {
        self.alarms.shutdown() || self.alarms.load_dump()
    }

    fn sensed(&self) -> Sensed {
        let (plant, measures, start) = (&self.plant, &self.measures, &self.set.start);
        Sensed {
            running: plant.engine.is_running(),
            turning: plant.engine.speed > 0.0,
            warm: (!start.by_coolant || measures.coolant >= start.warm)
                && (!start.by_oil || measures.oil >= start.warm),
            genset_healthy: self.is_genset_healthy(),
            mains_healthy: self.mains.is_healthy(),
            mains_trusted: self.mains.is_trusted(),
            genset_contactor: plant.genset_breaker.closed,
            mains_contactor: plant.mains_breaker.closed,
            in_step: self.regulation.in_step(),
            genset_unloaded: measures.genset.total_active() < NEXT_TO_NOTHING,
            // Power that flows back is no sign that the load has moved.
            mains_unloaded: measures.mains.total_active().abs() < NEXT_TO_NOTHING,
            jolting: plant.is_jolting(),
        }
    }

    fn is_genset_healthy(&self) -> bool {
        let (genset, limits) = (&self.measures.genset, &self.set.limits);
        let between = |value: f64, low: f64, high: f64| value > low && (high == 0.0 || value < high);
        // An alternator without voltage is never good, whatever is watched.
        genset.voltage.iter().all(|volts| {
            *volts > 100.0 && between(*volts, limits.low_voltage_shutdown, limits.high_voltage_shutdown)
        }) && between(genset.frequency, limits.low_frequency_warning, limits.high_frequency_warning)
    }

    fn contacts(&self) -> Contacts {
        let service = &self.set.service;
        let hours = self.plant.engine.hours - self.service.hours;
        let days = self.days() - self.service.days;
        let is_due = |passed: f64, interval: f64| interval > 0.0 && passed >= interval;
        Contacts {
            emergency_stop: self.plant.emergency_stop,
            charger_failed: self.plant.lever("charger") == Some(Position::Word("failed")),
            mains_contactor: self.plant.mains_breaker.closed,
            service_due: is_due(hours, service.hours) || is_due(days, service.days),
            partner_missing: self.partner_silent >= PARTNER_SILENCE,
        }
    }

    /// Since power-on.
    fn days(&self) -> f64 {
        self.plant.time / 86_400.0
    }

    /// Left until the situation changes by itself: of the operation, or of the wait for mains that are back.
    fn timer(&self) -> Duration {
        match self.sequence.operation() {
            Operation::LoadOnGenset => self.mains.wait(),
            _ => self.sequence.timer(),
        }
    }

    /// What the demonstration's story does to the plant, and whom it wants exercised.
    fn tell(&mut self) {
        if !self.story {
            return;
        }
        let scene = Scene::at(self.plant.time);
        self.plant.fail_mains(scene.mains_failed);
        self.plant.tank.other_draw = scene.fuel_draw;
        if let (None, Some(duration), Mode::Auto) = (self.scene.exercise, scene.exercise, self.mode) {
            self.exerciser.begin(duration, Mode::Auto);
            self.mode = Mode::LoadTest;
        }
        self.scene = scene;
    }

    fn exercise(&mut self, dt: Duration) {
        // The story has exercises of its own.
        let never = parameters::Exercise { hour: None, ..self.set.exercise.clone() };
        let set = if self.story { &never } else { &self.set.exercise };
        if let Some(mode) = self.exerciser.step(dt, &self.clock, set, self.mode) {
            self.mode = mode;
        }
    }

    /// Judges the mains, by their voltage and by what both feeds show while they are joined.
    fn judge_mains(&mut self, dt: Duration) {
        self.mains.step(dt, &self.plant.mains, &self.set.mains);
        let joined = self.plant.mains_breaker.closed && self.plant.genset_breaker.closed;
        let feeds = (&self.measures.mains, &self.measures.genset);
        if self.protections.step(dt, joined, feeds, &self.set.parallel, &self.set.mains) {
            self.mains.condemn();
        } else if self.mains.is_trusted() && !joined {
            self.protections.forget();
        }
    }

    /// Judges what is wrong, and has the sequence act on it.
    fn judge_alarms(&mut self, dt: Duration) {
        let view = View {
            measures: &self.measures,
            set: &self.set,
            sequence: &self.sequence,
            regulation: &self.regulation,
            protections: &self.protections,
            ecu: &self.ecu,
            site: self.contacts(),
        };
        self.alarms.step(dt, &view);
        if self.alarms.shutdown() {
            self.sequence.stop_now(&self.set);
        } else if self.alarms.load_dump() {
            self.sequence.dump_load(&self.set);
        }
    }

    /// Whether the mains need help: by what they carry before, and by what both carry after the genset has joined.
    fn judge_load(&mut self, dt: Duration) {
        let load = self.measures.mains.total_active() + self.measures.genset.total_active();
        let limits = &self.set.limits;
        self.sheds_load = match self.measures.genset.total_active() {
            power if limits.load_shedding_high == 0.0 => power < 0.0 && self.sheds_load,
            power if power > limits.load_shedding_high => true,
            power => self.sheds_load && power > limits.load_shedding_low,
        };
        let Some(set) = &self.set.peak else {
            self.peak = Peak::default();
            return;
        };
        let contrary = if self.peak.lopping { load < set.stop } else { load > set.start };
        self.peak.doubted = if contrary { self.peak.doubted + dt } else { Duration::ZERO };
        if contrary && self.peak.doubted >= set.delay {
            self.peak = Peak { lopping: !self.peak.lopping, doubted: Duration::ZERO };
        }
    }

    /// Switches the heater and the pump, each with its hysteresis.
    fn keep_ready(&mut self, dt: Duration) {
        let coolant = self.measures.coolant;
        self.block_heater =
            !self.plant.engine.firing && (coolant < 38.0 || self.block_heater && coolant < 42.0);
        let level = self.measures.fuel_level;
        self.fuel_pump = level < 19.0 || self.fuel_pump && level < 25.0;
        let alone = self.plant.lever("busbar.gensets") == Some(Position::Word("none"));
        let missing = self.set.options.partner && alone;
        self.partner_silent = if missing { self.partner_silent + dt } else { Duration::ZERO };
    }
}

impl Panel for DatakomDkg705 {
    fn step(&mut self, dt: Duration) {
        self.tell();
        // The plant first: the status then tells of contactors that have moved, in the same image.
        self.plant.step(dt.as_secs_f64(), &self.controls);
        self.measures = Measures::of(&self.plant, &self.set.options, self.genset_swapped);
        self.judge_mains(dt);
        self.judge_load(dt);
        self.exercise(dt);
        self.ecu.step(dt, &self.plant, &self.sequence, self.set.options.ecu);
        // Before anything is started: what was acknowledged and is still so keeps the genset where it is.
        self.judge_alarms(dt);
        let (demand, sensed) = (self.demand(), self.sensed());
        self.sequence.step(dt, demand, sensed, &self.set);
        let task = Task {
            operation: self.sequence.operation(),
            regulating: self.sequence.is_regulated(),
            mains_keep: self.set.peak.as_ref().filter(|_| demand.parallel).map(|peak| peak.mains),
        };
        self.regulation.step(dt, task, &self.measures, &mut self.plant, &self.set);
        self.keep_ready(dt);
        self.controls = Controls {
            block_heater: self.block_heater,
            fuel_pump: self.fuel_pump,
            load_shedding: self.sheds_load,
            ..self.sequence.controls(demand, sensed, &self.set)
        };
        self.clock.step(dt);
    }

    fn write(&mut self, address: u16, value: u16) {
        // The high byte is no part of an 8-bit register.
        let [_, low] = value.to_be_bytes();
        match address {
            CLOCK..=LAST_OF_CLOCK => self.clock.set(usize::from(address - CLOCK), low),
            MODE_KEYS => self.press(low),
            _ => {}
        }
    }

    fn is_silent(&self) -> bool {
        false
    }

    fn render(&self, bank: &mut Bank) {
        render::registers(self, bank);
    }

    fn refusals(&self) -> Refusals {
        Refusals {
            quantity: ExceptionCode::ILLEGAL_DATA_ADDRESS,
            // Decimal 10: the manual's own meaning, write protection.
            protected: ExceptionCode(10),
        }
    }

    fn configure(&mut self, settings: &Settings) {
        self.set = Parameters::of(settings);
        self.measures = Measures::of(&self.plant, &self.set.options, self.genset_swapped);
    }

    fn levers(&self) -> &'static [Lever] {
        levers::all()
    }

    fn lever(&self, id: &str) -> Option<Position> {
        self.own_lever(id).or_else(|| self.plant.lever(id))
    }

    fn pull(&mut self, id: &str, to: Position) {
        self.pull_own(id, to);
        self.plant.pull(id, to);
    }

    fn genset(&mut self) -> Option<&mut Plant> {
        Some(&mut self.plant)
    }

    fn inject(&mut self, point: &str, bit: u16, active: bool) -> bool {
        // The ECU's warning is the ECU's: it gets a fault to report.
        if (point, bit) == ("warning_alarms_1", alarms::ECU_WARNING) {
            self.ecu.sick = active;
            return true;
        }
        self.alarms.inject(point, bit, active)
    }
}
