//! Datakom DKG-705: modes, clock and the situation the unit is in.
//!
//! Power-on finds the unit in AUTO with healthy mains that carry the load.
//! Where the manual is silent this is what the imitation does:
//! - 8-bit registers take the low byte of a word; a mode is chosen by exactly one key, other words have no effect;
//! - each number of the clock counts at once if it is in its own range; a date that does not exist lasts till midnight;
//! - TEST runs the genset beside the load, and on load if the mains fail; LOAD TEST runs it on load;
//! - while the engine runs without load the status is 0, as the mains carry the load;
//! - OFF cools a running engine down first; OFF again stops it at once. OFF lets go of shutdowns and load dumps, which
//!   keep the genset from starting until then;
//! - a start that has opened the fuel is finished, even when the mains come back;
//! - the load moves between two live sources without a break and slowly, after synchronizing for as long as it takes,
//!   with a warning after a minute. With the mains dead it moves with a break;
//! - the warnings "genset on load" and "mains on load" are options of a site, and not used at this one;
//! - fuel level, oil temperature, charge input and reverse power have no limits in the table: those of a usual site;
//! - low and high rpm warn where low and high frequency do; the rpm shutdowns are not used;
//! - relays 1, 3 and 7 are the timed alarm, idle speed and stop; module 1 repeats functions, module 2 is not fitted;
//! - "auto ready" is AUTO without a shutdown or load dump, "load contactor" is either contactor;
//! - the synchroscope shows 0 while either source is dead, GOV and AVR stand at 50 % while they do not regulate;
//! - the transformer ratio is that of the primary, 200 to 5 A; the fuel economy is in kWh a litre;
//! - the exerciser runs by the demonstration's story alone.

mod alarms;
mod clock;
mod ecu;
mod mains;
mod operation;
mod regulation;
mod render;
mod sequence;
mod settings;
mod story;

use std::time::Duration;

use busbar_modbus::ExceptionCode;
use busbar_profile::DateTime;

use crate::bank::Bank;
use crate::levers::{Lever, Position};
use crate::panel::Panel;
use crate::plant::{self, Controls, Plant, Tank};
use crate::random::Random;
use crate::rules::Refusals;

use alarms::{Alarms, View};
use clock::Clock;
use ecu::Ecu;
use mains::Mains;
use operation::Operation;
use regulation::Regulation;
use sequence::{Demand, Sensed, Sequence};
use settings::SITE;
use story::Scene;

const CLOCK: u16 = 0x0024;
const LAST_OF_CLOCK: u16 = 0x0029;
const MODE_KEYS: u16 = 0x0040;

/// kW below which a contactor may open after a soft transfer.
const NEXT_TO_NOTHING: f64 = 2.5;

/// The unit and its plant.
#[derive(Clone, Debug)]
pub(crate) struct DatakomDkg705 {
    plant: Plant,
    mains: Mains,
    sequence: Sequence,
    regulation: Regulation,
    alarms: Alarms,
    ecu: Ecu,
    clock: Clock,
    mode: Mode,
    controls: Controls,
    block_heater: bool,
    fuel_pump: bool,
    story: bool,
    scene: Scene,
    hours_at_service: f64,
    /// Days between the last service and power-on.
    days_before: f64,
}

/// Bits of registers 003Dh and 0040h; the last key is always that of the mode.
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

impl DatakomDkg705 {
    /// A unit at power-on.
    pub(crate) fn new(seed: u64, story: bool) -> Self {
        let mut random = Random::new(seed ^ 0xD705);
        let mut plant = Plant::new(seed);
        if story {
            // Low enough that the story reaches the warning.
            plant.tank = Tank::new(24.9);
        }
        Self {
            mains: Mains::GOOD,
            sequence: Sequence::new(SITE),
            regulation: Regulation::new(&mut plant),
            alarms: Alarms::default(),
            ecu: Ecu::new(&plant),
            clock: Clock::at(DateTime::FIRST),
            mode: Mode::Auto,
            controls: Controls { mains_breaker: true, ..Controls::default() },
            block_heater: false,
            fuel_pump: false,
            story,
            scene: Scene::NOTHING,
            hours_at_service: plant.engine.hours - random.between(20.0, 110.0),
            days_before: random.between(20.0, 90.0),
            plant,
        }
    }

    /// The same unit with its clock set.
    pub(crate) fn starting(self, epoch: DateTime) -> Self {
        Self { clock: Clock::at(epoch), ..self }
    }

    fn press(&mut self, keys: u8) {
        let Some(mode) = Mode::of(keys) else { return };
        if mode == Mode::Off {
            if self.mode == Mode::Off {
                self.sequence.stop_now();
            }
            self.sequence.acknowledge();
            self.alarms.acknowledge();
        }
        self.mode = mode;
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
            Mode::Auto if mains_missing || self.scene.exerciser => Demand::ON_LOAD,
            Mode::Auto => Demand::REST,
            Mode::Test if mains_missing && SITE.emergency_backup => Demand::ON_LOAD,
            Mode::Test => Demand::OFF_LOAD,
        }
    }

    /// A shutdown or a load dump keeps the genset at rest.
    fn is_locked(&self) -> bool {
        self.alarms.shutdown() || self.alarms.load_dump()
    }

    fn sensed(&self) -> Sensed {
        let plant = &self.plant;
        let volts = SITE.low_voltage_shutdown..SITE.high_voltage_shutdown;
        let hertz = SITE.low_frequency_warning..SITE.high_frequency_warning;
        Sensed {
            running: plant.engine.is_running(),
            turning: plant.engine.speed > 0.0,
            genset_healthy: plant.genset.voltage.iter().all(|phase| volts.contains(phase))
                && hertz.contains(&plant.genset.frequency),
            mains_healthy: self.mains.is_healthy(),
            genset_contactor: plant.genset_breaker.closed,
            mains_contactor: plant.mains_breaker.closed,
            in_step: self.regulation.in_step(),
            genset_unloaded: plant.genset.total_active() < NEXT_TO_NOTHING,
            mains_unloaded: plant.mains.total_active() < NEXT_TO_NOTHING,
        }
    }

    fn service_due(&self) -> bool {
        let days = self.days_before + self.plant.time / 86_400.0;
        self.plant.engine.hours - self.hours_at_service >= SITE.service_hours || days >= SITE.service_days
    }

    /// Left until the situation changes by itself: of the operation, or of the wait for mains that are back.
    fn timer(&self) -> Duration {
        match self.sequence.operation() {
            Operation::LoadOnGenset => self.mains.wait(),
            _ => self.sequence.timer(),
        }
    }

    /// Switches the heater and the pump, each with its hysteresis.
    fn keep_ready(&mut self) {
        let coolant = self.plant.engine.coolant;
        self.block_heater =
            !self.plant.engine.firing && (coolant < 38.0 || self.block_heater && coolant < 42.0);
        let level = self.plant.tank.percent();
        self.fuel_pump = level < 19.0 || self.fuel_pump && level < 25.0;
    }
}

impl Panel for DatakomDkg705 {
    fn step(&mut self, dt: Duration) {
        let seconds = dt.as_secs_f64();
        self.scene = if self.story { Scene::at(self.plant.time) } else { Scene::NOTHING };
        if self.story {
            self.plant.fail_mains(self.scene.mains_failed);
        }
        self.plant.tank.other_draw = self.scene.fuel_draw;

        // The plant first: the status then tells of contactors that have moved, in the same image.
        self.plant.step(seconds, &self.controls);
        self.mains.step(dt, &self.plant.mains);
        if self.alarms.shutdown() {
            self.sequence.stop_now();
        } else if self.alarms.load_dump() {
            self.sequence.dump_load();
        }
        let (demand, sensed) = (self.demand(), self.sensed());
        self.sequence.step(dt, demand, sensed);
        let operation = self.sequence.operation();
        self.regulation.step(dt, operation, self.sequence.is_up_to_speed(), &mut self.plant);
        self.ecu.step(seconds, &self.plant, &self.sequence);
        self.keep_ready();
        self.controls = Controls {
            block_heater: self.block_heater,
            fuel_pump: self.fuel_pump,
            ..self.sequence.controls(demand, sensed)
        };
        let service_due = self.service_due();
        let view = View { plant: &self.plant, sequence: &self.sequence, ecu: &self.ecu, service_due };
        self.alarms.step(dt, &view);
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

    fn levers(&self) -> &'static [Lever] {
        plant::LEVERS
    }

    fn lever(&self, id: &str) -> Option<Position> {
        self.plant.lever(id)
    }

    fn pull(&mut self, id: &str, to: Position) {
        self.plant.pull(id, to);
    }
}
